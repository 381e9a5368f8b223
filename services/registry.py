"""The one table of modules: what there is to run, in the order of the cognitive cycle.

A module is imported when it is built: its process has no use for the others, and whoever configures
them has use for none.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterator
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import find_spec
from inspect import signature
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from cogmap.errors import UsageError
from cogmap.runtime import config, run

if TYPE_CHECKING:
    from cogmap.runtime.codelet import Codelet, ConfiguredCodelet
    from cogmap.runtime.module import Module


class Entry(NamedTuple):
    """The import strings of a module's type of configuration, and of the function that builds it.

    That function takes what it needs by name: `config`, its section; `instance`, its name; `run`,
    the facts of the run; `codelets`, the configured codelets.
    """

    config: str
    build: str


MODULES = (
    "sim",
    "player",
    "sensory",
    "epam",
    "workspace",
    "codelets",
    "global_workspace",
    "memory",
    "procedural",
    "action",
    "motor",
)

SIM = "sim"
PLAYER = "player"

BODIES = (SIM, PLAYER)
"""The modules that stand for the robot in its world, of which one takes part in a run: simulated,
or recorded.
"""

ENTRIES = {
    name: Entry(f"cogmap.services.{name}.config:Config", f"cogmap.services.{name}.module:build")
    for name in MODULES
}

_OF_CODELETS = (
    "scipy.ndimage",
    "scipy.sparse.csgraph",
    "scipy.spatial",
    "scipy.optimize",
)


def taking_part(body: str = SIM) -> tuple[str, ...]:
    """Return the modules of a run with that one of BODIES."""
    return tuple(name for name in MODULES if name == body or name not in BODIES)


def codelets() -> tuple[Codelet, ...]:
    """Return all codelets to run: ours, and those of other packages. Raises ConfigError."""
    return _codelets_found_on(tuple(sys.path))


@cache
def _codelets_found_on(path: tuple[str, ...]) -> tuple[Codelet, ...]:
    """Return all codelets, where packages are found on that `path`: to look for packages takes as
    long as to build a module.
    """
    from cogmap.services.codelets.table import all_codelets

    return all_codelets()


def _settings_of_codelets() -> dict[str, type[msgspec.Struct]]:
    """Return the types of the codelets' settings by section. Raises ConfigError."""
    return _settings_found_on(tuple(sys.path))


@cache
def _settings_found_on(path: tuple[str, ...]) -> dict[str, type[msgspec.Struct]]:
    """Return the types of the codelets' settings, where packages are found on that `path`."""
    from cogmap.runtime.codelet import ENTRY_POINTS

    if entry_points(group=ENTRY_POINTS):
        return {codelet.section: codelet.config for codelet in codelets() if codelet.section}

    from cogmap.services.codelets.table import own_settings

    return own_settings()


def config_type(name: str) -> type[msgspec.Struct]:
    """Return the configuration struct of a section: the run's, a module's, or that of another
    package's codelet.

    Raises UsageError naming the modules there are.
    """
    if name == run.SECTION:
        return run.Run
    if name in ENTRIES:
        kind: type[msgspec.Struct] = resolve_name(ENTRIES[name].config)
        return kind
    found = _settings_of_codelets().get(name)
    if found is not None:
        return found
    raise UsageError(f"no module {name!r}: there are {', '.join(MODULES)}")


def sections() -> tuple[str, ...]:
    """List the sections that a configuration may have: the run, modules, and codelets of others."""
    others = _settings_of_codelets().keys() - set(MODULES)
    return (run.SECTION, *MODULES, *sorted(others))


def runs_codelets(name: str) -> bool:
    """Decide whether module `name` has the codelets in it."""
    return name in {"workspace", "codelets"}


def prepare(name: str) -> Iterator[None]:
    """Import what module `name` consists of, and begin what it waits for when it is built: in
    steps, so that something else can be done between them. Raises what an import raises.
    """
    if name == SIM:
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

        from cogmap.services.codelets.table import own_codelets

        own_codelets()
        yield

    resolve_name(ENTRIES[name].build)
    yield


def build(
    name: str, settings: config.Sections, instance: str = "", only: Collection[str] = ()
) -> Module:
    """Build module `name`, configured from its section. Of the codelets it has `only` those, by
    name, or all if none is named. Raises UsageError, ConfigError.
    """
    if not settings.keys() <= {run.SECTION, *MODULES}:
        config.check_sections(settings, sections())
    if name not in ENTRIES:
        raise UsageError(f"no module {name!r}: there are {', '.join(MODULES)}")

    def configured_codelets() -> tuple[ConfiguredCodelet, ...]:
        from cogmap.services.codelets.table import configured

        found = codelets()
        chosen = [codelet for codelet in found if not only or codelet.name in only]
        return configured(settings, chosen)

    facts = config.typed(settings, run.SECTION, run.Run)
    available: dict[str, Callable[[], Any]] = {
        "config": lambda: config.typed(settings, name, config_type(name)),
        "instance": lambda: instance or name,
        "run": lambda: facts,
        "codelets": configured_codelets,
    }
    make = resolve_name(ENTRIES[name].build)
    arguments = {parameter: available[parameter]() for parameter in signature(make).parameters}
    module: Module = make(**arguments)
    module.is_lockstep = facts.lockstep
    return module
