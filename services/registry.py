"""The one table of modules: what there is to run, in the order of the cognitive cycle.

A module is imported when it is built: its process has no use for the others, and whoever configures
them has use for none.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import find_spec
from typing import TYPE_CHECKING

import msgspec

from cogmap.errors import UsageError
from cogmap.runtime import config

if TYPE_CHECKING:
    from cogmap.runtime.codelet import Codelet
    from cogmap.runtime.module import Module

    Build = Callable[[config.Sections, str], Module]


@dataclass(frozen=True)
class Entry:
    """A module's type of configuration, and how it is built from all sections and its instance."""

    config: type[msgspec.Struct]
    build: Build


def _sim() -> Entry:
    from cogmap.services.sim.config import Config

    def built(sections: config.Sections, name: str) -> Module:
        from cogmap.services.sim.module import build

        return build(config.typed(sections, "sim", Config), name)

    return Entry(Config, built)


def _sensory() -> Entry:
    from cogmap.services.sensory.config import Config

    def built(sections: config.Sections, name: str) -> Module:
        from cogmap.services.sensory.module import build

        return build(config.typed(sections, "sensory", Config), name)

    return Entry(Config, built)


def _epam() -> Entry:
    from cogmap.services.epam.config import Config

    def built(sections: config.Sections, name: str) -> Module:
        from cogmap.services.epam.module import build

        return build(config.typed(sections, "epam", Config), name)

    return Entry(Config, built)


def _workspace() -> Entry:
    from cogmap.services.workspace.config import Config

    def built(sections: config.Sections, name: str) -> Module:
        from cogmap.services.codelets.table import all_codelets, configured
        from cogmap.services.workspace.module import build

        codelets = configured(sections, all_codelets())
        return build(config.typed(sections, "workspace", Config), name, codelets)

    return Entry(Config, built)


def _codelets() -> Entry:
    from cogmap.services.codelets.config import Config

    def built(sections: config.Sections, name: str) -> Module:
        from cogmap.services.codelets.module import build
        from cogmap.services.codelets.table import all_codelets, configured

        return build(name, configured(sections, all_codelets()))

    return Entry(Config, built)


def _global_workspace() -> Entry:
    from cogmap.services.global_workspace.config import Config

    def built(sections: config.Sections, name: str) -> Module:
        from cogmap.services.global_workspace.module import build

        return build(config.typed(sections, "global_workspace", Config), name)

    return Entry(Config, built)


def _memory() -> Entry:
    from cogmap.services.memory.config import Config

    def built(sections: config.Sections, name: str) -> Module:
        from cogmap.services.memory.module import build

        return build(config.typed(sections, "memory", Config), name)

    return Entry(Config, built)


def _procedural() -> Entry:
    from cogmap.services.procedural.config import Config

    def built(sections: config.Sections, name: str) -> Module:
        from cogmap.services.procedural.module import build

        return build(config.typed(sections, "procedural", Config), name)

    return Entry(Config, built)


def _action() -> Entry:
    from cogmap.services.action.config import Config

    def built(sections: config.Sections, name: str) -> Module:
        from cogmap.services.action.module import build

        return build(config.typed(sections, "action", Config), name)

    return Entry(Config, built)


def _motor() -> Entry:
    from cogmap.services.motor.config import Config

    def built(sections: config.Sections, name: str) -> Module:
        from cogmap.services.motor.module import build

        return build(config.typed(sections, "motor", Config), name)

    return Entry(Config, built)


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

_OF_CODELETS = (
    "scipy.ndimage",
    "scipy.sparse.csgraph",
    "scipy.spatial",
    "scipy.optimize",
    "cogmap.services.codelets.table",
)


def codelets() -> tuple[Codelet, ...]:
    """All codelets that there are to run: ours, and those of other packages. Raises ConfigError."""
    from cogmap.services.codelets.table import all_codelets

    return all_codelets()


def _settings_of_codelets() -> dict[str, type[msgspec.Struct]]:
    """The types of the codelets' settings by section. Raises ConfigError."""
    return _settings_found_on(tuple(sys.path))


@cache
def _settings_found_on(path: tuple[str, ...]) -> dict[str, type[msgspec.Struct]]:
    """The same, where packages are found on that `path`."""
    from cogmap.runtime.codelet import ENTRY_POINTS

    if entry_points(group=ENTRY_POINTS):
        return {codelet.section: codelet.config for codelet in codelets()}

    from cogmap.services.codelets.sections import SECTIONS

    return SECTIONS


def config_type(name: str) -> type[msgspec.Struct]:
    """The configuration struct of a section: a module's, or that of another package's codelet.

    Raises UsageError naming the modules there are.
    """
    if name in _ENTRIES:
        return _ENTRIES[name]().config
    found = _settings_of_codelets().get(name)
    if found is not None:
        return found
    raise UsageError(f"no module {name!r}: there are {', '.join(MODULES)}")


def sections() -> tuple[str, ...]:
    """The sections that a configuration may have: modules, and codelets of other packages."""
    others = _settings_of_codelets().keys() - set(MODULES)
    return (*MODULES, *sorted(others))


def runs_codelets(name: str) -> bool:
    """Whether module `name` has the codelets in it."""
    return name in {"workspace", "codelets"}


def prepare(name: str) -> Iterator[None]:
    """Import what module `name` consists of, and begin what it waits for when it is built: in
    steps, so that something else can be done between them. Raises what an import raises.
    """
    if name == "sim":
        from cogmap.services.sim.rendering import egl_trial

        egl_trial.trial()
        yield

        if find_spec("pybullet") is not None:
            import_module("cogmap.services.sim.camera_level")
            yield

    if runs_codelets(name):
        for part in _OF_CODELETS:
            import_module(part)
            yield

    import_module(f"cogmap.services.{name}.module")
    yield


def build(name: str, settings: config.Sections, instance: str = "") -> Module:
    """Module `name`, configured from its section. Raises UsageError, ConfigError."""
    if not settings.keys() <= _ENTRIES.keys():
        config.check_sections(settings, sections())
    if name not in _ENTRIES:
        raise UsageError(f"no module {name!r}: there are {', '.join(MODULES)}")
    return _ENTRIES[name]().build(settings, instance or name)
