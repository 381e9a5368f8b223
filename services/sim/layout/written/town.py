"""A town that somebody has written as TOML, and the sentences that tell what is wrong in it."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from cogmap.data.toml_tables import Source, read_tables
from cogmap.geometry.se2 import transform_to
from cogmap.hints import did_you_mean
from cogmap.schemas.sensing import Pose
from cogmap.services.sim.layout.charging import SIZE_M
from cogmap.services.sim.layout.furniture import CHARGING_PLACE, Prop
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.plan import Plot, Point, Road
from cogmap.services.sim.layout.written import overlaps
from cogmap.services.sim.layout.written.buildings import plots, wrong_in
from cogmap.services.sim.layout.written.tables import GoalTable, TownTables

REMEDY = "name one that exists, or write one: `cogmap town example > mytown.toml`"
# From a street to a charging place at most: less than the distance at which a robot is charged.
BESIDE_M = 4.0
# Free around the start: more than the robot's radius.
ROOM_M = 1.0


@dataclass(frozen=True)
class WrittenGoal:
    """A goal: a building, by its name, or a place where that is empty; where it is on the agent's
    map, whose origin is the start.
    """

    building: str
    x_m: float
    y_m: float

    @property
    def name(self) -> str:
        """Return what the goal is called: the building, or the place as `cogmap goal` has it."""
        return self.building or f"{self.x_m:g},{self.y_m:g}"


@dataclass(frozen=True)
class WrittenTown(Place):
    """A town with the goals that the agent is given in it."""

    goals: tuple[WrittenGoal, ...]


def read(path: Path) -> WrittenTown:
    """Read a town. Raises ConfigError that names the file, the line and the remedy."""
    source, tables = read_tables(path, TownTables, "town", REMEDY)
    streets = _streets(source, tables)
    roads = [road for street in streets for road in street]
    buildings = _buildings(source, tables, roads)
    start = _start(source, tables, roads)

    return WrittenTown(
        seed=0,
        roads=tuple(roads),
        plots=tuple(buildings),
        props=_charging_places(source, tables, roads, buildings),
        start=start,
        goals=_goals(source, tables, start, buildings),
    )


def _streets(source: Source, tables: TownTables) -> list[list[Road]]:
    """Make the roads of each street, a straight one from corner to corner."""
    names = Counter(street.name for street in tables.street)
    streets = []
    for number, street in enumerate(tables.street):
        if names[street.name] > 1:
            text = f"two streets are named {street.name!r}: give one another name"
            raise source.error("street", number, street.name, text)

        roads = []
        for start, end in pairwise(street.line_m):
            if start == end:
                text = f"{street.name!r} has a corner twice in a row: leave one out"
                raise source.error("street", number, "line_m", text)
            roads.append(Road(street.name, start, end, street.width_m))
        streets.append(roads)

    surfaces = [[overlaps.of_road(road) for road in roads] for roads in streets]
    for number in overlaps.apart(surfaces):
        name = tables.street[number].name
        text = f"no street leads from {tables.street[0].name!r} to {name!r}: let it touch another"
        raise source.error("street", number, "line_m", text)
    return streets


def _buildings(source: Source, tables: TownTables, roads: list[Road]) -> list[Plot]:
    """Make the buildings, which stand on no street and on no other building."""
    for number, table in enumerate(tables.building):
        word, text = wrong_in(table)
        if word:
            raise source.error("building", number, word, text)

    made = plots(tables.building, roads)
    boxes = [overlaps.of_plot(plot) for plot in made]
    on_street = overlaps.first_meeting(boxes, [overlaps.of_road(road) for road in roads])
    if on_street is not None:
        number, road = on_street
        text = (
            f"the {made[number].kind.name} stands on {roads[road].name!r}: move it "
            f"{_clear_m(made[number], roads[road]):.1f} m from the middle of the street"
        )
        raise source.error("building", number, "at_m", text)

    on_another = overlaps.first_meeting(boxes, boxes)
    if on_another is not None:
        number, other = on_another
        text = (
            f"the {made[number].kind.name} overlaps the {made[other].kind.name}: move one of them"
        )
        raise source.error("building", max(number, other), "at_m", text)
    return made


def _clear_m(plot: Plot, road: Road) -> float:
    """Return how far from the middle of a road a building stands clear of it, however turned."""
    return road.width_m / 2 + math.hypot(plot.kind.width_m, plot.kind.depth_m) / 2


def _start(source: Source, tables: TownTables, roads: list[Road]) -> Pose:
    """Return where the robot begins, which is on a street."""
    table = tables.start
    if not any(overlaps.holds(overlaps.of_road(road, -ROOM_M), table.at_m) for road in roads):
        x_m, y_m = roads[0].middle
        text = (
            f"the start is on no street, {ROOM_M:g} m from its kerbs at least: "
            f"[{x_m:g}, {y_m:g}] is on {roads[0].name!r}"
        )
        raise source.error("start", 0, "at_m", text)

    x_m, y_m = table.at_m
    return Pose(x_m=x_m, y_m=y_m, heading_rad=math.radians(table.heading_deg))


def _charging_places(
    source: Source, tables: TownTables, roads: list[Road], buildings: list[Plot]
) -> tuple[Prop, ...]:
    """Make the charging places, which stand beside streets."""
    props = []
    for number, table in enumerate(tables.charging_place):
        wrong = _wrong_place(table.at_m, roads, buildings)
        if wrong:
            text = f"a charging place {wrong}: put it beside one, {BESIDE_M:g} m away at most"
            raise source.error("charging_place", number, "at_m", text)

        x_m, y_m = table.at_m
        props.append(Prop(CHARGING_PLACE, x_m, y_m, heading_rad=0.0, size_m=SIZE_M, look=0))
    return tuple(props)


def _wrong_place(at_m: Point, roads: list[Road], buildings: list[Plot]) -> str:
    """Tell what is wrong with a charging place; an empty string if nothing is."""
    for road in roads:
        if overlaps.holds(overlaps.of_road(road, SIZE_M[0] / 2), at_m):
            return f"stands on {road.name!r}"

    for plot in buildings:
        if overlaps.holds(overlaps.of_plot(plot), at_m):
            return f"stands in the {plot.kind.name}"

    if not any(overlaps.holds(overlaps.of_road(road, BESIDE_M), at_m) for road in roads):
        return "is far from every street"
    return ""


def _goals(
    source: Source, tables: TownTables, start: Pose, buildings: list[Plot]
) -> tuple[WrittenGoal, ...]:
    """Make the agent's goals, in the frame of its start."""
    pose = np.array([start.x_m, start.y_m, start.heading_rad])
    names = sorted({plot.kind.name for plot in buildings})
    goals = []
    for number, table in enumerate(tables.goal):
        word, text = _wrong_goal(table, names, buildings)
        if word:
            raise source.error("goal", number, word, text)

        at_m = table.at_m or next(
            (plot.x_m, plot.y_m) for plot in buildings if plot.kind.name == table.building
        )
        x_m, y_m = transform_to(pose, np.array(at_m)).round(2).tolist()
        goals.append(WrittenGoal(table.building, x_m, y_m))
    return tuple(goals)


def _wrong_goal(table: GoalTable, names: list[str], buildings: list[Plot]) -> tuple[str, str]:
    """Return the word that is wrong in a goal, and why; two empty strings if nothing is."""
    if bool(table.building) == (table.at_m is not None):
        return "goal", "a goal is a building or a place: give building or at_m, and not both"

    if table.at_m is None:
        if table.building in names:
            return "", ""
        meant = did_you_mean(table.building, names, f"there are {', '.join(names)}")
        return "building", f"the town has no building {table.building!r}: {meant}"

    for plot in buildings:
        if overlaps.holds(overlaps.of_plot(plot), table.at_m):
            return "at_m", f"a goal lies in the {plot.kind.name}: give building instead"
    return "", ""
