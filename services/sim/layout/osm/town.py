"""A town from an OpenStreetMap extract."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cogmap.data import osm
from cogmap.errors import ConfigError
from cogmap.geometry.arrays import Booleans, Floats
from cogmap.geometry.geographic import plane_m
from cogmap.schemas.sensing import Pose
from cogmap.services.sim.layout.boundaries import clearance_m, outlines
from cogmap.services.sim.layout.osm.buildings import plots
from cogmap.services.sim.layout.osm.streets import Positions, roads
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.plan import Point, Road

# The paper's maps of cities are not larger (§6).
LARGEST_KM2 = 4.0
# Free around the start: more than twice HALF_WIDTH_M of the robot.
ROOM_M = 1.5
# Roads that are compared with all walls at once: their arrays fit into memory.
CHUNK = 256


def read(path: Path) -> Place:
    """Make a town of the streets and buildings of the extract at `path`, x east and y north of its
    middle.

    Raises ConfigError if it has no street, no building, or covers more than LARGEST_KM2, and
    UsageError if it cannot be read.
    """
    extract = osm.read(path)
    used: set[int] = set()
    for way in extract.ways:
        if "highway" in way.tags or "building" in way.tags:
            used.update(node for node in way.nodes if node in extract.nodes)
    if not used:
        raise _without(path, "streets", "highway")

    nodes = sorted(used)
    lonlat = np.array([extract.nodes[node] for node in nodes])
    positions_m = plane_m(lonlat, (lonlat.min(axis=0) + lonlat.max(axis=0)) / 2)
    width_m, height_m = np.ptp(positions_m, axis=0).tolist()
    area_km2 = width_m * height_m / 1e6
    if area_km2 > LARGEST_KM2:
        raise ConfigError(
            f"{path} covers {area_km2:.1f} km², and a town may have {LARGEST_KM2:g} km² at most: "
            f"cut out a part of it, such as with `osmium extract --bbox WEST,SOUTH,EAST,NORTH`"
        )

    at_m: Positions = {
        node: (x_m, y_m) for node, (x_m, y_m) in zip(nodes, positions_m.tolist(), strict=True)
    }
    streets = roads(extract, at_m)
    buildings = plots(extract, at_m)
    if not streets:
        raise _without(path, "streets", "highway")
    if not buildings:
        raise _without(path, "buildings", "building")

    walls_m = outlines([plot.corners for plot in buildings])
    passable = _passable(streets, walls_m)
    if not passable:
        raise ConfigError(
            f"{path} has no street that no building stands on: give an extract of another area"
        )

    connected = _largest_part(passable)
    return Place(
        seed=0,
        roads=tuple(connected),
        plots=tuple(buildings),
        props=(),
        start=_start(connected, walls_m),
    )


def _without(path: Path, what: str, tag: str) -> ConfigError:
    return ConfigError(
        f"{path} has no {what}: give an extract of the same area with the ways that are tagged "
        f"{tag}=…, such as an export of openstreetmap.org"
    )


def _passable(found: list[Road], walls_m: Floats) -> list[Road]:
    """Return the roads whose centre line no wall crosses."""
    passable = []
    # All roads with all walls at once would not fit into memory.
    for first in range(0, len(found), CHUNK):
        chunk = found[first : first + CHUNK]
        crossed = _is_crossed(np.array([(*road.start, *road.end) for road in chunk]), walls_m)
        for road, has_wall in zip(chunk, crossed, strict=True):
            if not has_wall:
                passable.append(road)
    return passable


def _is_crossed(lines_m: Floats, walls_m: Floats) -> Booleans:
    """Return which of (k, 4) segments cross any of (n, 4) others, (k,)."""
    starts = lines_m[:, None, :2]
    ends = lines_m[:, None, 2:]
    wall_starts = walls_m[None, :, :2]
    wall_ends = walls_m[None, :, 2:]

    wall_start_side = _side(starts, ends, wall_starts)
    wall_end_side = _side(starts, ends, wall_ends)
    start_side = _side(wall_starts, wall_ends, starts)
    end_side = _side(wall_starts, wall_ends, ends)

    parts_wall = wall_start_side * wall_end_side < 0
    parts_line = start_side * end_side < 0
    crosses = parts_wall & parts_line
    return np.asarray(crosses.any(axis=1))


def _side(starts: Floats, ends: Floats, points: Floats) -> Floats:
    """Return on which side of a line each point is, by its sign; (..., 2) each."""
    along = ends - starts
    offset = points - starts

    side: Floats = along[..., 0] * offset[..., 1] - along[..., 1] * offset[..., 0]
    return side


def _largest_part(found: list[Road]) -> list[Road]:
    """Return, of the parts that no road connects, the one whose roads are the longest together."""
    numbers: dict[Point, int] = {}
    starts = [numbers.setdefault(road.start, len(numbers)) for road in found]
    ends = [numbers.setdefault(road.end, len(numbers)) for road in found]
    crossings = len(numbers)
    graph = coo_array((np.ones(len(found)), (starts, ends)), (crossings, crossings))
    _, part_of_crossing = connected_components(graph, directed=False)

    part = part_of_crossing[starts]
    lengths_m = np.bincount(part, [road.length_m for road in found], minlength=1)
    largest = int(lengths_m.argmax())
    return [road for road, number in zip(found, part, strict=True) if number == largest]


def _start(found: list[Road], walls_m: Floats) -> Pose:
    """Return the middle of the road nearest to the middle of the town that is long and has room."""
    by_distance = sorted(found, key=lambda road: math.hypot(*road.middle))
    with_room = (
        road
        for road in by_distance
        if road.length_m > 2 * ROOM_M and clearance_m(walls_m, *road.middle) > ROOM_M
    )
    chosen = next(with_room, by_distance[0])
    x_m, y_m = chosen.middle
    return Pose(x_m=x_m, y_m=y_m, heading_rad=chosen.heading_rad)
