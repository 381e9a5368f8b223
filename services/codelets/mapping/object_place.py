"""The object-place codelet: what is recognised for the first time gets a node, samples and a place
(paper §5.2).
"""

from __future__ import annotations

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.se2 import mean_pose
from cogmap.graph.graph import object_id
from schemas.array import Array
from schemas.base import Scalar
from schemas.cognition import Task
from schemas.graph import Cells, Node, Operation
from services.codelets.config import Config
from services.codelets.localization.landmarks import (
    FIRST,
    first_sighting,
    near_by,
    object_operations,
)
from services.codelets.localization.motion_model import with_gains
from services.codelets.localization.sampling import generator, resample

FIRST_BASE_LEVEL = 0.2
ROAD_REACH_M = 12.0
ENOUGH_POINTS = 3


def place_object(task: Task, config: Config) -> list[Operation]:
    """A node for the one percept of `task`, with samples of where it stands; none while the agent
    is lost.
    """
    self_node = next(node for node in task.nodes if node.kind == "self")
    if self_node.samples is None:
        raise MessageError(f"task {task.task_id} has a self node without samples")
    if self_node.attributes.get("others", False):
        return []
    rng = generator(task.task_id)
    percept = task.percepts[0]
    selves = near_by(
        with_gains(np.array(self_node.samples.numpy(), np.float64), config, rng), config
    )
    selves = resample(selves, config.landmark_samples, 0.0, rng)
    attributes: dict[str, Scalar] = {"label": percept.label, "since_ns": task.stamp_ns}
    node = Node(
        id=object_id(percept.label),
        kind="object",
        base_level=FIRST_BASE_LEVEL,
        attributes=attributes,
    )
    return object_operations(
        task, node, first_sighting(selves, percept, config, rng), percept, FIRST
    )


def place_road(task: Task, config: Config) -> list[Operation]:
    """Mark the place nodes near the agent that it sees as road, and the one that it stands on."""
    self_node = next(node for node in task.nodes if node.kind == "self")
    if self_node.samples is None:
        raise MessageError(f"task {task.task_id} has a self node without samples")
    x_m, y_m, heading = mean_pose(np.asarray(self_node.samples.numpy(), np.float64))
    here = np.rint(np.array([[x_m, y_m]]) / task.cell_m).astype(np.int32)
    operations: list[Operation] = [
        Cells(column="activation", cells=Array.of(here), values=Array.of(np.ones(1, np.float32)))
    ]
    seen = np.asarray(task.road_m.numpy(), np.float64).reshape(-1, 2)
    seen = seen[np.hypot(seen[:, 0], seen[:, 1]) < ROAD_REACH_M]
    turn = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    cells = np.rint((seen @ turn + (x_m, y_m)) / task.cell_m).astype(np.int32)
    cells, numbers = np.unique(cells, axis=0, return_counts=True)
    if len(cells):
        share = np.minimum(1.0, numbers / ENOUGH_POINTS).astype(np.float32)
        operations.append(
            Cells(column="road", cells=Array.of(cells, "<i4"), values=Array.of(share))
        )
    return operations
