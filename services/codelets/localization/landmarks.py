"""The landmark codelet: where each landmark in view is (paper §5.4, eq. 4)."""

from __future__ import annotations

import math
from typing import NamedTuple

import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.se2 import wrap_angle
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from schemas.array import Matrix
from schemas.codelets import Task
from schemas.graph import Link, Phase
from schemas.nodes import (
    POSE_COLUMNS,
    SELF_ID,
    LinkKind,
    Object,
    Self,
    SelfColumn,
    nearest_place,
    object_id,
)
from schemas.sensing import Percept
from services.codelets.config import SECTION, Config
from services.codelets.localization.measurement_model import (
    has_bearing,
    has_range,
    is_seen_from_here,
)
from services.codelets.localization.motion_model import with_gains
from services.codelets.localization.sampling import (
    Samples,
    centred,
    generator,
    jittered,
    rejection_mask,
    resample,
    select,
    spread,
)

GAP = 3.0
LOCAL_SHARE = 0.5
BASE_LEVEL_GAIN = 0.05
MIN_RANGE_M = 0.1


class Record(NamedTuple):
    """In how many views a landmark was seen where it is believed to be, and in how many in a row it
    was seen elsewhere since.
    """

    sightings: int
    misses: int


FIRST = Record(1, 0)


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """One task for each object in view that the map has."""
    tasks = []
    for percept in sorted(context.percepts.objects, key=lambda percept: percept.label):
        name = object_id(percept.label)
        if name not in graph.nodes:
            continue

        about = [SELF_ID, name]
        task = context.task(CODELET.name, about, subject=percept.label, percepts=[percept])
        tasks.append(task)
    return tasks


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Eq. 4 for the one landmark and percept of `task`: keep the samples that agree with what is
    seen now.

    A landmark that disagrees in `config.misses` views in a row, or in more than it ever agreed
    with, stands elsewhere: it starts anew from what is seen. But while it is the agent that may be
    elsewhere, or stands still and sees the same again, landmarks stay where they are; those that
    were surveyed always do.
    """
    (percept,) = task.percepts
    agent = graph.agent
    landmark = graph.get(Object, object_id(percept.label))
    if agent is None or landmark is None:
        raise MessageError(f"task {task.task_id}: the graph lacks the self or the landmark")

    record = Record(landmark.sightings, landmark.misses)
    if _stays(agent, landmark):
        return _kept_answer(task, graph, landmark, record)

    rng = generator(task.task_id)
    before = np.asfortranarray(landmark.positions_m())
    selves = _drawn_selves(agent, len(before), config, rng)
    mahalanobis2 = _mahalanobis2(before, selves, percept)

    if mahalanobis2.min() < config.gate**2:
        after = _corrected(before, mahalanobis2, config, rng)
        record = Record(record.sightings + 1, 0)
        return object_answer(task, graph, landmark, after, record)

    misses = record.misses + 1
    if misses < min(config.misses, record.sightings + 1):
        record = Record(record.sightings, misses)
        return _kept_answer(task, graph, landmark, record)

    anew = msgspec.structs.replace(landmark, created_ns=task.stamp_ns)
    positions_m = first_positions(selves, percept, config, rng)
    return object_answer(task, graph, anew, positions_m, FIRST)


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


def _drawn_selves(agent: Self, count: int, config: Config, rng: np.random.Generator) -> Samples:
    """`count` samples of the self in random order, one for each sample of a landmark."""
    samples = agent.samples.numpy()
    selves = with_gains(samples, config, rng)
    nearby = nearby_selves(selves, config)

    drawn = resample(nearby, count)
    order = rng.permutation(count)
    return select(drawn, order)


def _corrected(
    positions_m: Samples, mahalanobis2: Samples, config: Config, rng: np.random.Generator
) -> Samples:
    """As many samples of a landmark as before, of those that agree with what is seen."""
    log_likelihood = -mahalanobis2 / 2 / config.correlated_views
    is_kept = rejection_mask(log_likelihood, rng)
    kept = select(positions_m, np.flatnonzero(is_kept))

    jitter_m = _jitter_m(kept, config)
    drawn = resample(kept, len(positions_m))
    return jittered(drawn, jitter_m, rng)


def nearby_selves(selves: Samples, config: Config) -> Samples:
    """(n, 7) samples of the self for placing landmarks relative to it, which is known however lost
    the agent is.

    The paper's samples start from their mean at each step (§5.4), so that landmarks are as certain
    as the last step was. Here the self's samples keep all that is uncertain since the start; drawn
    together about their mean, they state the same.
    """
    mean, offset = centred(selves[:, :POSE_COLUMNS])
    sd = spread(offset[:, :2])
    position_sd_m = max(math.hypot(*sd.tolist()), 1e-9)
    share = min(1.0, LOCAL_SHARE * config.largest_landmark_sd_m / position_sd_m)
    if share == 1.0:
        return selves

    nearby = selves.copy(order="F")
    nearby[:, :POSE_COLUMNS] = mean + share * offset
    return nearby


def first_positions(
    selves: Samples, percept: Percept, config: Config, rng: np.random.Generator
) -> Samples:
    """(n, 2) samples of where an object may be that is seen for the first time from (n, 7) samples
    of the self.

    Seen by range alone it is on a ring, by bearing alone on a ray as long as `config.farthest_m`.
    """
    direction_rad = _first_directions(selves, percept, rng)
    distance_m = _first_distances(selves, percept, config, rng)
    east_m = distance_m * np.cos(direction_rad)
    north_m = distance_m * np.sin(direction_rad)

    offsets_m = np.column_stack([east_m, north_m])
    positions_m: Samples = selves[:, :2] + offsets_m
    return positions_m


def _first_directions(selves: Samples, percept: Percept, rng: np.random.Generator) -> Samples:
    """(n,): the directions, from samples of the self, in which an object may be."""
    number = len(selves)
    if not has_bearing(percept):
        return rng.uniform(-np.pi, np.pi, number)

    bearing_rad = rng.normal(percept.bearing_rad, percept.bearing_sd_rad, number)
    return selves[:, SelfColumn.HEADING_RAD] + bearing_rad


def _first_distances(
    selves: Samples, percept: Percept, config: Config, rng: np.random.Generator
) -> Samples:
    """(n,): the distances, from samples of the self, at which an object may be."""
    number = len(selves)
    if not has_range(percept):
        return rng.uniform(0.0, config.farthest_m, number)

    range_m = rng.normal(percept.range_m, percept.range_sd_m, number)
    distance_m: Samples = range_m.clip(MIN_RANGE_M) / (1 + selves[:, SelfColumn.RANGE_GAIN])
    return distance_m


def object_answer(
    task: Task, graph: Graph, node: Object, positions_m: Samples, record: Record
) -> Answer:
    """An object with new samples, refreshed by the percept of `task`, and its link to the place of
    their mean.
    """
    mean, offsets_m = centred(positions_m)
    sd = spread(offsets_m)
    located = msgspec.structs.replace(
        node,
        x_m=float(mean[0]),
        y_m=float(mean[1]),
        x_sd_m=float(sd[0]),
        y_sd_m=float(sd[1]),
        offsets_m=Matrix.of(offsets_m, "<f2"),
    )
    return _kept_answer(task, graph, located, record)


def _kept_answer(task: Task, graph: Graph, node: Object, record: Record) -> Answer:
    """An object refreshed by the percept of `task`, its position as it is, and its link to the
    place there.
    """
    (percept,) = task.percepts
    seen = msgspec.structs.replace(
        node,
        activation=percept.activation,
        base_level=min(1.0, graph.base_level(node) + BASE_LEVEL_GAIN),
        cycle=task.cycle,
        width_m=percept.width_m,
        height_m=percept.height_m,
        sightings=record.sightings,
        misses=record.misses,
        last_seen_ns=task.stamp_ns,
    )
    cell_m = graph.cell_m(node.map)
    place = nearest_place(seen.x_m, seen.y_m, cell_m, node.map)
    link = Link(source=seen.id, target=place, kind=LinkKind.AT)
    return Answer([seen, link])


def _jitter_m(kept: Samples, config: Config) -> Samples:
    """The standard deviations of the noise that resampling adds to (n, 2) samples.

    Few samples represent all positions between them: of a ring or a ray, the next view must find
    some again.
    """
    _, offsets_m = centred(kept)
    sd_m = spread(offsets_m)
    gaps_m = GAP * sd_m / len(kept)
    jitter_m: Samples = np.maximum(config.landmark_jitter_m, gaps_m)
    return jitter_m


def _stays(agent: Self, landmark: Object) -> bool:
    if landmark.surveyed or agent.is_lost:
        return True

    return is_seen_from_here(landmark, agent.stationary_since_ns)


def _mahalanobis2(positions_m: Samples, selves: Samples, percept: Percept) -> Samples:
    """(n,): squared deviations of the percept from what each pair of landmark and self predicts."""
    mahalanobis2 = np.zeros(len(positions_m))
    east_m = positions_m[:, 0] - selves[:, SelfColumn.X_M]
    north_m = positions_m[:, 1] - selves[:, SelfColumn.Y_M]

    if has_bearing(percept):
        direction_rad = np.arctan2(north_m, east_m)
        bearing_rad = direction_rad - selves[:, SelfColumn.HEADING_RAD]
        residual_rad = wrap_angle(bearing_rad - percept.bearing_rad)
        mahalanobis2 += (residual_rad / percept.bearing_sd_rad) ** 2

    if has_range(percept):
        distance_m = np.hypot(east_m, north_m)
        range_m = distance_m * (1 + selves[:, SelfColumn.RANGE_GAIN])
        residual_m = range_m - percept.range_m
        mahalanobis2 += (residual_m / percept.range_sd_m) ** 2

    return mahalanobis2
