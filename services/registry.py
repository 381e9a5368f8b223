"""The one table of modules: what there is to run, in the order of the cognitive cycle."""

from __future__ import annotations

import importlib
from typing import Any

import msgspec

from cogmap.errors import UsageError
from cogmap.runtime import config
from cogmap.runtime.module import Module

MODULES = ("sim", "sensory", "epam", "workspace", "codelets", "global_workspace", "action")


def config_type(name: str) -> type[msgspec.Struct]:
    """The configuration struct of a module. Raises UsageError naming the modules there are."""
    kind: type[msgspec.Struct] = _module(name).Config
    return kind


def build(name: str, sections: config.Sections, instance: str = "") -> Module:
    """Module `name`, configured from its section. Raises UsageError, ConfigError."""
    config.check_sections(sections, MODULES)
    module: Module = _module(name).build(
        config.typed(sections, name, config_type(name)), instance or name
    )
    return module


def _module(name: str) -> Any:
    if name not in MODULES:
        raise UsageError(f"no module {name!r}: there are {', '.join(MODULES)}")
    return importlib.import_module(f"services.{name}.module")
