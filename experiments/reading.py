"""What the experiments read of the cognitive map, in the agent's own frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import TILE_SIDE, Graph, object_id
from services.codelets.mapping.observations import Sightings
from services.codelets.mapping.path import rows_of

STAMP = 0
POSE = slice(1, 4)
ODOMETRY = slice(4, 7)
POSE_KEYS = ("x_m", "y_m", "heading_rad")


def self_pose(graph: Graph) -> tuple[float, float, float]:
    """Where the agent believes that it is: x_m, y_m, heading_rad."""
    facts = graph.nodes["self"].attributes
    x_m, y_m, heading_rad = (float(facts[key]) for key in POSE_KEYS)
    return x_m, y_m, heading_rad


def path_rows(graph: Graph) -> Floats:
    """(n, 9) rows of the path, the oldest first: see STAMP, POSE and ODOMETRY."""
    return rows_of(graph.nodes.values())


def object_positions_m(graph: Graph, labels: Sequence[str]) -> Floats:
    """(n, 2): where the objects of that label stand; NaN for one that is not on the map."""
    positions_m = np.full((len(labels), 2), np.nan)

    for row, label in enumerate(labels):
        node = graph.nodes.get(object_id(label))
        if node is not None:
            positions_m[row] = (node.attributes["x_m"], node.attributes["y_m"])

    return positions_m


def observations(graph: Graph) -> Sightings:
    """All observations of landmarks, by the place of the path that they were made from."""
    return Sightings.of(graph.nodes.values(), path_rows(graph)[:, STAMP])


def road_m(graph: Graph) -> Floats:
    """(n, 2): the middles of the cells that are road."""
    cells = [np.zeros((0, 2))]

    for place, tile in sorted(graph.tiles.items()):
        here = np.argwhere(tile.columns["road"] > 0)
        cells.append(here + TILE_SIDE * np.array(place))

    return np.vstack(cells) * graph.cell_m
