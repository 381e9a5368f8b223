"""A town from an OpenStreetMap extract."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cogmap.data import osm
from cogmap.data.osm import Extract
from cogmap.errors import ConfigError
from cogmap.geometry.arrays import Booleans, Floats
from schemas.sensing import Pose
from services.sim.layout.boundaries import clearance_m, outlines
from services.sim.layout.osm.buildings import plots
from services.sim.layout.osm.streets import Positions, roads
from services.sim.layout.place import Place
from services.sim.layout.plan import Plot, Road

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
    middle = (lonlat.min(axis=0) + lonlat.max(axis=0)) / 2
    degree_m = np.radians(1.0) * EARTH_M
    shares = np.array([np.cos(np.radians(middle[1])), 1.0])

    positions_m: Floats = (lonlat - middle) * shares * degree_m
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
    open_roads = _largest_part(_passable(found, walls_m))
    if not open_roads:
        raise ConfigError(
            f"{path} has no street that no building stands on: give an extract of another area"
        )

    return Place(
        seed=0,
        roads=tuple(open_roads),
        plots=tuple(buildings),
        props=(),
        start=_start(open_roads, walls_m),
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
    along = lines_m[:, None, 2:] - starts
    wall_starts = walls_m[None, :, :2]
    wall_along = walls_m[None, :, 2:] - wall_starts

    apart = _side(along, wall_starts - starts) * _side(along, wall_starts + wall_along - starts)
    ends = starts + along
    across = _side(wall_along, starts - wall_starts) * _side(wall_along, ends - wall_starts)
    return np.asarray(((apart < 0) & (across < 0)).any(axis=1))


def _side(along: Floats, offset: Floats) -> Floats:
    """On which side of a direction an offset lies, by its sign."""
    side: Floats = along[..., 0] * offset[..., 1] - along[..., 1] * offset[..., 0]
    return side


def _largest_part(found: list[Road]) -> list[Road]:
    """Of the parts that no road connects, the one with the longest roads."""
    parents: dict[tuple[float, float], tuple[float, float]] = {}

    def root(point: tuple[float, float]) -> tuple[float, float]:
        parents.setdefault(point, point)
        while parents[point] != point:
            parents[point] = parents[parents[point]]
            point = parents[point]
        return point

    for road in found:
        parents[root(road.start)] = root(road.end)

    lengths_m: dict[tuple[float, float], float] = {}
    for road in found:
        part = root(road.start)
        lengths_m[part] = lengths_m.get(part, 0.0) + road.length_m

    if not lengths_m:
        return []

    largest = max(lengths_m, key=lambda part: (lengths_m[part], part))
    return [road for road in found if root(road.start) == largest]


def _start(found: list[Road], walls_m: Floats) -> Pose:
    """The middle of the road nearest to the middle of the town that is long and has room."""
    for road in sorted(found, key=lambda road: np.hypot(*road.middle)):
        x_m, y_m = road.middle
        if road.length_m > 2 * ROOM_M and clearance_m(walls_m, x_m, y_m) > ROOM_M:
            return Pose(x_m=x_m, y_m=y_m, heading_rad=road.heading_rad)

    x_m, y_m = found[0].middle
    return Pose(x_m=x_m, y_m=y_m, heading_rad=found[0].heading_rad)
