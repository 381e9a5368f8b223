"""The nodes of the cognitive map that the benchmark begins with, and those that it reads."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph, object_id
from schemas.array import Array
from schemas.graph import Node, Snapshot

SELF = "self"
PATH = "path"
POSE = ("x_m", "y_m", "heading_rad")
ODOMETRY = ("odometry_x_m", "odometry_y_m", "odometry_heading_rad")
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
    nodes = [_self_node(start, samples)]

    spread_m = np.random.default_rng(0).normal(0.0, CERTAIN_M, (LANDMARK_SAMPLES, 2))
    for label, where_m in landmarks.items():
        nodes.append(_landmark(label, spread_m + where_m, surveyed))

    return Snapshot(version=1, cycle=cycle, nodes=nodes, links=[], tiles=[])


def _self_node(start: Pose, samples: int) -> Node:
    return Node(
        id=SELF,
        kind=SELF,
        activation=1.0,
        base_level=1.0,
        attributes={**dict(zip(POSE, start, strict=True)), "stamp_ns": -1},
        samples=Array.of(np.tile(np.array(start), (samples, 1))),
    )


def _landmark(label: str, samples_m: Floats, surveyed: bool) -> Node:
    x_m, y_m = samples_m.mean(axis=0).tolist()
    return Node(
        id=object_id(label),
        kind="object",
        activation=1.0,
        base_level=1.0,
        attributes={
            "label": label,
            "x_m": x_m,
            "y_m": y_m,
            "surveyed": surveyed,
            "sightings": KNOWN_WELL,
        },
        samples=Array.of(samples_m),
    )


def pose(graph: Graph) -> Floats:
    """(3,): where the agent believes that it is, the mean of the self's samples."""
    facts = graph.nodes[SELF].attributes
    return np.array([float(facts[key]) for key in POSE])


def odometry(graph: Graph) -> Floats:
    """(3,): where path integration alone would have the agent."""
    facts = graph.nodes[SELF].attributes
    return np.array([float(facts[key]) for key in ODOMETRY])


def path(graph: Graph) -> Floats:
    """(n, 7) rows of the path as it is on the map now: stamp_s, pose, and path integration's."""
    segments = sorted(graph.of_kind(PATH), key=lambda node: int(node.attributes["number"]))
    rows = [node.samples.numpy()[:, :7] for node in segments if node.samples is not None]
    return np.vstack(rows).astype(np.float64)
