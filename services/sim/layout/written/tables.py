"""A town as somebody writes it: tables of TOML. Positions are metres to the east and to the north,
directions degrees counter-clockwise from the east.
"""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from cogmap.schemas.base import Name

FARTHEST_M = 1000.0
"""A town is not larger than the paper's maps of cities, 4 km² (§6)."""

MOST = 1000
"""Of streets and of buildings: each is compared with every other."""

Coordinate = Annotated[float, msgspec.Meta(ge=-FARTHEST_M, le=FARTHEST_M)]
Place = tuple[Coordinate, Coordinate]
Degrees = Annotated[float, msgspec.Meta(ge=-360, le=360)]
Side = Annotated[float, msgspec.Meta(ge=3, le=100)]
Height = Annotated[float, msgspec.Meta(ge=2.5, le=120)]
Hexadecimal = Annotated[str, msgspec.Meta(pattern="^#[0-9a-fA-F]{6}$")]
Pattern = Literal[
    "plain",
    "bands",
    "stripes",
    "columns",
    "checker",
    "planks",
    "timber",
    "cross",
    "grid",
    "shutters",
]
Function = Literal["", "shop", "home", "school", "office", "works"]


class StartTable(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Where the robot begins, and where it looks."""

    at_m: Place
    heading_deg: Degrees = 0.0


class StreetTable(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A street: the corners of its centre line, and the width between its kerbs."""

    name: Name
    line_m: Annotated[list[Place], msgspec.Meta(min_length=2, max_length=MOST)]
    width_m: Annotated[float, msgspec.Meta(ge=3, le=30)] = 8.0


class BuildingTable(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A building: of a `kind` that perception was taught, or of a `name` of one's own.

    `front_deg` is where its front looks, to the nearest street if it is left out. What is left out
    of the looks of one of one's own follows from its name; `size_m` is width, depth and height.
    """

    at_m: Place
    kind: str = ""
    name: str = ""
    front_deg: Degrees | None = None
    size_m: tuple[Side, Side, Height] | None = None
    roof_rise_m: Annotated[float, msgspec.Meta(ge=0, le=10)] = 0.0
    wall: Hexadecimal | None = None
    accent: Hexadecimal | None = None
    door: Hexadecimal | None = None
    roof: Hexadecimal | None = None
    pattern: Pattern | None = None
    function: Function = ""
    district: str = ""


class ChargingTable(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A place at which the robot's battery is charged."""

    at_m: Place


class GoalTable(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A goal of the agent: a building, by its kind or its name, or a place."""

    building: str = ""
    at_m: Place | None = None


class TownTables(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The whole town."""

    start: StartTable
    street: Annotated[list[StreetTable], msgspec.Meta(min_length=1, max_length=MOST)]
    building: Annotated[list[BuildingTable], msgspec.Meta(min_length=1, max_length=MOST)]
    charging_place: Annotated[list[ChargingTable], msgspec.Meta(max_length=MOST)] = []
    goal: Annotated[list[GoalTable], msgspec.Meta(max_length=MOST)] = []
