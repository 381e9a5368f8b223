"""The landmark codelet: where the landmarks in view are (paper §5.4, eq. 4)."""

from __future__ import annotations

from typing import NamedTuple

import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.se2 import mean_pose, wrap_angle
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.schemas.array import Matrix
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Link, Operation, Phase
from cogmap.schemas.nodes import (
    NEVER_NS,
    POSE_COLUMNS,
    SELF_ID,
    LinkKind,
    Object,
    Self,
    SelfColumn,
    nearest_place,
    object_id,
)
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.config import SECTION, Config
from cogmap.services.codelets.localization.measurement_model import (
    MIN_SIGHTINGS,
    is_seen_from_here,
)
from cogmap.services.codelets.localization.motion_model import with_gains
from cogmap.services.codelets.localization.sampling import (
    Samples,
    generator,
    rejection_mask,
    resample,
    spread,
)

GAP = 3.0
LOCAL_SHARE = 0.5
MIN_RANGE_M = 0.1
CONFIRMED_BASE_LEVEL = 0.15


class Record(NamedTuple):
    """In how many views a landmark was seen where it is believed to be, and in how many in a row it
    was seen elsewhere since.
    """

    sightings: int
    misses: int


FIRST = Record(1, 0)


class Seen(NamedTuple):
    """A percept, and the object that it is of."""

    percept: Percept
    node: Object


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """One task for all objects in view that the map has."""
    known = []
    for percept in sorted(context.percepts.objects, key=lambda percept: percept.label):
        if object_id(percept.label) in graph.nodes:
            known.append(percept)

    if not known:
        return []
    about = [SELF_ID, *(object_id(percept.label) for percept in known)]
    return [context.task(CODELET.name, about, percepts=known)]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Eq. 4 for each percept of `task` and its landmark: keep the samples that agree with what is
    seen now.

    A landmark that disagrees in `config.misses` views in a row, or in more than it ever agreed
    with, stands elsewhere: it starts anew from what is seen, once it is certain that the agent is
    not elsewhere. While the agent stands still and sees the same again, landmarks stay where they
    are; those that were surveyed always do.
    """
    agent = graph.agent
    if agent is None:
        raise MessageError(f"task {task.task_id}: the graph has no self node")

    answer = Answer()
    for percept in task.percepts:
        landmark = graph.get(Object, object_id(percept.label))
        if landmark is None:
            raise MessageError(f"task {task.task_id}: the graph lacks {percept.label}")

        seen = Seen(percept, landmark)
        answer.operations.extend(_updated(seen, agent, task, graph, config))

    return answer


CODELET = Codelet(
    name="landmark",
    phase=Phase.OBJECTS,
    due=due,
    run=run,
    reads=frozenset({Self, Object}),
    writes=frozenset({Object, LinkKind.AT}),
    config=Config,
    section=SECTION,
)


def _updated(seen: Seen, agent: Self, task: Task, graph: Graph, config: Config) -> list[Operation]:
    """A landmark after the view of `task`, and its link to the place there."""
    percept, landmark = seen
    before = landmark.positions_m()
    record = Record(landmark.sightings, landmark.misses)
    if _stays(agent, landmark):
        return _refreshed(seen, task, graph, record)

    rng = generator(f"{task.task_id}/{percept.label}")
    selves = nearby_selves(with_gains(agent.samples.numpy(), config, rng), config)
    selves = rng.permutation(resample(selves, len(before), 0.0, rng))
    mahalanobis2 = _mahalanobis2(before, selves, percept)
    if mahalanobis2.min() < config.gate**2:
        log_likelihood = -mahalanobis2 / 2 / config.correlated_views
        kept = before[rejection_mask(log_likelihood, rng)]
        after = resample(kept, len(before), _jitter_m(kept, config), rng)
        record = Record(record.sightings + 1, 0)
        return located(seen, task, graph, after, record)

    misses = record.misses + 1
    is_patient = misses < min(config.misses, record.sightings + 1)
    if is_patient or _may_be_elsewhere(agent, task.stamp_ns):
        record = Record(record.sightings, misses)
        return _refreshed(seen, task, graph, record)

    anew = msgspec.structs.replace(landmark, created_ns=task.stamp_ns)
    positions_m = first_positions(selves, percept, config, rng)
    return located(Seen(percept, anew), task, graph, positions_m, FIRST)


def nearby_selves(selves: Samples, config: Config) -> Samples:
    """(n, 7) samples of the self for placing landmarks relative to it, which is known however lost
    the agent is.

    The paper's samples start from their mean at each step (§5.4), so that landmarks are as certain
    as the last step was. Here the self's samples keep all that is uncertain since the start; drawn
    together about their mean, they state the same.
    """
    mean = mean_pose(selves)
    sd = spread(selves[:, :POSE_COLUMNS], mean)

    position_sd_m = max(float(np.hypot(sd[0], sd[1])), 1e-9)
    share = min(1.0, LOCAL_SHARE * config.largest_landmark_sd_m / position_sd_m)
    if share == 1.0:
        return selves

    offset = selves[:, :POSE_COLUMNS] - mean
    offset[:, 2] = wrap_angle(offset[:, 2])
    poses = mean + share * offset
    return np.hstack([poses, selves[:, POSE_COLUMNS:]])


def first_positions(
    selves: Samples, percept: Percept, config: Config, rng: np.random.Generator
) -> Samples:
    """(n, 2) samples of where an object may be that is seen for the first time from (n, 7) samples
    of the self.

    Seen by range alone it is on a ring, by bearing alone on a ray as long as `config.farthest_m`.
    """
    number = len(selves)

    if percept.has_bearing:
        seen_rad = rng.normal(percept.bearing_rad, percept.bearing_sd_rad, number)
        direction_rad = selves[:, SelfColumn.HEADING_RAD] + seen_rad
    else:
        direction_rad = rng.uniform(-np.pi, np.pi, number)

    if percept.has_range:
        seen_m = rng.normal(percept.range_m, percept.range_sd_m, number).clip(MIN_RANGE_M)
        distance_m = seen_m / (1 + selves[:, SelfColumn.RANGE_GAIN])
    else:
        distance_m = rng.uniform(0.0, config.farthest_m, number)

    direction = np.column_stack([np.cos(direction_rad), np.sin(direction_rad)])
    positions_m: Samples = selves[:, :2] + distance_m[:, None] * direction
    return positions_m


def located(
    seen: Seen, task: Task, graph: Graph, positions_m: Samples, record: Record
) -> list[Operation]:
    """The object with new samples, refreshed by the percept in the view of `task`, and its link to
    the place of their mean.
    """
    mean = positions_m.mean(axis=0)
    sd = spread(positions_m, mean)
    moved = msgspec.structs.replace(
        seen.node,
        x_m=float(mean[0]),
        y_m=float(mean[1]),
        x_sd_m=float(sd[0]),
        y_sd_m=float(sd[1]),
        offsets_m=Matrix.of(positions_m - mean, "<f2"),
    )
    return _refreshed(Seen(seen.percept, moved), task, graph, record)


def _refreshed(seen: Seen, task: Task, graph: Graph, record: Record) -> list[Operation]:
    """The object refreshed by the percept in the view of `task`, its position as it is, and its
    link to the place there. Being seen excites its activation; but for the second view, its base
    level is learned by consciousness alone.
    """
    percept, node = seen
    refreshed = msgspec.structs.replace(
        node,
        function=percept.function or node.function,
        activation=percept.activation,
        base_level=_base_level(node, record, graph),
        cycle=task.cycle,
        width_m=percept.width_m,
        height_m=percept.height_m,
        sightings=record.sightings,
        misses=record.misses,
        last_seen_ns=task.stamp_ns,
    )
    cell_m = graph.cell_m(node.map)
    place = nearest_place(node.x_m, node.y_m, cell_m, node.map)
    return [refreshed, Link(source=node.id, target=place, kind=LinkKind.AT)]


def _base_level(node: Object, record: Record, graph: Graph) -> float:
    """The base level of an object now, which rises where a second view confirms the first.

    Until then a new object may be a mistake, and is forgotten as soon as it is neither in view nor
    conscious.
    """
    level = graph.base_level(node)
    is_confirmed = node.sightings < MIN_SIGHTINGS <= record.sightings
    if is_confirmed and level < CONFIRMED_BASE_LEVEL:
        return level + CONFIRMED_BASE_LEVEL
    return level


def _jitter_m(kept: Samples, config: Config) -> Samples:
    """The standard deviations of the noise that resampling adds to (n, 2) samples.

    Few samples represent all positions between them: of a ring or a ray, the next view must find
    some again.
    """
    sd_m = spread(kept, kept.mean(axis=0))
    gaps_m = GAP * sd_m / len(kept)
    jitter_m: Samples = np.maximum(config.landmark_jitter_m, gaps_m)
    return jitter_m


def _stays(agent: Self, landmark: Object) -> bool:
    if landmark.surveyed or agent.is_lost:
        return True

    return is_seen_from_here(landmark, agent.stationary_since_ns)


def _may_be_elsewhere(agent: Self, stamp_ns: int) -> bool:
    """Whether nothing in view confirms where the agent is, and that it is nowhere else was not
    found before the view at `stamp_ns`.
    """
    if not agent.misfit_count:
        return False
    return not NEVER_NS < agent.not_elsewhere_ns < stamp_ns


def _mahalanobis2(positions_m: Samples, selves: Samples, percept: Percept) -> Samples:
    """(n,): squared deviations of the percept from what each pair of landmark and self predicts."""
    offset_m = positions_m - selves[:, :2]
    mahalanobis2 = np.zeros(len(offset_m))

    if percept.has_bearing:
        direction_rad = np.arctan2(offset_m[:, 1], offset_m[:, 0])
        bearing_rad = direction_rad - selves[:, SelfColumn.HEADING_RAD]
        residual_rad = wrap_angle(bearing_rad - percept.bearing_rad)
        mahalanobis2 += (residual_rad / percept.bearing_sd_rad) ** 2

    if percept.has_range:
        distance_m = np.hypot(offset_m[:, 0], offset_m[:, 1])
        expected_m = distance_m * (1 + selves[:, SelfColumn.RANGE_GAIN])
        residual_m = expected_m - percept.range_m
        mahalanobis2 += (residual_m / percept.range_sd_m) ** 2

    return mahalanobis2
