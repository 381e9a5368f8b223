"""The towns that there are to drive in. Pure, but for the files that some are read from."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from cogmap.errors import ConfigError
from cogmap.services.sim.layout.blocks import town as blocks
from cogmap.services.sim.layout.charging import with_charging_places
from cogmap.services.sim.layout.furniture import CHARGING_PLACE
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.starts import another_start
from cogmap.services.sim.layout.town import generate

LOOP = "loop"
BLOCKS = "blocks"
OSM = "osm:"
WRITTEN = ".toml"


def check(town: str) -> None:
    """Raise ConfigError if there is no town of that name: LOOP, BLOCKS, OSM and a path, or a path
    that ends in WRITTEN.
    """
    if not is_file(town) and town not in (LOOP, BLOCKS):
        raise ConfigError(
            f"there is no town {town!r}: choose {LOOP}, {BLOCKS}, {OSM}FILE, the path of an "
            f"OpenStreetMap extract, or FILE{WRITTEN}, a town of your own"
        )


def is_file(town: str) -> bool:
    """Decide whether a town is read from a file."""
    is_extract = town.startswith(OSM) and town != OSM
    return is_extract or is_written(town)


def is_written(town: str) -> bool:
    """Decide whether a town is one that somebody has written, rather than an extract."""
    return town.endswith(WRITTEN) and not town.startswith(OSM)


def called(town: str, seed: int) -> str:
    """Return what people call a town: by its seed, or by its file."""
    if town == LOOP:
        return f"town {seed}"
    if town == BLOCKS:
        return f"town {seed} of blocks"
    return f"the town in {town.removeprefix(OSM)}"


def place(
    town: str, seed: int, size_m: float, *, start: int = 0, charging_places: int = 0
) -> Place:
    """Make the town of that name, with so many charging places.

    It is LOOP or BLOCKS, from `seed`, OSM and the path of an extract, or the path of a town that
    somebody has written, which keeps its own charging places if there are to be any; `size_m` is
    the side of a town of blocks. The robot begins where it usually does, or at another `start`,
    numbered from 1. Raises UsageError if the file makes no town, or the town has no room for so
    many charging places.
    """
    made = _charging(_bare(town, seed, size_m), seed, charging_places)
    if not start:
        return made
    return dataclasses.replace(made, start=another_start(made, start))


def _charging(bare: Place, seed: int, count: int) -> Place:
    """Return the place with charging places: with its own, if it has some, else with `count`."""
    if not bare.charging_places:
        return with_charging_places(bare, seed, count)
    if count:
        return bare

    props = tuple(prop for prop in bare.props if prop.kind != CHARGING_PLACE)
    return dataclasses.replace(bare, props=props)


def _bare(town: str, seed: int, size_m: float) -> Place:
    if town == LOOP:
        return generate(seed)
    # What reads files takes as long to import as all the rest, and few drive there.
    if town.startswith(OSM):
        from cogmap.services.sim.layout.osm import town as osm

        return osm.read(Path(town.removeprefix(OSM)))

    if is_written(town):
        from cogmap.services.sim.layout.written import town as written

        return written.read(Path(town))

    return blocks.generate(seed, size_m)
