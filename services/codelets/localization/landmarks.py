"""Where each landmark in view is: the landmark codelet (paper §5.4, eq. 4)."""

from __future__ import annotations

from typing import NamedTuple

import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.se2 import mean_pose, wrap_angle
from cogmap.graph.graph import nearest_place
from schemas.array import Array
from schemas.cognition import Task
from schemas.graph import Node, Operation
from schemas.sensing import Percept
from services.codelets.config import Config
from services.codelets.localization.measurement_model import (
    MOVING,
    has_bearing,
    has_range,
    seen_from_here,
)
from services.codelets.localization.motion_model import POSE_COLUMNS, RANGE, with_gains
from services.codelets.localization.sampling import (
    Samples,
    generator,
    rejection_mask,
    resample,
    spread,
)
from services.codelets.mapping.places import place_link

GAP = 3.0
LOCAL_SHARE = 0.5


class Record(NamedTuple):
    """How often a landmark was seen where it is believed to be, and how often on end it was seen
    elsewhere since.
    """

    agreed: int
    missed: int


FIRST = Record(1, 0)


def locate_landmark(task: Task, config: Config) -> list[Operation]:
    """Eq. 4 for the one landmark and percept of `task`: keep the samples that agree with what is
    seen now.

    A landmark that disagrees `config.misses` times on end, or more often than it ever agreed,
    stands elsewhere: it starts anew from what is seen. But while it is the agent who may be
    elsewhere, or stands and sees the same again, landmarks stay where they are, and those that were
    surveyed always do.
    """
    self_node = next(node for node in task.nodes if node.kind == "self")
    landmark = next(node for node in task.nodes if node.kind == "object")
    if self_node.samples is None or landmark.samples is None:
        raise MessageError(f"task {task.task_id} has nodes without samples")
    rng = generator(task.task_id)
    percept = task.percepts[0]
    before = np.array(landmark.samples.numpy(), np.float64)
    agreed, missed = (int(landmark.attributes.get(key, 0)) for key in ("sightings", "misses"))
    if _stays(self_node, landmark):
        return object_operations(task, landmark, before, percept, Record(agreed, missed))
    selves = near_by(
        with_gains(np.array(self_node.samples.numpy(), np.float64), config, rng), config
    )
    selves = rng.permutation(resample(selves, len(before), 0.0, rng))
    squared = _squared(before, selves, percept)
    if squared.min() < config.gate**2:
        kept = before[rejection_mask(-squared / 2 / config.correlated_views, rng)]
        # Few that are left stand for all between them: of a ring or a ray, the next view must find
        # some again.
        jitter_m = np.maximum(
            config.landmark_jitter_m, GAP * spread(kept, kept.mean(axis=0)) / len(kept)
        )
        kept = resample(kept, len(before), jitter_m, rng)
        return object_operations(task, landmark, kept, percept, Record(agreed + 1, 0))
    if missed + 1 < min(config.misses, agreed + 1):
        return object_operations(task, landmark, before, percept, Record(agreed, missed + 1))
    anew = msgspec.structs.replace(
        landmark, attributes=landmark.attributes | {"since_ns": task.stamp_ns}
    )
    return object_operations(
        task, anew, first_sighting(selves, percept, config, rng), percept, FIRST
    )


def near_by(selves: Samples, config: Config) -> Samples:
    """(n, 7) samples of the self for where a landmark stands as seen from it, which is known
    however lost it is.

    The paper's samples start from their mean at each step (§5.4), so that landmarks are as sure as
    the last step was. Here the self's samples keep all that is unsure since the start; drawn
    together about their mean, they say the same.
    """
    mean = mean_pose(selves)
    sd = spread(selves[:, :POSE_COLUMNS], mean)
    share = min(
        1.0, LOCAL_SHARE * config.largest_landmark_sd_m / max(float(np.hypot(sd[0], sd[1])), 1e-9)
    )
    if share == 1.0:
        return selves
    off = selves[:, :POSE_COLUMNS] - mean
    off[:, 2] = wrap_angle(off[:, 2])
    return np.hstack([mean + share * off, selves[:, POSE_COLUMNS:]])


def _stays(self_node: Node, landmark: Node) -> bool:
    own = self_node.attributes
    facts = landmark.attributes
    here = seen_from_here(landmark, int(own.get("stands_ns", MOVING)))
    return bool(facts.get("surveyed", False)) or bool(own.get("others", False)) or here


def _squared(where_m: Samples, selves: Samples, percept: Percept) -> Samples:
    """Squared deviations (n,) of the percept from what each pair of landmark and self would have it
    be.
    """
    offset = where_m - selves[:, :2]
    squared = np.zeros(len(offset))
    if has_bearing(percept):
        off = wrap_angle(
            np.arctan2(offset[:, 1], offset[:, 0]) - selves[:, 2] - percept.bearing_rad
        )
        squared += (off / percept.bearing_sd_rad) ** 2
    if has_range(percept):
        distance = np.hypot(offset[:, 0], offset[:, 1]) * (1 + selves[:, RANGE])
        squared += ((distance - percept.range_m) / percept.range_sd_m) ** 2
    return squared


def first_sighting(
    selves: Samples, percept: Percept, config: Config, rng: np.random.Generator
) -> Samples:
    """Where something may be that is seen from (n, 7) samples of the self for the first time: (n,
    2) samples.

    Seen by range alone it is on a ring, by bearing alone on a ray as long as `config.farthest_m`.
    """
    number = len(selves)
    if has_bearing(percept):
        bearing = selves[:, 2] + rng.normal(percept.bearing_rad, percept.bearing_sd_rad, number)
    else:
        bearing = rng.uniform(-np.pi, np.pi, number)
    if has_range(percept):
        distance = rng.normal(percept.range_m, percept.range_sd_m, number).clip(0.1) / (
            1 + selves[:, RANGE]
        )
    else:
        distance = rng.uniform(0.0, config.farthest_m, number)
    where: Samples = selves[:, :2] + distance[:, None] * np.column_stack(
        [np.cos(bearing), np.sin(bearing)]
    )
    return where


def object_operations(
    task: Task, node: Node, samples: Samples, percept: Percept, record: Record
) -> list[Operation]:
    """An object node with new samples, refreshed by a percept, and its link to the place of their
    mean.
    """
    mean = samples.mean(axis=0)
    sd = spread(samples, mean)
    cell = nearest_place(mean[0], mean[1], task.cell_m)
    attributes = node.attributes | {
        "x_m": float(mean[0]),
        "y_m": float(mean[1]),
        "x_sd_m": float(sd[0]),
        "y_sd_m": float(sd[1]),
        "width_m": percept.width_m,
        "height_m": percept.height_m,
        "sightings": record.agreed,
        "misses": record.missed,
        "stamp_ns": task.stamp_ns,
        "place": cell,
    }
    seen = Node(
        id=node.id,
        kind="object",
        activation=percept.activation,
        base_level=min(1.0, node.base_level + 0.05),
        attributes=attributes,
        samples=Array.of(samples),
    )
    return [seen, *place_link(node, cell)]
