"""Cities to take environments from: OpenStreetMap extracts, street graphs, grown cities."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np

from cogmap.data import osm, street_graphs
from cogmap.data.osm import Extract, Tags, Way
from cogmap.data.street_graphs import StreetGraph
from cogmap.errors import UsageError
from cogmap.geometry.se2 import rotate
from experiments.city_maps.environment import City, Environment, environments
from experiments.city_maps.streets import Indices, Points, Streets

EARTH_M = 6_371_008.8
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
MANY_NAMED = 40


def from_osm(path: Path) -> City:
    """The streets and buildings of an extract. Raises UsageError where it lacks either, or a line
    is wrong.
    """
    extract = osm.read(path)
    ways = [way for way in extract.ways if _is_street(way)]

    if not ways or not extract.nodes:
        raise UsageError(
            f"{path} has no streets: give an extract with ways that are tagged highway=…"
        )

    middle = np.array(list(extract.nodes.values())).mean(axis=0)
    names, where = _buildings(extract)
    return City(_name(path), _streets(extract, ways, middle), names, plane_m(where, middle))


def from_street_graph(graph: StreetGraph, seed: int) -> City:
    """A city of real streets, which has no buildings: houses are put along them, from a seed."""
    middle = np.array(graph.nodes_lonlat).mean(axis=0)
    number: dict[tuple[float, float], int] = {}
    pieces = []

    for edge in graph.edges:
        line = [number.setdefault(point, len(number)) for point in graph.line(edge)]
        pieces += [[a, b] for a, b in itertools.pairwise(line) if a != b]

    points_m = plane_m(np.array(list(number)), middle)
    streets = Streets(points_m, np.array(pieces, np.intp)).connected()
    houses_m = _along(streets, np.random.default_rng([seed, 0xA10]))
    return City(graph.city, streets, _house_names(houses_m), houses_m)


def folder(path: Path, seed: int) -> list[City]:
    """Every city in a folder, in the order of the files' names. Raises UsageError where there is
    none.
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
    """A city from a seed: a bent grid of blocks of many sizes, some streets missing, houses along
    the others.
    """
    rng = np.random.default_rng([seed, 0xC17])
    points_m = _bent_grid_m(rng)
    pieces = _grid_pieces()
    is_there = rng.random(len(pieces)) < STREETS_LEFT
    streets = Streets(points_m, pieces[is_there]).connected()
    houses_m = _along(streets, rng)
    return City(f"city {seed}", streets, _house_names(houses_m), houses_m)


def grown_environments(number: int, seed: int) -> list[Environment]:
    """`number` environments, each of a city grown from a seed of its own."""
    cities = [grown(1000 * seed + count) for count in range(number)]
    return [environments(city, 1, seed)[0] for city in cities]


def plane_m(lonlat: Points, middle: Points) -> Points:
    """Metres east and north of `middle`, (n, 2), from degrees: good to a thousandth within some
    kilometres.
    """
    per_degree_m = np.radians(1.0) * EARTH_M
    shrinking = np.array([np.cos(np.radians(middle[1])), 1.0])
    offsets = lonlat.reshape(-1, 2) - middle
    return np.asarray(offsets * shrinking * per_degree_m)


def _bent_grid_m(rng: np.random.Generator) -> Points:
    """(GRID_SIDE^2, 2) crossings of blocks of many sizes, moved about, and all turned by chance."""
    lines_m = [np.cumsum(rng.uniform(*BLOCK_M, GRID_SIDE)) for _ in range(2)]
    x_m, y_m = np.meshgrid(*lines_m, indexing="ij")
    points_m = np.column_stack([x_m.ravel(), y_m.ravel()])
    points_m += rng.normal(0, JITTER * BLOCK_M[0], points_m.shape)

    turn_rad = float(rng.uniform(0, np.pi))
    return rotate(points_m - points_m.mean(axis=0), turn_rad)


def _grid_pieces() -> Indices:
    """(m, 2): the neighbours along both axes of a grid."""
    number = np.arange(GRID_SIDE**2).reshape(GRID_SIDE, GRID_SIDE)
    along = np.column_stack([number[:-1].ravel(), number[1:].ravel()])
    across = np.column_stack([number[:, :-1].ravel(), number[:, 1:].ravel()])
    return np.vstack([along, across])


def _along(streets: Streets, rng: np.random.Generator) -> Points:
    """(k, 2): houses on both sides of every street."""
    found = []

    for start_m, end_m in streets.points_m[streets.pieces]:
        length_m = float(np.hypot(*(end_m - start_m)))
        first_m = rng.uniform(CORNER_M, EVERY_M)
        along_m = np.arange(first_m, length_m - CORNER_M, EVERY_M)
        side_m = rng.choice([-1.0, 1.0], len(along_m)) * FRONT_M

        ahead = (end_m - start_m) / length_m
        left = np.array([-ahead[1], ahead[0]])
        found.append(start_m + along_m[:, None] * ahead + side_m[:, None] * left)

    return np.vstack(found)


def _house_names(houses_m: Points) -> tuple[str, ...]:
    return tuple(f"house {number}" for number in range(1, len(houses_m) + 1))


def _is_street(way: Way) -> bool:
    return way.tags.get("highway") in STREETS and way.tags.get("area") != "yes"


def _streets(extract: Extract, ways: list[Way], middle: Points) -> Streets:
    number: dict[int, int] = {}
    pieces = []

    for way in ways:
        inside = [node for node in way.nodes if node in extract.nodes]
        for a, b in itertools.pairwise(inside):
            if a != b:
                pieces.append([number.setdefault(node, len(number)) for node in (a, b)])

    where = np.array([extract.nodes[node] for node in number])
    return Streets(plane_m(where, middle), np.array(pieces, np.intp))


def _buildings(extract: Extract) -> tuple[tuple[str, ...], Points]:
    """What people would know by name first: named places and buildings; where these are few, any
    building.
    """
    named: dict[str, tuple[float, float]] = {}
    unnamed: dict[str, tuple[float, float]] = {}

    for node, tags in extract.node_tags.items():
        if _is_known(tags):
            named.setdefault(tags["name"], extract.nodes[node])

    for way in extract.ways:
        corners = [extract.nodes[node] for node in way.nodes[:-1] if node in extract.nodes]
        is_building = "building" in way.tags or _is_known(way.tags)
        if len(corners) < MIN_CORNERS or not is_building:
            continue

        lon, lat = np.mean(corners, axis=0).tolist()
        if "name" in way.tags:
            named.setdefault(way.tags["name"], (lon, lat))
        else:
            unnamed[f"building {way.id}"] = (lon, lat)

    found = named if len(named) >= MANY_NAMED else named | unnamed
    return tuple(found), np.array(list(found.values())).reshape(-1, 2)


def _is_known(tags: Tags) -> bool:
    return "name" in tags and any(key in tags for key in KNOWN_BY)


def _name(path: Path) -> str:
    name = path.name

    for suffix in sorted(osm.SUFFIXES, key=len, reverse=True):
        name = name.removesuffix(suffix)

    return name
