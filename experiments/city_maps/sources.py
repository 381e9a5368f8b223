"""Cities to take environments from: OpenStreetMap extracts, street graphs, grown cities."""

from __future__ import annotations

import itertools
from collections.abc import Hashable, Iterable, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from cogmap.data import osm, street_graphs
from cogmap.data.osm import Extract, Tags
from cogmap.data.street_graphs import StreetGraph
from cogmap.errors import UsageError
from cogmap.experiments.city_maps.environment import City, Environment, environments
from cogmap.experiments.city_maps.streets import Indices, Points, Streets
from cogmap.geometry.geographic import continuous, plane_m
from cogmap.geometry.se2 import rotate

STREETS = frozenset(
    f"{kind}{link}"
    for kind in ("trunk", "primary", "secondary", "tertiary")
    for link in ("", "_link")
) | {"unclassified", "residential", "living_street", "pedestrian", "road", "service"}
KNOWN_BY = ("amenity", "shop", "tourism", "historic", "leisure", "office")
GRID_SIDE = 20
BLOCK_M = (80.0, 170.0)
JITTER = 0.18
STREETS_LEFT = 0.82
FRONT_M = 14.0
EVERY_M = 45.0
CORNER_M = 15.0
MIN_CORNERS = 3
MIN_NAMED = 40
LonLat = tuple[float, float]
Point = TypeVar("Point", bound=Hashable)


def from_osm(path: Path) -> City:
    """Return the streets and buildings of an extract. Raises UsageError if it lacks either, or a
    line is wrong.
    """
    extract = osm.read(path)
    streets = streets_of(extract, path)
    names, lonlat = _buildings(extract)
    return City(name_of(path), streets, names, plane_m(lonlat, middle_of(extract)))


def streets_of(extract: Extract, path: Path) -> Streets:
    """Return the streets of the extract in a file. Raises UsageError if there are none."""
    ways = [
        way
        for way in extract.ways
        if way.tags.get("highway") in STREETS and way.tags.get("area") != "yes"
    ]
    if not ways or not extract.nodes:
        raise UsageError(
            f"{path} has no streets: give an extract with ways that are tagged highway=…"
        )

    lines = [piece for way in ways for piece in extract.pieces(way)]
    nodes, pieces = _pieces(lines)
    lonlat = np.array([extract.nodes[node] for node in nodes])
    return Streets(plane_m(lonlat, middle_of(extract)), pieces)


def middle_of(extract: Extract) -> Points:
    """Return the mean longitude and latitude of an extract's nodes, (2,)."""
    lonlat = np.array(list(extract.nodes.values()))
    return np.asarray(lonlat.mean(axis=0))


def from_street_graph(graph: StreetGraph, seed: int) -> City:
    """Return a city of real streets, which has no buildings: houses are put along them, from a
    seed.
    """
    middle = continuous(np.array(graph.nodes_lonlat)).mean(axis=0)
    lines = [graph.line(edge) for edge in graph.edges]
    lonlat, pieces = _pieces(lines)
    points_m = plane_m(continuous(np.array(lonlat)), middle)
    streets = Streets(points_m, pieces).connected()

    rng = np.random.default_rng([seed, 0xA10])
    return _with_houses(graph.city, streets, rng)


def folder(path: Path, seed: int) -> list[City]:
    """Return every city in a folder, in the order of the files' names. Raises UsageError if there
    is none.
    """
    if not path.is_dir():
        raise UsageError(f"there is no folder {path}")

    cities = []
    for file in sorted(path.iterdir()):
        if file.name.endswith(osm.SUFFIXES):
            cities.append(from_osm(file))
        elif file.name.endswith(street_graphs.SUFFIXES):
            cities += [from_street_graph(graph, seed) for graph in street_graphs.read(file)]

    if not cities:
        raise UsageError(
            f"{path} has no cities: put OpenStreetMap extracts ({osm.SUFFIXES[0]}) or street "
            f"graphs ({street_graphs.SUFFIXES[0]}), packed or not, there"
        )

    return cities


def grown(seed: int) -> City:
    """Return a city from a seed: a bent grid of blocks of many sizes, some streets missing, houses
    along the others.
    """
    rng = np.random.default_rng([seed, 0xC17])
    points_m = _bent_grid_m(rng)
    grid = np.arange(GRID_SIDE**2).reshape(GRID_SIDE, GRID_SIDE)
    along = np.stack([grid[:-1], grid[1:]], axis=-1).reshape(-1, 2)
    across = np.stack([grid[:, :-1], grid[:, 1:]], axis=-1).reshape(-1, 2)
    pieces = np.vstack([along, across])

    is_left = rng.random(len(pieces)) < STREETS_LEFT
    streets = Streets(points_m, pieces[is_left]).connected()
    return _with_houses(f"city {seed}", streets, rng)


def grown_environments(number: int, seed: int) -> list[Environment]:
    """Return `number` environments, each of a city grown from a seed of its own."""
    found = []

    for count in range(number):
        city = grown(1000 * seed + count)
        found += environments(city, 1, seed)

    return found


def _bent_grid_m(rng: np.random.Generator) -> Points:
    """Draw (GRID_SIDE^2, 2) crossings of blocks of many sizes, moved about, and turned together."""
    blocks_m = rng.uniform(*BLOCK_M, (2, GRID_SIDE))
    lines_m = np.cumsum(blocks_m, axis=1)
    x_m, y_m = np.meshgrid(*lines_m, indexing="ij")
    points_m = np.column_stack([x_m.ravel(), y_m.ravel()])

    jitter_m = JITTER * BLOCK_M[0]
    points_m += rng.normal(0, jitter_m, points_m.shape)
    turn_rad = float(rng.uniform(0, np.pi))
    centred_m = points_m - points_m.mean(axis=0)
    return rotate(centred_m, turn_rad)


def _with_houses(name: str, streets: Streets, rng: np.random.Generator) -> City:
    """Return a city with houses on both sides of every street."""
    houses_m = []

    for start_m, end_m in streets.points_m[streets.pieces]:
        houses_m.append(_along(start_m, end_m, rng))

    buildings_m = np.vstack(houses_m)
    numbers = range(1, len(buildings_m) + 1)
    names = tuple(f"house {number}" for number in numbers)
    return City(name, streets, names, buildings_m)


def _along(start_m: Points, end_m: Points, rng: np.random.Generator) -> Points:
    """Place houses along one street, (k, 2), each on a side by chance."""
    street_m = end_m - start_m
    length_m = float(np.hypot(*street_m))
    ahead = street_m / length_m
    left = np.array([-ahead[1], ahead[0]])

    first_m = rng.uniform(CORNER_M, EVERY_M)
    last_m = length_m - CORNER_M
    along_m = np.arange(first_m, last_m, EVERY_M)
    sides = rng.choice([-1.0, 1.0], len(along_m))

    on_street_m = start_m + along_m[:, None] * ahead
    to_side_m = sides[:, None] * FRONT_M * left
    return np.asarray(on_street_m + to_side_m)


def _pieces(lines: Iterable[Sequence[Point]]) -> tuple[list[Point], Indices]:
    """Return the different points of all lines, and the pieces (m, 2) between them, by their
    numbers.
    """
    number: dict[Point, int] = {}
    pieces = []

    for line in lines:
        for start, end in itertools.pairwise(line):
            if start != end:
                first = number.setdefault(start, len(number))
                second = number.setdefault(end, len(number))
                pieces.append((first, second))

    return list(number), np.array(pieces, np.intp)


def _buildings(extract: Extract) -> tuple[tuple[str, ...], Points]:
    """Return what people would know by name first: named places and buildings; if these are few,
    any building.
    """
    named: dict[str, LonLat] = {}
    unnamed: dict[str, LonLat] = {}

    for node, tags in extract.node_tags.items():
        if _is_known(tags):
            named.setdefault(tags["name"], extract.nodes[node])

    for way in extract.ways:
        corners = [extract.nodes[node] for node in way.nodes[:-1] if node in extract.nodes]
        is_building = "building" in way.tags or _is_known(way.tags)
        if len(corners) < MIN_CORNERS or not is_building:
            continue

        lon, lat = np.mean(corners, axis=0).tolist()
        centre = lon, lat
        if "name" in way.tags:
            named.setdefault(way.tags["name"], centre)
        else:
            unnamed[f"building {way.id}"] = centre

    found = named if len(named) >= MIN_NAMED else named | unnamed
    lonlat = np.array(list(found.values()))
    return tuple(found), lonlat.reshape(-1, 2)


def _is_known(tags: Tags) -> bool:
    is_of_use = not tags.keys().isdisjoint(KNOWN_BY)
    return is_of_use and "name" in tags


def name_of(path: Path) -> str:
    """Return the name of a city, by that of its file."""
    name = path.name

    for suffix in sorted(osm.SUFFIXES, key=len, reverse=True):
        name = name.removesuffix(suffix)

    return name
