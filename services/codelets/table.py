"""The one table of codelets: ours, a row each, and those that other packages declare.

A package declares its own by an entry point of the group `cogmap.codelets`, whose object is a
Codelet. Ours are imported when they are to run: whoever configures them needs their settings alone.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from typing import NamedTuple

import msgspec

from cogmap.errors import ConfigError
from cogmap.runtime import config
from cogmap.runtime.codelet import ENTRY_POINTS, Codelet, ConfiguredCodelet


class Row(NamedTuple):
    """The module of a codelet, whose CODELET it is, and if it has settings, the module that has
    them: their SECTION and their type, Config.
    """

    module: str
    settings: str = ""


ROWS = (
    Row("correction.apply_correction", "config"),
    Row("correction.join_map"),
    Row("correction.sparse_path", "config"),
    Row("localization.localization", "config"),
    Row("localization.object_place", "config"),
    Row("mapping.charging_place"),
    Row("localization.landmarks", "config"),
    Row("mapping.road_place"),
    Row("mapping.boundary"),
    Row("mapping.path", "config"),
    Row("mapping.loop_detection", "config"),
    Row("correction.map_correction", "config"),
    Row("sub_maps.map_structure", "sub_maps.config"),
    Row("sub_maps.coarse_places"),
    Row("sub_maps.sub_map_places"),
    Row("planning.route_plan", "planning.config"),
    Row("attention.whereabouts"),
    Row("attention.novelty", "attention.novelty"),
    Row("attention.expectation", "attention.expectation"),
    Row("attention.goal"),
    Row("attention.need", "attention.need"),
    Row("attention.danger"),
    Row("attention.place_lost"),
    Row("attention.episode"),
    Row("individuals.merging"),
    Row("individuals.parting"),
)


@cache
def own_codelets() -> tuple[Codelet, ...]:
    """Return our codelets, in the order of ROWS."""
    modules = [import_module(f"{__package__}.{row.module}") for row in ROWS]
    return tuple(module.CODELET for module in modules)


@cache
def own_settings() -> dict[str, type[msgspec.Struct]]:
    """Return the types of our codelets' settings, by section."""
    named = {row.settings for row in ROWS if row.settings}
    modules = [import_module(f"{__package__}.{name}") for name in sorted(named)]
    return {module.SECTION: module.Config for module in modules}


def all_codelets() -> tuple[Codelet, ...]:
    """Return our codelets, then those of other packages, by name.

    Raises ConfigError if an entry point is no codelet or cannot be imported, or a name is taken.
    """
    codelets = list(own_codelets())
    names = {codelet.name for codelet in codelets}
    points = sorted(entry_points(group=ENTRY_POINTS), key=lambda point: point.name)

    for point in points:
        try:
            codelet = point.load()
        except Exception as error:  # another package's code may raise anything as it is imported
            reason = f"{type(error).__name__}: {error}"
            raise ConfigError(
                f"entry point {point.name} = {point.value} cannot be imported ({reason}): "
                "mend or uninstall its package"
            ) from error

        if not isinstance(codelet, Codelet):
            raise ConfigError(f"entry point {point.name} = {point.value} is no Codelet")
        if codelet.name in names:
            raise ConfigError(f"entry point {point.name}: there is a codelet {codelet.name!r}")

        names.add(codelet.name)
        codelets.append(codelet)

    return tuple(codelets)


def configured(
    sections: config.Sections, codelets: Iterable[Codelet]
) -> tuple[ConfiguredCodelet, ...]:
    """Give `codelets` their settings from `sections`. Raises ConfigError."""
    return tuple(
        ConfiguredCodelet(codelet, config.typed(sections, codelet.section, codelet.config))
        for codelet in codelets
    )
