"""What the experiments read of the cognitive map, in the agent's own frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cogmap.errors import CogmapError
from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.schemas.nodes import (
    ROOT_MAP,
    Object,
    Observations,
    PathSegment,
    PlaceColumn,
)
from cogmap.services.codelets.mapping.observations import Sightings

STAMP = 0
POSE = slice(1, 4)
ODOMETRY = slice(4, 7)
Pose = tuple[float, float, float]


def self_pose(graph: Graph) -> Pose:
    """Return where the agent believes that it is: x_m, y_m, heading_rad. Raises CogmapError before
    the first cycle.
    """
    agent = graph.agent
    if agent is None:
        raise CogmapError("the graph has no self node")
    return agent.x_m, agent.y_m, agent.heading_rad


def path_rows(graph: Graph) -> Floats:
    """Return the (n, 11) rows of the path, the oldest first: see STAMP, POSE and ODOMETRY."""
    return rows_of(graph.of_kind(PathSegment))


def object_positions_m(graph: Graph, names: Sequence[str]) -> Floats:
    """Return where the objects of these names stand, (n, 2), of several of one name the one that
    was seen most often; NaN for one not on the map.
    """
    positions_m = np.full((len(names), 2), np.nan)
    found = objects_by_name(graph)

    for row, name in enumerate(names):
        node = found.get(name)
        if node is not None:
            positions_m[row] = (node.x_m, node.y_m)

    return positions_m


def objects_by_name(graph: Graph) -> dict[str, Object]:
    """Return the objects by name, of several of one name the one that was seen most often."""
    by_sightings = sorted(graph.of_kind(Object), key=lambda node: node.sightings)
    return {node.name: node for node in by_sightings}


def observations(graph: Graph) -> Sightings:
    """Return all observations of landmarks, by the place of the path that they were made from."""
    stamps_s = path_rows(graph)[:, STAMP]
    return Sightings.of(graph.of_kind(Observations), stamps_s)


def road_m(graph: Graph) -> Floats:
    """Return the middles of the cells that are road, (n, 2)."""
    cells, _ = graph.places.written_cells(ROOT_MAP, PlaceColumn.ROAD)
    indices = cells.astype(np.float64)
    return indices * graph.cell_m()
