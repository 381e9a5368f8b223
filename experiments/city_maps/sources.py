"""Cities to take environments from: OpenStreetMap extracts, street graphs, and cities grown from a
seed.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np

from cogmap.data import osm, street_graphs
from cogmap.data.osm import Extract, Tags, Way
from cogmap.data.street_graphs import StreetGraph
from cogmap.errors import UsageError
from experiments.city_maps.environment import City, Environment, environments
from experiments.city_maps.streets import Points, Streets

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


def from_osm(path: Path) -> City:
    """The streets and buildings of an extract. Raises UsageError where it lacks either, or a line
    is wrong.
    """
    extract = osm.read(path)
    ways = [
        way
        for way in extract.ways
        if way.tags.get("highway") in STREETS and way.tags.get("area") != "yes"
    ]
    if not ways or not extract.nodes:
        raise UsageError(
            f"{path} has no streets: give an extract with ways that are tagged highway=…"
        )
    middle = np.array(list(extract.nodes.values())).mean(axis=0)
    names, where = _buildings(extract)
    city = _name(path)
    return City(city, _streets(extract, ways, middle), names, plane_m(where, middle))


def plane_m(lonlat: Points, middle: Points) -> Points:
    """Metres east and north of `middle`, (n, 2), from degrees: good to a thousandth within some
    kilometres.
    """
    scale = np.array([np.cos(np.radians(middle[1])), 1.0]) * np.radians(1.0) * EARTH_M
    return np.asarray((lonlat.reshape(-1, 2) - middle) * scale)


def grown(seed: int) -> City:
    """A city from a seed: a bent grid of blocks of many sizes, some streets missing, houses along
    the others.
    """
    rng = np.random.default_rng([seed, 0xC17])
    lines = [np.cumsum(rng.uniform(*BLOCK_M, GRID_SIDE)) for _ in range(2)]
    x, y = np.meshgrid(*lines, indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel()])
    points += rng.normal(0, JITTER * BLOCK_M[0], points.shape)
    turn = float(rng.uniform(0, np.pi))
    points = (points - points.mean(axis=0)) @ np.array(
        [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]
    )
    number = np.arange(GRID_SIDE**2).reshape(GRID_SIDE, GRID_SIDE)
    pieces = np.vstack(
        [
            np.column_stack([number[:-1].ravel(), number[1:].ravel()]),
            np.column_stack([number[:, :-1].ravel(), number[:, 1:].ravel()]),
        ]
    )
    streets = Streets(points, pieces[rng.random(len(pieces)) < STREETS_LEFT]).connected()
    where = _along(streets, rng)
    return City(f"city {seed}", streets, tuple(f"house {k + 1}" for k in range(len(where))), where)


def grown_environments(number: int, seed: int) -> list[Environment]:
    """`number` environments, each of a city grown from a seed of its own."""
    cities = [grown(1000 * seed + count) for count in range(number)]
    return [environments(city, 1, seed)[0] for city in cities]


def _along(streets: Streets, rng: np.random.Generator) -> Points:
    """Houses on both sides of every street."""
    found = []
    for a, b in streets.points_m[streets.pieces]:
        length = float(np.hypot(*(b - a)))
        along = np.arange(rng.uniform(15, EVERY_M), length - 15, EVERY_M)
        ahead = (b - a) / length
        side = rng.choice([-1.0, 1.0], len(along)) * FRONT_M
        found.append(a + along[:, None] * ahead + side[:, None] * np.array([-ahead[1], ahead[0]]))
    return np.vstack(found)


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
    found: dict[str, tuple[float, float]] = {}
    unnamed: dict[str, tuple[float, float]] = {}
    for node, tags in extract.node_tags.items():
        if _is_known(tags):
            found.setdefault(tags["name"], extract.nodes[node])
    for way in extract.ways:
        inside = [extract.nodes[node] for node in way.nodes[:-1] if node in extract.nodes]
        if len(inside) < 3 or ("building" not in way.tags and not _is_known(way.tags)):
            continue
        middle = tuple(np.mean(inside, axis=0).tolist())
        if "name" in way.tags:
            found.setdefault(way.tags["name"], middle)
        else:
            unnamed[f"building {way.id}"] = middle
    whole = found if len(found) >= 40 else found | unnamed
    return tuple(whole), np.array(list(whole.values())).reshape(-1, 2)


def _is_known(tags: Tags) -> bool:
    return "name" in tags and any(key in tags for key in KNOWN_BY)


def _name(path: Path) -> str:
    name = path.name
    for suffix in sorted(osm.SUFFIXES, key=len, reverse=True):
        name = name.removesuffix(suffix)
    return name


def from_street_graph(graph: StreetGraph, seed: int) -> City:
    """A city of real streets, which has no buildings: houses are put along them, from a seed."""
    middle = np.array(graph.nodes_lonlat).mean(axis=0)
    number: dict[tuple[float, float], int] = {}
    pieces = []
    for edge in graph.edges:
        line = [number.setdefault(point, len(number)) for point in graph.line(edge)]
        pieces += [[a, b] for a, b in itertools.pairwise(line) if a != b]
    streets = Streets(
        plane_m(np.array(list(number)), middle), np.array(pieces, np.intp)
    ).connected()
    where = _along(streets, np.random.default_rng([seed, 0xA10]))
    return City(graph.city, streets, tuple(f"house {k + 1}" for k in range(len(where))), where)


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
        kinds = f"OpenStreetMap extracts ({osm.SUFFIXES[0]}) or street graphs ({street_graphs.SUFFIXES[0]}), packed or not"
        raise UsageError(f"{path} has no cities: put {kinds}, there")
    return cities
