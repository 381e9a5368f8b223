"""The one table of modules: what there is to run, in the order of the cognitive cycle.

A module's package is imported when it is asked for: its process has no use for the others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import msgspec

from cogmap.errors import UsageError
from cogmap.runtime import config
from cogmap.runtime.codelet import Codelet
from cogmap.runtime.module import Module

Build = Callable[[config.Sections, str], Module]


@dataclass(frozen=True)
class Entry:
    """A module's type of configuration, and how it is built from all sections and its instance."""

    config: type[msgspec.Struct]
    build: Build


def _sim() -> Entry:
    from services.sim.module import Config, build

    return Entry(Config, lambda sections, name: build(config.typed(sections, "sim", Config), name))


def _sensory() -> Entry:
    from services.sensory.module import Config, build

    return Entry(
        Config, lambda sections, name: build(config.typed(sections, "sensory", Config), name)
    )


def _epam() -> Entry:
    from services.epam.module import Config, build

    return Entry(Config, lambda sections, name: build(config.typed(sections, "epam", Config), name))


def _workspace() -> Entry:
    from services.codelets.table import all_codelets, configured
    from services.workspace.module import Config, build

    def built(sections: config.Sections, name: str) -> Module:
        codelets = configured(sections, all_codelets())
        return build(config.typed(sections, "workspace", Config), name, codelets)

    return Entry(Config, built)


def _codelets() -> Entry:
    from services.codelets.module import Config, build
    from services.codelets.table import all_codelets, configured

    def built(sections: config.Sections, name: str) -> Module:
        return build(name, configured(sections, all_codelets()))

    return Entry(Config, built)


def _global_workspace() -> Entry:
    from services.global_workspace.module import Config, build

    return Entry(
        Config,
        lambda sections, name: build(config.typed(sections, "global_workspace", Config), name),
    )


def _memory() -> Entry:
    from services.memory.module import Config, build

    return Entry(
        Config, lambda sections, name: build(config.typed(sections, "memory", Config), name)
    )


def _procedural() -> Entry:
    from services.procedural.module import Config, build

    return Entry(
        Config, lambda sections, name: build(config.typed(sections, "procedural", Config), name)
    )


def _action() -> Entry:
    from services.action.module import Config, build

    return Entry(
        Config, lambda sections, name: build(config.typed(sections, "action", Config), name)
    )


def _motor() -> Entry:
    from services.motor.module import Config, build

    return Entry(
        Config, lambda sections, name: build(config.typed(sections, "motor", Config), name)
    )


_ENTRIES: dict[str, Callable[[], Entry]] = {
    "sim": _sim,
    "sensory": _sensory,
    "epam": _epam,
    "workspace": _workspace,
    "codelets": _codelets,
    "global_workspace": _global_workspace,
    "memory": _memory,
    "procedural": _procedural,
    "action": _action,
    "motor": _motor,
}

MODULES = tuple(_ENTRIES)


def codelets() -> tuple[Codelet, ...]:
    """All codelets that there are to run: ours, and those of other packages. Raises ConfigError."""
    from services.codelets.table import all_codelets

    return all_codelets()


def config_type(name: str) -> type[msgspec.Struct]:
    """The configuration struct of a section: a module's, or that of another package's codelet.

    Raises UsageError naming the modules there are.
    """
    if name in _ENTRIES:
        return _ENTRIES[name]().config
    for codelet in codelets():
        if codelet.section == name:
            return codelet.config
    raise UsageError(f"no module {name!r}: there are {', '.join(MODULES)}")


def sections() -> tuple[str, ...]:
    """The sections that a configuration may have: modules, and codelets of other packages."""
    others = {codelet.section for codelet in codelets()} - set(MODULES)
    return (*MODULES, *sorted(others))


def build(name: str, settings: config.Sections, instance: str = "") -> Module:
    """Module `name`, configured from its section. Raises UsageError, ConfigError."""
    if not settings.keys() <= _ENTRIES.keys():
        config.check_sections(settings, sections())
    if name not in _ENTRIES:
        raise UsageError(f"no module {name!r}: there are {', '.join(MODULES)}")
    return _ENTRIES[name]().build(settings, instance or name)
