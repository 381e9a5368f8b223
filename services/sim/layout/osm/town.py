"""A town from an OpenStreetMap extract."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cogmap.data import osm
from cogmap.data.osm import Extract
from cogmap.errors import ConfigError
from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.schemas.sensing import Pose
from cogmap.services.sim.layout.boundaries import clearance_m, outlines
from cogmap.services.sim.layout.osm.buildings import plots
from cogmap.services.sim.layout.osm.streets import Positions, roads
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.plan import Plot, Point, Road

EARTH_M = 6_371_008.8
LARGEST_KM2 = 4.0
ROOM_M = 1.5
CHUNK = 256


def read(path: Path) -> Place:
    """The streets and buildings of the extract at `path`, x east and y north of its middle.

    Raises ConfigError where it has no street, no building, or covers more than LARGEST_KM2, and
    UsageError where it cannot be read.
    """
    extract = osm.read(path)
    used = _used(extract)
    if not used:
        raise _without(path, "streets", "highway")

    lonlat = np.array([extract.nodes[node] for node in used])
    positions_m = _plane_m(lonlat)
    _check_size(path, positions_m)

    at_m: Positions = {}
    for node, (x_m, y_m) in zip(used, positions_m.tolist(), strict=True):
        at_m[node] = (x_m, y_m)

    return _place(path, roads(extract, at_m), plots(extract, at_m))


def _used(extract: Extract) -> list[int]:
    """The nodes of streets and buildings, in order."""
    used: set[int] = set()
    for way in extract.ways:
        if "highway" in way.tags or "building" in way.tags:
            used.update(node for node in way.nodes if node in extract.nodes)

    return sorted(used)


def _plane_m(lonlat: Floats) -> Floats:
    """(n, 2): metres east and north of the middle of (n, 2) degrees."""
    lowest = lonlat.min(axis=0)
    highest = lonlat.max(axis=0)
    middle = (lowest + highest) / 2

    degree_m = math.radians(1.0) * EARTH_M
    shrinking = math.cos(math.radians(middle[1]))
    metres = np.array([shrinking * degree_m, degree_m])

    positions_m: Floats = (lonlat - middle) * metres
    return positions_m


def _check_size(path: Path, positions_m: Floats) -> None:
    width_m, height_m = np.ptp(positions_m, axis=0).tolist()
    area_km2 = width_m * height_m / 1e6
    if area_km2 > LARGEST_KM2:
        raise ConfigError(
            f"{path} covers {area_km2:.1f} km², and a town may have {LARGEST_KM2:g} km² at most: "
            f"cut out a part of it, such as with `osmium extract --bbox WEST,SOUTH,EAST,NORTH`"
        )


def _without(path: Path, what: str, tag: str) -> ConfigError:
    return ConfigError(
        f"{path} has no {what}: give an extract of the same area with the ways that are tagged "
        f"{tag}=…, such as an export of openstreetmap.org"
    )


def _place(path: Path, found: list[Road], buildings: list[Plot]) -> Place:
    if not found:
        raise _without(path, "streets", "highway")
    if not buildings:
        raise _without(path, "buildings", "building")

    walls_m = outlines([plot.corners for plot in buildings])
    passable = _passable(found, walls_m)
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


def _passable(found: list[Road], walls_m: Floats) -> list[Road]:
    """The roads whose centre line no wall crosses."""
    lines_m = np.array([(*road.start, *road.end) for road in found])
    crossed = np.concatenate(
        [
            _is_crossed(lines_m[first : first + CHUNK], walls_m)
            for first in range(0, len(lines_m), CHUNK)
        ]
    )
    return [road for road, is_crossed in zip(found, crossed, strict=True) if not is_crossed]


def _is_crossed(lines_m: Floats, walls_m: Floats) -> Booleans:
    """(k,): which of (k, 4) segments cross any of (n, 4) others."""
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
    """On which side of a line each point is, by its sign; (..., 2) each."""
    along = ends - starts
    offset = points - starts

    side: Floats = along[..., 0] * offset[..., 1] - along[..., 1] * offset[..., 0]
    return side


def _largest_part(found: list[Road]) -> list[Road]:
    """Of the parts that no road connects, the one whose roads are the longest together."""
    part = _parts(found)
    lengths_m = np.bincount(part, [road.length_m for road in found], minlength=1)

    largest = int(lengths_m.argmax())
    return [road for road, number in zip(found, part, strict=True) if number == largest]


def _parts(found: list[Road]) -> Indices:
    """(n,): the number of the part that each road belongs to."""
    numbers: dict[Point, int] = {}
    starts = []
    ends = []
    for road in found:
        start = numbers.setdefault(road.start, len(numbers))
        end = numbers.setdefault(road.end, len(numbers))
        starts.append(start)
        ends.append(end)

    crossings = len(numbers)
    links = np.ones(len(found))
    graph = coo_array((links, (starts, ends)), (crossings, crossings))

    _, part_of_crossing = connected_components(graph, directed=False)
    parts = part_of_crossing[starts]
    return np.asarray(parts, np.int64)


def _start(found: list[Road], walls_m: Floats) -> Pose:
    """The middle of the road nearest to the middle of the town that is long and has room."""
    by_distance = sorted(found, key=lambda road: math.hypot(*road.middle))
    chosen = by_distance[0]
    for road in by_distance:
        if _has_room(road, walls_m):
            chosen = road
            break

    x_m, y_m = chosen.middle
    return Pose(x_m=x_m, y_m=y_m, heading_rad=chosen.heading_rad)


def _has_room(road: Road, walls_m: Floats) -> bool:
    x_m, y_m = road.middle
    is_long = road.length_m > 2 * ROOM_M
    return is_long and clearance_m(walls_m, x_m, y_m) > ROOM_M
