"""The nodes of the cognitive map that the benchmark begins with, and those that it reads."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cogmap.errors import CogmapError
from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.schemas.array import Matrix
from cogmap.schemas.graph import Decay, Snapshot
from cogmap.schemas.nodes import (
    ROOT_MAP,
    SELF_ID,
    AnyNode,
    Map,
    Object,
    PathIntegration,
    PathSegment,
    Self,
    object_id,
)

CERTAIN_M = 1e-3
LANDMARK_SAMPLES = 50
KNOWN_WELL = 100
Pose = tuple[float, float, float]
Landmarks = Mapping[str, tuple[float, float]]


def initial_map(
    start: Pose, landmarks: Landmarks, surveyed: bool, samples: int, cycle: int
) -> Snapshot:
    """A map with the agent at `start`, for certain, and `landmarks` by label where they stand.

    `surveyed` landmarks stay where they are for good. Codelets draw their samples by the number of
    the cycle, so runs that begin at another `cycle` have other noise.
    """
    nodes: list[AnyNode] = [Map(id=ROOT_MAP, cell_m=1.0), _self_node(start, samples)]
    offsets_m = np.random.default_rng(0).normal(0.0, CERTAIN_M, (LANDMARK_SAMPLES, 2))

    for label, (x_m, y_m) in landmarks.items():
        landmark = Object(
            id=object_id(label),
            activation=1.0,
            base_level=1.0,
            cycle=cycle,
            label=label,
            x_m=x_m,
            y_m=y_m,
            surveyed=surveyed,
            sightings=KNOWN_WELL,
            offsets_m=Matrix.of(offsets_m, "<f2"),
        )
        nodes.append(landmark)

    return Snapshot(version=1, cycle=cycle, decay=Decay(), nodes=nodes, links=[], tiles=[])


def _self_node(start: Pose, samples: int) -> Self:
    x_m, y_m, heading_rad = start
    certain = np.tile(np.array(start), (samples, 1))

    return Self(
        id=SELF_ID,
        activation=1.0,
        base_level=1.0,
        x_m=x_m,
        y_m=y_m,
        heading_rad=heading_rad,
        odometry=PathIntegration(x_m=x_m, y_m=y_m, heading_rad=heading_rad),
        samples=Matrix.of(certain),
    )


def pose(graph: Graph) -> Floats:
    """(3,): where the agent believes that it is, the mean of the self's samples."""
    agent = _agent(graph)
    return np.array([agent.x_m, agent.y_m, agent.heading_rad])


def odometry(graph: Graph) -> Floats:
    """(3,): where path integration alone would have the agent."""
    return _agent(graph).odometry.pose()


def path(graph: Graph) -> Floats:
    """(n, 11) rows of the path as it is on the map now, see PathColumn."""
    segments = graph.of_kind(PathSegment)
    return rows_of(segments)


def _agent(graph: Graph) -> Self:
    if graph.agent is None:
        raise CogmapError("the graph has no self node")
    return graph.agent
