"""Cognitive maps of any size, made up: objects and place nodes around the origin."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cogmap.graph.graph import Graph
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.graph import Decay, Links, PlaceTile, Snapshot
from cogmap.schemas.nodes import (
    ROOT_MAP,
    TILE_SIDE,
    AnyNode,
    LinkKind,
    Map,
    Object,
    PlaceColumn,
    map_id,
    nearest_place,
    object_id,
)
from cogmap.services.codelets.public import CodeletsConfig, coarse_places, sub_map_places

SPREAD_M = 0.3
CELL_M = 1.0
SUB_MAP_SIDE_M = 80.0
SUB_MAP_CELL_M = 2.0
SEED = 17
# Objects are farther away than anything is seen, so that none of them is taken for one in view.
CLEAR_M = 150.0


@dataclass(frozen=True)
class Size:
    """The size of a map: objects, and place nodes, rounded up to whole tiles."""

    objects: int
    places: int


SMALL = Size(objects=100, places=1_000)
LARGE = Size(objects=100_000, places=500_000)


def cognitive_map(size: Size, cycle: int = 1000) -> Snapshot:
    """Return a map as of `cycle`: every object with as many samples as the codelets keep and linked
    to its place, every place node with all columns, the coarse maps, and the places of sub-maps.
    """
    rng = np.random.default_rng(SEED)
    objects = _objects(size.objects, cycle, rng)
    weights = {}
    for node in objects:
        place = nearest_place(node.x_m, node.y_m, CELL_M)
        weights[node.id] = {place: 1.0}

    maps, within = _sub_maps(objects)
    places = Graph()
    places.change([Map(id=ROOT_MAP, cell_m=CELL_M), *maps, *_tiles(size.places, rng)])
    coarse_places.make_all(places)
    sub_map_places.make_all(places, cycle)
    nodes: list[AnyNode] = [*places.of_kind(Map), *objects]
    return Snapshot(
        version=1,
        cycle=cycle,
        decay=Decay(),
        nodes=nodes,
        links=[Links(kind=LinkKind.AT, weights=weights), within],
        tiles=list(places.places.messages()),
    )


def _objects(number: int, cycle: int, rng: np.random.Generator) -> list[Object]:
    """Make buildings, none with quite the same numbers as another."""
    samples = CodeletsConfig().landmark_samples
    radius_m = CLEAR_M + 2 * np.sqrt(number)
    positions_m = rng.uniform(-radius_m, radius_m, (number, 2))
    is_south = positions_m[:, 1] < 0
    positions_m[:, 1] += np.where(is_south, -CLEAR_M, CLEAR_M)

    objects = []
    for index, (x_m, y_m) in enumerate(positions_m.tolist()):
        label = f"building-{index:06d}"
        building = Object(
            id=object_id(label),
            activation=0.4,
            base_level=0.9,
            cycle=cycle,
            label=label,
            x_m=x_m,
            y_m=y_m,
            x_sd_m=SPREAD_M + index * 1e-9,
            y_sd_m=SPREAD_M + index * 2e-9,
            width_m=9.0 + index * 1e-9,
            height_m=6.0 + index * 1e-9,
            sightings=5,
            last_seen_ns=10**12 + index,
            created_ns=10**11 + index,
            offsets_m=Matrix.of(rng.normal(0.0, SPREAD_M, (samples, 2)), "<f2"),
        )
        objects.append(building)

    return objects


def _sub_maps(objects: list[Object]) -> tuple[list[Map], Links]:
    """Make a sub-map of the objects in each of many squares, and link each object to its own."""
    positions_m = np.array([(node.x_m, node.y_m) for node in objects]).reshape(-1, 2)
    squares = np.floor(positions_m / SUB_MAP_SIDE_M)
    occupied, numbers = np.unique(squares, axis=0, return_inverse=True)

    maps = []
    for number in range(len(occupied)):
        members_m = positions_m[numbers == number]
        low_m = members_m.min(axis=0)
        high_m = members_m.max(axis=0)
        x_m, y_m = ((low_m + high_m) / 2).tolist()
        width_m, height_m = (high_m - low_m).tolist()
        sub_map = Map(
            id=map_id(number + 1),
            base_level=1.0,
            cell_m=SUB_MAP_CELL_M,
            parent=ROOT_MAP,
            x_m=x_m,
            y_m=y_m,
            width_m=width_m,
            height_m=height_m,
        )
        maps.append(sub_map)

    weights = {}
    for node, number in zip(objects, numbers.tolist(), strict=True):
        weights[node.id] = {map_id(number + 1): 1.0}

    return maps, Links(kind=LinkKind.WITHIN, weights=weights)


def _tiles(places: int, rng: np.random.Generator) -> list[PlaceTile]:
    """Make tiles in rows of a square that has the agent in its middle."""
    shape = (TILE_SIDE, TILE_SIDE)
    number = math.ceil(places / math.prod(shape))
    side = math.ceil(math.sqrt(number))
    middle = side // 2
    cycles = Array.of(np.zeros(shape, np.int32))

    tiles = []
    for index in range(number):
        row, column = divmod(index, side)
        tile = PlaceTile(
            x=row - middle,
            y=column - middle,
            columns={name: Array.of(rng.random(shape, np.float32)) for name in PlaceColumn},
            activation_cycle=cycles,
        )
        tiles.append(tile)

    return tiles
