"""What has changed on the root map since it was stored last, as records. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from cogmap.graph.graph import Graph
from cogmap.graph.tiles import tiles_of
from cogmap.graph.window import EVIDENCE_COLUMNS
from cogmap.schemas.array import Matrix
from cogmap.schemas.graph import Cells, Operation
from cogmap.schemas.memory import StoredObjects, StoredRecord, StoredTile, StoredTree
from cogmap.schemas.nodes import (
    ROOT_MAP,
    TILE_CELLS,
    LinkKind,
    Map,
    Object,
    PlaceColumn,
    SubMap,
    map_number,
    object_id,
)

COLUMNS = (PlaceColumn.ROAD, PlaceColumn.OBSTACLE, *EVIDENCE_COLUMNS)
"""Of place nodes; the weights of links follow from their evidence."""

Position = tuple[int, int]


class Changes(NamedTuple):
    """Records that are new or changed, and the keys of those that are no more."""

    records: list[StoredRecord]
    forgotten: list[str]


class ChangedPlaces:
    """The squares of the root map that were written since they were stored."""

    def __init__(self) -> None:
        self._changed: set[Position] = set()

    def note(self, operations: Iterable[Operation]) -> None:
        """Note which squares operations write."""
        for operation in operations:
            if not isinstance(operation, Cells) or operation.map != ROOT_MAP:
                continue
            if operation.column in COLUMNS:
                cells = np.asarray(operation.cells.numpy(), np.int64)
                self._changed.update(tiles_of(cells))

    def note_all(self, graph: Graph) -> None:
        """Note all squares of a graph."""
        for (_, x, y), _tile in graph.places.of_map(ROOT_MAP):
            self._changed.add((x, y))

    def take(self, name: str, graph: Graph) -> list[StoredTile]:
        """Take the records of the squares that have changed, of the map that is called `name`."""
        records = []
        for x, y in sorted(self._changed):
            tile = graph.places.tiles.get((ROOT_MAP, x, y))
            if tile is None:
                continue

            columns = {}
            for column in COLUMNS:
                values = tile.columns.get(column)
                if values is not None:
                    columns[column] = Matrix.of(values.reshape(1, TILE_CELLS), "<f2")
            records.append(StoredTile(map=name, x=x, y=y, columns=columns))

        self._changed.clear()
        return records


def stored_objects(name: str, objects: Iterable[Object], graph: Graph) -> list[StoredRecord]:
    """Make the record of the objects of the map that is called `name`; none if there are none."""
    known = sorted(objects, key=lambda node: node.id)
    if not known:
        return []

    rows = []
    for node in known:
        row = (
            node.x_m,
            node.y_m,
            node.x_sd_m,
            node.y_sd_m,
            node.width_m,
            node.height_m,
            float(node.sightings),
        )
        rows.append(row)

    record = StoredObjects(
        map=name,
        cell_m=graph.cell_m(ROOT_MAP),
        labels=[node.label for node in known],
        names=[node.look for node in known],
        given_names=[node.given_name for node in known],
        functions=[node.function for node in known],
        objects=Matrix.of(rows),
    )
    return [record]


def stored_tree(name: str, objects: Iterable[Object], graph: Graph) -> list[StoredRecord]:
    """Make the record of the sub-maps that have some of the objects of the map that is called
    `name`; none if there are none.
    """
    members: dict[str, list[str]] = {}
    for label in sorted(node.label for node in objects):
        target = graph.links.target(object_id(label), LinkKind.WITHIN)
        if target is not None:
            members.setdefault(target, []).append(label)

    sub_maps = []
    for identifier, labels in members.items():
        number = map_number(identifier)
        node = graph.get(Map, identifier)
        if number and node is not None and node.parent == ROOT_MAP:
            sub_map = SubMap(
                number=number,
                cell_m=node.cell_m,
                x_m=node.x_m,
                y_m=node.y_m,
                heading_rad=node.heading_rad,
                width_m=node.width_m,
                height_m=node.height_m,
                members=labels,
            )
            sub_maps.append(sub_map)

    sub_maps.sort(key=lambda each: each.number)
    return [StoredTree(map=name, sub_maps=sub_maps)] if sub_maps else []
