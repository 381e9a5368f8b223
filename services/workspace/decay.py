"""Activation fades, and what falls below threshold is forgotten."""

from __future__ import annotations

import numpy as np

from cogmap.graph.graph import TILE_SIDE, Graph
from schemas.array import Array
from schemas.graph import Activations, Cells, DropNode, Operation
from services.workspace.config import Config

# What the agent knows of itself and its way is not a matter of activation.
LASTING = frozenset({"self", "path", "sighted", "closure", "correction"})


def fade(graph: Graph, config: Config) -> list[Operation]:
    """One tick of linear decay: results, not changes, so that they may be applied twice."""
    faded: dict[str, tuple[float, float]] = {}
    operations: list[Operation] = []
    for identifier in sorted(graph.nodes):
        node = graph.nodes[identifier]
        if node.kind in LASTING:
            continue
        activation = max(0.0, node.activation - config.decay)
        base_level = max(0.0, node.base_level - config.base_level_decay)
        if min(1.0, activation + base_level) < config.forget_below:
            operations.append(DropNode(id=identifier))
        else:
            faded[identifier] = (activation, base_level)
    if faded:
        values = np.array(list(faded.values()), np.float32)
        columns = {"values": Array.of(values[:, 0]), "base_levels": Array.of(values[:, 1])}
        operations.append(Activations(ids=list(faded), **columns))
    return [*operations, *_fade_places(graph, config)]


def _fade_places(graph: Graph, config: Config) -> list[Operation]:
    """Place nodes fade too: the trace of where the agent has just been."""
    cells = []
    values = []
    for x, y in sorted(graph.tiles):
        column = graph.tiles[x, y].columns["activation"]
        i, j = np.nonzero(column)
        cells.append(np.column_stack([i + x * TILE_SIDE, j + y * TILE_SIDE]))
        values.append(np.maximum(0.0, column[i, j] - config.place_decay))
    if not cells or not sum(map(len, cells)):
        return []
    where = np.vstack(cells).astype(np.int32)
    return [
        Cells(
            column="activation",
            cells=Array.of(where),
            values=Array.of(np.concatenate(values), "<f4"),
        )
    ]
