"""What is known of a city: its buildings and places with their functions, and what separates them.

A building has the function that its own tags or those of a place inside it imply; of many it is not
known. Railways, water, walls, fences and main roads are boundaries, other streets are not.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from cogmap.data import osm
from cogmap.data.osm import Extract, Tags
from cogmap.errors import UsageError
from cogmap.experiments.city_maps.sources import middle_of, name_of, streets_of
from cogmap.experiments.city_maps.streets import Streets
from cogmap.experiments.map_structure.functions import FUNCTIONS, function_of
from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.geographic import plane_m

UNKNOWN = -1
MIN_OBJECTS = 20
MIN_CORNERS = 3
INSIDE_M = 12.0
MAIN_ROADS = frozenset(("motorway", "trunk", "primary", "secondary"))
BARRIERS = frozenset(("wall", "city_wall", "retaining_wall", "fence"))
PLACES = frozenset(("suburb", "quarter", "neighbourhood", "village", "hamlet", "town"))


@dataclass(frozen=True, eq=False)
class StructuredCity:
    """A city: (n, 2) objects with their functions, (n,) indices of FUNCTIONS or UNKNOWN, and half
    their widths, (n,); boundaries, (m, 2, 2); (k, 2) named places, which are quarters or villages.
    """

    name: str
    streets: Streets
    positions_m: Floats
    functions: Indices
    half_widths_m: Floats
    boundaries_m: Floats
    places_m: Floats


def read_city(path: Path) -> StructuredCity:
    """Return the city of an OpenStreetMap extract. Raises UsageError if it cannot be read, or has
    too few buildings.
    """
    extract = osm.read(path)
    streets = streets_of(extract, path)
    middle = middle_of(extract)

    centres_m, half_widths_m, functions = _buildings(extract, middle)

    # Places that are points, and whose function is known.
    spots = {node: _code(tags) for node, tags in extract.node_tags.items() if function_of(tags)}
    spots_m = _line_m(extract, spots, middle)
    spot_functions = np.array(list(spots.values()), np.int64)
    is_alone = _give_functions(centres_m, functions, spots_m, spot_functions)
    count = len(centres_m) + int(is_alone.sum())
    if count < MIN_OBJECTS:
        raise UsageError(
            f"{path} has {count} buildings and places, at least {MIN_OBJECTS} are needed: "
            "give a larger extract"
        )

    named = [
        node
        for node, tags in extract.node_tags.items()
        if tags.get("place") in PLACES and "name" in tags
    ]
    return StructuredCity(
        name=name_of(path),
        streets=streets,
        positions_m=np.vstack([centres_m, spots_m[is_alone]]),
        functions=np.concatenate([functions, spot_functions[is_alone]]),
        half_widths_m=np.concatenate([half_widths_m, np.zeros(is_alone.sum())]),
        boundaries_m=_boundaries(extract, middle),
        places_m=_line_m(extract, named, middle),
    )


def _buildings(extract: Extract, middle: Floats) -> tuple[Floats, Floats, Indices]:
    """Return the centres of buildings, (n, 2), half their widths, (n,), and their functions,
    (n,).
    """
    centres_m = []
    half_widths_m = []
    functions = []
    for way in extract.ways:
        corners_m = _line_m(extract, way.nodes, middle)
        if "building" not in way.tags or len(corners_m) < MIN_CORNERS:
            continue

        low_m = corners_m.min(axis=0)
        high_m = corners_m.max(axis=0)
        centres_m.append((low_m + high_m) / 2)
        half_widths_m.append(float((high_m - low_m).max()) / 2)
        functions.append(_code(way.tags))

    return (
        np.array(centres_m).reshape(-1, 2),
        np.array(half_widths_m),
        np.array(functions, np.int64),
    )


def _give_functions(
    centres_m: Floats, functions: Indices, spots_m: Floats, spot_functions: Indices
) -> Booleans:
    """Give buildings of unknown function that of a place inside. Return which places, (k,), are in
    no building.
    """
    if not len(centres_m) or not len(spots_m):
        return np.ones(len(spots_m), bool)

    away_m, building = cKDTree(centres_m).query(spots_m)
    is_inside = away_m <= INSIDE_M
    for spot in np.flatnonzero(is_inside).tolist():
        if functions[building[spot]] == UNKNOWN:
            functions[building[spot]] = spot_functions[spot]

    is_alone: Booleans = ~is_inside
    return is_alone


def _boundaries(extract: Extract, middle: Floats) -> Floats:
    """Return the pieces of all ways that separate, (m, 2, 2)."""
    pieces_m = [np.zeros((0, 2, 2))]
    for way in extract.ways:
        if _separates(way.tags):
            for piece in extract.pieces(way):
                line_m = _line_m(extract, piece, middle)
                pieces_m.append(np.stack([line_m[:-1], line_m[1:]], axis=1))

    return np.concatenate(pieces_m)


def _separates(tags: Tags) -> bool:
    if tags.get("tunnel", "no") != "no" or tags.get("bridge", "no") != "no":
        return False

    is_road = tags.get("highway") in MAIN_ROADS
    is_rail = tags.get("railway") == "rail"
    is_water = "waterway" in tags or tags.get("natural") in ("water", "coastline")
    is_barrier = tags.get("barrier") in BARRIERS
    return is_road or is_rail or is_water or is_barrier


def _line_m(extract: Extract, nodes: Iterable[int], middle: Floats) -> Floats:
    """Return the positions of those of the nodes that the extract has, (k, 2)."""
    lonlat = [extract.nodes[node] for node in nodes if node in extract.nodes]
    return plane_m(np.array(lonlat), middle)


def _code(tags: Tags) -> int:
    function = function_of(tags)
    return FUNCTIONS.index(function) if function else UNKNOWN
