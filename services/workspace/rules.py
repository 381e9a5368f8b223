"""What a proposal or an offer may write: the rules of the kinds, and of who writes them."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from cogmap.errors import MessageError
from cogmap.graph.graph import Graph
from cogmap.graph.tiles import tiles_of
from cogmap.schemas.graph import (
    Cells,
    Decay,
    DropLink,
    DropNode,
    DropPlaces,
    Link,
    Links,
    Operation,
    PlaceTile,
)
from cogmap.schemas.nodes import (
    KINDS,
    ROOT_MAP,
    GraphNode,
    LinkKind,
    Map,
    Node,
    Object,
    Self,
    kind_name,
    place_cell,
)

Key = str | tuple[str, int, int, str]
"""A node's id, or a column of a tile: its map, x, y and name."""

Writer = Callable[[object], bool]
"""Whether a writer may write a kind of nodes (a type), a kind of links, or a place column."""

# Bounds on what one mistaken answer can cost: cells of 0.8 MB in a message, tiles in memory (cells
# that are far apart make one each), and no cell farther than 1,000 km at 1 m.
MAX_CELLS = 2**16
MAX_TILES = 1024
FARTHEST_CELL = 2**20
_LINK_KINDS = frozenset(map(str, LinkKind))


def may_offer(written: object) -> bool:
    """Decide whether the table lets a kind be offered. Offers may write links of other kinds."""
    if not isinstance(written, type):
        return False
    return KINDS[written].offered


def written_by(operation: Operation) -> Iterable[Key]:
    """Yield what an operation rewrites: a node's id, or tiles' columns; nothing for links, which
    many may write.
    """
    if isinstance(operation, Cells):
        cells = np.asarray(operation.cells.numpy(), np.int64)
        for x, y in tiles_of(cells):
            yield operation.map, x, y, operation.column
    elif isinstance(operation, (GraphNode, DropNode)):
        yield operation.id
    elif isinstance(operation, DropPlaces):
        yield operation.map


def check_operation(name: str, operation: Operation, graph: Graph, writer: Writer) -> None:
    """Raise MessageError if `writer` may not carry out `operation`, `name` being what asks."""
    if isinstance(operation, PlaceTile | Decay):
        kind = type(operation).__name__
        raise MessageError(f"{name}: {kind} is the workspace's own to write")

    if isinstance(operation, Link | Links | DropLink):
        _check_link(name, operation, graph, writer)
    elif isinstance(operation, Cells):
        _check_cells(name, operation, graph, writer)
    elif isinstance(operation, DropNode):
        _check_drop(name, operation, graph, writer)
    elif isinstance(operation, DropPlaces):
        _check_drop_places(name, operation, graph, writer)
    else:
        _check_node(name, operation, graph, writer)


def _check_link(
    name: str, operation: Link | Links | DropLink, graph: Graph, writer: Writer
) -> None:
    if operation.kind not in _LINK_KINDS:
        return

    if not writer(LinkKind(operation.kind)):
        raise MessageError(f"{name} may not write links of kind {operation.kind}")

    if operation.kind == LinkKind.AT and isinstance(operation, Link):
        place = place_cell(operation.target)
        if place is None:
            raise MessageError(f"{name}: {operation.target} is no place node")
        _check_map(name, place[0], graph)


def _check_map(name: str, map_id: str, graph: Graph) -> None:
    if map_id != ROOT_MAP and graph.get(Map, map_id) is None:
        raise MessageError(f"{name}: there is no map {map_id}")


def _check_node(name: str, node: GraphNode, graph: Graph, writer: Writer) -> None:
    if place_cell(node.id) is not None:
        raise MessageError(f"{name}: place nodes are written as cells")

    kind = type(node)
    if not writer(kind):
        raise MessageError(f"{name} may not write nodes of kind {kind_name(kind)}")

    before = graph.nodes.get(node.id)
    if before is not None and type(before) is not kind:
        kept = kind_name(type(before))
        raise MessageError(f"{name}: {node.id} is of kind {kept}, which a node keeps")

    if isinstance(node, Self | Object):
        _check_map(name, node.map, graph)
    if isinstance(node, Node) and node.kind in _KIND_NAMES:
        raise MessageError(f"{name}: {node.id} is a generic node of the known kind {node.kind}")


_KIND_NAMES = frozenset(kind_name(kind) for kind in KINDS if kind is not Node)


def _check_drop(name: str, drop: DropNode, graph: Graph, writer: Writer) -> None:
    if place_cell(drop.id) is not None:
        raise MessageError(f"{name}: place nodes are written as cells")

    node = graph.nodes.get(drop.id)
    if node is None:
        return

    kind = type(node)
    if not KINDS[kind].droppable or drop.id == ROOT_MAP:
        raise MessageError(f"{name}: {drop.id} is never forgotten")
    if not writer(kind):
        raise MessageError(f"{name} may not forget nodes of kind {kind_name(kind)}")


def _check_drop_places(name: str, drop: DropPlaces, graph: Graph, writer: Writer) -> None:
    """Let a writer drop the places in a map's frame only if it may give the map another frame."""
    _check_map(name, drop.map, graph)
    if drop.map == ROOT_MAP:
        raise MessageError(f"{name}: the places of {ROOT_MAP} are never forgotten")
    if not writer(Map):
        raise MessageError(f"{name} may not forget the places of {drop.map}")


def _check_cells(name: str, operation: Cells, graph: Graph, writer: Writer) -> None:
    """Check cells. The tile creates place nodes, so their number and distance are bounded."""
    if not writer(operation.column):
        raise MessageError(f"{name} may not write the place column {operation.column}")
    _check_map(name, operation.map, graph)

    cells = operation.cells
    values = operation.values
    number = cells.shape[0] if cells.shape else 0
    cells_fit = cells.shape == (number, 2) and cells.dtype == "<i4"
    values_fit = values.shape == (number,) and values.dtype == "<f4"
    if not (cells_fit and values_fit):
        raise MessageError(
            f"{name}: cells of shape {cells.shape} with {values.shape} values, or of another dtype"
        )

    if number > MAX_CELLS:
        raise MessageError(f"{name}: {number} cells, at most {MAX_CELLS} are taken at once")

    positions = np.asarray(cells.numpy(), np.int64)
    farthest = int(np.abs(positions).max(initial=0))
    if farthest > FARTHEST_CELL:
        raise MessageError(f"{name}: a cell {farthest} cells away, at most {FARTHEST_CELL}")

    tiles = len(tiles_of(positions)) if number > MAX_TILES else 0
    if tiles > MAX_TILES:
        raise MessageError(f"{name}: cells in {tiles} tiles, at most {MAX_TILES} are taken at once")
