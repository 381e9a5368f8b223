"""The buildings of a town that somebody has written. Pure."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.polylines import nearest_on_pieces
from cogmap.hints import did_you_mean
from cogmap.services.sim.layout.blocks.districts import FUNCTION_OF
from cogmap.services.sim.layout.catalogue import CATALOGUE, BuildingType, Colour
from cogmap.services.sim.layout.looks import drawn_from_name
from cogmap.services.sim.layout.plan import Plot, Road
from cogmap.services.sim.layout.written.tables import BuildingTable

KINDS = {kind.name: kind for kind in CATALOGUE}
USUAL_M = (8.0, 7.0, 6.0)
PLAIN = "plain"
OWN_LOOKS = ("size_m", "roof_rise_m", "wall", "accent", "door", "roof", "pattern")


def wrong_in(table: BuildingTable) -> tuple[str, str]:
    """Return the word that is wrong in a table, and why; two empty strings if nothing is."""
    if bool(table.kind) == bool(table.name):
        return "at_m", "a building has a kind that perception was taught, or a name: give one"

    if table.name in KINDS:
        text = f"{table.name!r} is a kind that perception was taught: write it as kind"
        return "name", text

    if table.kind and table.kind not in KINDS:
        otherwise = f"there are {', '.join(KINDS)}; give a building of your own a name instead"
        text = f"there is no kind {table.kind!r}: {did_you_mean(table.kind, KINDS, otherwise)}"
        return "kind", text

    if table.kind:
        unchanged = BuildingTable(at_m=table.at_m)
        for key in OWN_LOOKS:
            if getattr(table, key) != getattr(unchanged, key):
                text = f"a {table.kind} has the {key} of its kind: leave it out, or give a name"
                return key, text

    return "", ""


def plots(tables: Sequence[BuildingTable], roads: Sequence[Road]) -> list[Plot]:
    """Make the buildings, beside `roads`."""
    starts_m = np.array([road.start for road in roads])
    ends_m = np.array([road.end for road in roads])
    at_m = np.array([table.at_m for table in tables])
    foot_m = nearest_on_pieces(starts_m, ends_m, at_m).foot_m
    return [_plot(table, foot) for table, foot in zip(tables, foot_m, strict=True)]


def _plot(table: BuildingTable, street_m: Floats) -> Plot:
    """Make a building, whose nearest place on a street is (2,)."""
    x_m, y_m = table.at_m
    to_x_m, to_y_m = (street_m - table.at_m).tolist()
    front_rad = math.atan2(to_y_m, to_x_m)
    if table.front_deg is not None:
        front_rad = math.radians(table.front_deg)

    return Plot(
        kind=_kind(table),
        x_m=x_m,
        y_m=y_m,
        # A front looks to the right of its heading.
        heading_rad=math.remainder(front_rad + math.pi / 2, math.tau),
        district=table.district,
        function=table.function or FUNCTION_OF.get(table.kind, ""),
    )


def _kind(table: BuildingTable) -> BuildingType:
    """Return the kind of a building: one of the catalogue, or one that looks as it is written."""
    if table.kind:
        return KINDS[table.kind]

    drawn = drawn_from_name(table.name, table.size_m or USUAL_M)
    pattern = drawn.pattern if table.pattern is None else table.pattern
    return dataclasses.replace(
        drawn,
        wall=_colour(table.wall, drawn.wall),
        accent=_colour(table.accent, drawn.accent),
        door=_colour(table.door, drawn.door),
        roof=_colour(table.roof, drawn.roof),
        pattern="" if pattern == PLAIN else pattern,
        roof_rise_m=table.roof_rise_m,
    )


def _colour(written: str | None, otherwise: Colour) -> Colour:
    if written is None:
        return otherwise

    red, green, blue = bytes.fromhex(written.removeprefix("#"))
    return red, green, blue
