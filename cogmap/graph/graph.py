"""The Current Situational Model in memory: what the workspace writes and every replica follows."""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from cogmap.bus.codec import encode
from cogmap.errors import MessageError
from schemas.array import Array
from schemas.graph import (
    Activations,
    Cells,
    Delta,
    DropLink,
    DropNode,
    Link,
    Links,
    Node,
    Operation,
    PlaceTile,
    Snapshot,
)

TILE_SIDE = 32
LISTED = frozenset({"path", "sighted", "closure", "correction"})
COLUMNS = {"activation": 0.0, "road": 0.0, "traversable": 1.0}
_PLACE = "place"
Weights = dict[str, dict[str, float]]


def object_id(label: str) -> str:
    """The name of the node of the object that EPAM calls `label`."""
    return f"object:{label}"


def place_id(i: int, j: int) -> str:
    """The name of the place node of grid cell (i, j)."""
    return f"{_PLACE}:{i}:{j}"


def nearest_place(x_m: float, y_m: float, cell_m: float) -> str:
    """The name of the place node nearest to a position, in a grid of `cell_m`."""
    return place_id(round(x_m / cell_m), round(y_m / cell_m))


def place_cell(identifier: str) -> tuple[int, int] | None:
    """The grid cell of a place node's name; None for any other node's."""
    kind, _, cell = identifier.partition(":")
    i, _, j = cell.partition(":")
    try:
        return (int(i), int(j)) if kind == _PLACE else None
    except ValueError:
        return None


@dataclass
class Tile:
    """TILE_SIDE x TILE_SIDE place nodes as float32 columns, indexed [i, j] within the tile."""

    columns: dict[str, npt.NDArray[np.float32]] = field(
        default_factory=lambda: {
            name: np.full((TILE_SIDE, TILE_SIDE), value, np.float32)
            for name, value in COLUMNS.items()
        }
    )


class Graph:
    """Nodes, links and place tiles at one version. Place nodes are made with their tile, `cell_m`
    apart.

    `links` holds weights by kind, source and target. Which nodes are of the kinds LISTED is known
    without a search.
    """

    def __init__(self, cell_m: float = 1.0) -> None:
        self.version = 0
        self.cycle = 0
        self.cell_m = cell_m
        self.nodes: dict[str, Node] = {}
        self.links: defaultdict[str, Weights] = defaultdict(dict)
        self.tiles: dict[tuple[int, int], Tile] = {}
        self._listed: defaultdict[str, set[str]] = defaultdict(set)
        self._appliers: dict[type, Callable[[Any], None]] = {
            Link: self._put_link,
            Links: self._put_links,
            PlaceTile: self._put_tile,
            DropNode: self._drop_node,
            DropLink: self._drop_link,
            Activations: self._put_activations,
            Cells: self._put_cells,
        }

    def apply(self, delta: Delta) -> bool:
        """Take in the next commit. False where it is not the next one: an old one is passed over, a
        gap stays.
        """
        if delta.version != self.version + 1:
            return False
        self.change(delta.operations)
        self.version = delta.version
        self.cycle = delta.cycle
        return True

    def change(self, operations: list[Operation]) -> None:
        """Carry out operations, in order."""
        nodes = self.nodes
        appliers = self._appliers
        for operation in operations:
            if type(operation) is Node:  # most are
                nodes[operation.id] = operation
                if operation.kind in LISTED:
                    self._listed[operation.kind].add(operation.id)
            else:
                appliers[type(operation)](operation)

    def _put_link(self, link: Link) -> None:
        self.links[link.kind].setdefault(link.source, {})[link.target] = link.weight

    def _put_links(self, links: Links) -> None:
        here = self.links[links.kind]
        for source, weights in links.weights.items():
            if source in here:
                here[source].update(weights)
            else:
                here[source] = weights.copy()  # the message's own may be still to be sent

    def _drop_link(self, drop: DropLink) -> None:
        self.links[drop.kind].get(drop.source, {}).pop(drop.target, None)

    def _drop_node(self, drop: DropNode) -> None:
        node = self.nodes.pop(drop.id, None)
        if node is None:
            return
        self._listed[node.kind].discard(drop.id)
        for sources in self.links.values():
            sources.pop(drop.id, None)
            for weights in sources.values():
                weights.pop(drop.id, None)

    def _put_activations(self, activations: Activations) -> None:
        ids = activations.ids
        values = activations.values.numpy()
        base_levels = activations.base_levels.numpy()
        if values.shape != (len(ids),) or base_levels.shape != (len(ids),):
            raise MessageError(
                f"{len(ids)} nodes with {values.shape} activations, {base_levels.shape} base-levels"
            )
        for identifier, value, base_level in zip(
            ids, values.tolist(), base_levels.tolist(), strict=True
        ):
            if (node := self.nodes.get(identifier)) is not None:
                faded = copy(node)  # the node itself may be in a message that is still to be sent
                faded.activation = value
                faded.base_level = base_level
                self.nodes[identifier] = faded

    def _put_tile(self, tile: PlaceTile) -> None:
        if tile.side != TILE_SIDE:
            raise MessageError(f"a tile of side {tile.side}, the grid has {TILE_SIDE}")
        self.cell_m = tile.cell_m
        columns = {name: getattr(tile, name).numpy() for name in COLUMNS}
        for name, column in columns.items():
            if column.shape != (TILE_SIDE, TILE_SIDE):
                raise MessageError(f"tile column {name} of shape {column.shape}")
        self.tiles[tile.x, tile.y] = Tile(
            {name: np.array(column, np.float32) for name, column in columns.items()}
        )

    def _put_cells(self, cells: Cells) -> None:
        where = cells.cells.numpy().astype(np.int64)
        values = cells.values.numpy().astype(np.float32)
        if cells.column not in COLUMNS or where.ndim != 2 or where.shape != (values.size, 2):
            raise MessageError(
                f"cells {where.shape} of column {cells.column!r} with values {values.shape}"
            )
        tiles, inside = np.divmod(where, TILE_SIDE)
        for x, y in np.unique(tiles, axis=0).tolist():
            mine = (tiles[:, 0] == x) & (tiles[:, 1] == y)
            tile = self.tiles.setdefault((x, y), Tile())
            tile.columns[cells.column][inside[mine, 0], inside[mine, 1]] = values[mine]

    def of_kind(self, kind: str) -> list[Node]:
        """All nodes of a kind, by name. Of a kind that is not LISTED it takes a look at every node."""
        names = sorted(self._listed[kind] if kind in LISTED else self.nodes)
        return [self.nodes[name] for name in names if self.nodes[name].kind == kind]

    def place(self, i: int, j: int) -> Node | None:
        """The place node of a cell, as a node like any other; None where no tile has come into
        being.
        """
        tile = self.tiles.get((i // TILE_SIDE, j // TILE_SIDE))
        if tile is None:
            return None
        values = {
            name: float(column[i % TILE_SIDE, j % TILE_SIDE])
            for name, column in tile.columns.items()
        }
        activation = values.pop("activation")
        where = {"x_m": i * self.cell_m, "y_m": j * self.cell_m}
        return Node(
            id=place_id(i, j),
            kind=_PLACE,
            activation=min(1.0, activation),
            attributes={**where, **values},
        )

    def place_links(self, i: int, j: int) -> Iterator[Link]:
        """The links from a place node to its eight neighbours, weighted by how traversable both
        are.
        """
        here = self.place(i, j)
        for di, dj in ((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)):
            there = self.place(i + di, j + dj)
            if here is not None and there is not None:
                weight = (
                    float(here.attributes["traversable"]) + float(there.attributes["traversable"])
                ) / 2
                yield Link(source=here.id, target=there.id, kind="next", weight=weight)

    def snapshot(self) -> Snapshot:
        """Everything, in an order that depends on the content alone."""
        return Snapshot(
            version=self.version,
            cycle=self.cycle,
            nodes=[self.nodes[identifier] for identifier in sorted(self.nodes)],
            links=[
                Link(source=s, kind=k, target=t, weight=weight)
                for s, k, t, weight in self._sorted_links()
            ],
            tiles=[self._tile_message(x, y) for x, y in sorted(self.tiles)],
        )

    def _sorted_links(self) -> list[tuple[str, str, str, float]]:
        return sorted(
            (source, kind, target, weight)
            for kind, sources in self.links.items()
            for source, weights in sources.items()
            for target, weight in weights.items()
        )

    def _tile_message(self, x: int, y: int) -> PlaceTile:
        columns = {name: Array.of(column) for name, column in self.tiles[x, y].columns.items()}
        return PlaceTile(x=x, y=y, side=TILE_SIDE, cell_m=self.cell_m, **columns)

    def load(self, snapshot: Snapshot) -> None:
        """Put `snapshot` in place of everything."""
        self.nodes = {}
        self.tiles = {}
        self.links.clear()
        self._listed.clear()
        self.change([*snapshot.nodes, *snapshot.links, *snapshot.tiles])
        self.version = snapshot.version
        self.cycle = snapshot.cycle

    def digest(self) -> str:
        """A hash of the content: two graphs are the same if and only if their digests are."""
        return hashlib.blake2b(encode(self.snapshot()), digest_size=16).hexdigest()
