"""The towns that there are to drive in. Pure, but for the extract that one is read from."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from cogmap.errors import ConfigError
from cogmap.services.sim.layout.blocks import town as blocks
from cogmap.services.sim.layout.charging import with_charging_places
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.starts import another_start
from cogmap.services.sim.layout.town import generate

LOOP = "loop"
BLOCKS = "blocks"
OSM = "osm:"


def check(town: str) -> None:
    """Raise ConfigError if there is no town of that name: LOOP, BLOCKS, or OSM and a path."""
    is_extract = town.startswith(OSM) and town != OSM
    if not is_extract and town not in (LOOP, BLOCKS):
        raise ConfigError(
            f"there is no town {town!r}: choose {LOOP}, {BLOCKS} or {OSM}FILE, the path of an "
            "OpenStreetMap extract"
        )


def place(
    town: str, seed: int, size_m: float, *, start: int = 0, charging_places: int = 0
) -> Place:
    """Make the town of that name, with so many charging places.

    It is LOOP or BLOCKS, from `seed`, or OSM and the path of an extract; `size_m` is the side of a
    town of blocks. The robot begins where it usually does, or at another `start`, numbered from 1.
    Raises UsageError if the extract makes no town, or the town has no room for so many charging
    places.
    """
    made = with_charging_places(_bare(town, seed, size_m), seed, charging_places)
    if not start:
        return made
    return dataclasses.replace(made, start=another_start(made, start))


def _bare(town: str, seed: int, size_m: float) -> Place:
    if town == LOOP:
        return generate(seed)
    if town.startswith(OSM):
        # It takes as long to import as all the rest, and few drive there.
        from cogmap.services.sim.layout.osm import town as osm

        return osm.read(Path(town.removeprefix(OSM)))

    return blocks.generate(seed, size_m)
