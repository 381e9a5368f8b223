"""The landmark codelet: where the landmarks in view are (paper §5.4, eq. 4)."""

from __future__ import annotations

import math
from collections.abc import Mapping

import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import mean_pose, wrap_angle
from cogmap.graph.graph import Graph
from cogmap.graph.likeness import distribution
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
    Sighting,
    nearest_place,
    object_id,
)
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.config import SECTION, Config
from cogmap.services.codelets.localization import paper_rule
from cogmap.services.codelets.localization.information import INDEPENDENT_RAD, new_view_share
from cogmap.services.codelets.localization.measurement_model import (
    FARTHEST_M,
    GATE,
    LARGEST_SD_M,
    MAX_SD_SHARE,
    MIN_SIGHTINGS,
    is_seen_from_here,
)
from cogmap.services.codelets.localization.motion_model import with_gains
from cogmap.services.codelets.localization.sampling import (
    generator,
    rejection_mask,
    resample,
    spread,
)

# Few samples represent all positions between them, as far apart as three of their mean gaps.
GAP = 3.0
# The agent's own uncertainty counts for a landmark up to this share of LARGEST_SD_M.
LOCAL_SHARE = 0.5
# A sighting that deviates by this many standard deviations counts half as much as one that fits.
DOUBTED = 2.0
# Noise of the range places no landmark nearer, or behind the agent.
MIN_RANGE_M = 0.1
# A view of which less is new is as good as none; weights stay finite.
MIN_SHARE = 1e-6
# Successive misfits after which a landmark is placed anew.
MISSES = 8
# Names that an object may have, beside others that are less likely.
MAX_NAMES = 4
# An object that was seen twice is remembered for 40 s, about until it may be seen again:
# measured in an hour's drive through one town (benchmark `lifelong`).
CONFIRMED_BASE_LEVEL = 0.15


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """Return one task for all objects in view that the map has."""
    by_label = sorted(context.percepts.objects, key=lambda percept: percept.label)
    known = [percept for percept in by_label if object_id(percept.label) in graph.nodes]
    if not known:
        return []

    about = [SELF_ID, *(object_id(percept.label) for percept in known)]
    return [context.task(CODELET.name, about, percepts=known)]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Apply eq. 4 to each percept of `task` and its landmark: keep the samples that agree with what
    is seen now.

    A landmark that disagrees in MISSES views in a row, or in more than it ever agreed with, stands
    elsewhere: it starts anew from what is seen, once it is certain that the agent is not elsewhere.
    While the agent stands still and sees the same again, landmarks stay where they are; those that
    were surveyed always do. By the paper's own rule, and beside localization by spikes, every
    view counts, and none starts anew.
    """
    agent = graph.agent
    if agent is None:
        raise MessageError(f"task {task.task_id}: the graph has no self node")

    answer = Answer()
    for percept in task.percepts:
        landmark = graph.get(Object, object_id(percept.label))
        if landmark is None:
            raise MessageError(f"task {task.task_id}: the graph lacks {percept.label}")

        after = updated(landmark, percept, agent, task, config)
        answer.operations.extend(refreshed(landmark, after, percept, task, graph))

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


def updated(landmark: Object, percept: Percept, agent: Self, task: Task, config: Config) -> Object:
    """Keep the positions of a landmark that agree with the view of `task`, and count in how many
    views it agreed, or in how many in a row it did not.
    """
    if config.localization != "cogmap" and not landmark.surveyed:
        return _by_paper(landmark, percept, agent, task)

    is_same_view = is_seen_from_here(landmark, agent.stationary_since_ns)
    if landmark.surveyed or agent.misfits.is_lost or is_same_view:
        return landmark

    agent_m = np.array([agent.x_m, agent.y_m])
    share = 1.0
    if config.landmarks == "buildings":
        share = new_view_share(landmark, agent_m, INDEPENDENT_RAD)

    rng = generator(f"{task.task_id}/{percept.label}")
    before = landmark.positions_m()
    selves = nearby_selves(with_gains(agent.samples.numpy(), config, rng))
    selves = rng.permutation(resample(selves, len(before), 0.0, rng))
    mahalanobis2 = _mahalanobis2(before, selves, percept)
    if mahalanobis2.min() < GATE**2 and is_well_placed(landmark, percept):
        fitting = msgspec.structs.replace(landmark, sightings=landmark.sightings + 1, misses=0)
        return with_positions(fitting, moved_towards(before, selves, percept, share, config))

    if mahalanobis2.min() < GATE**2:
        log_likelihood = -mahalanobis2 / 2 * share
        kept = before[rejection_mask(log_likelihood, rng)]
        # Of a ring or a ray, the next view must find some between the samples that are kept.
        gaps_m = GAP * spread(kept, kept.mean(axis=0)) / len(kept)
        jitter_m = np.maximum(config.landmark_jitter_m, gaps_m)
        fitting = msgspec.structs.replace(landmark, sightings=landmark.sightings + 1, misses=0)
        return with_positions(fitting, resample(kept, len(before), jitter_m, rng))

    # That the agent is nowhere else must have been found before this view.
    fit = agent.misfits
    may_be_elsewhere = fit.count > 0 and not NEVER_NS < fit.not_elsewhere_ns < task.stamp_ns
    misses = landmark.misses + 1
    if may_be_elsewhere or misses < min(MISSES, landmark.sightings + 1):
        return msgspec.structs.replace(landmark, misses=misses)

    anew = msgspec.structs.replace(landmark, sightings=1, misses=0, created_ns=task.stamp_ns)
    return with_positions(anew, first_positions(selves, percept, rng))


def _by_paper(landmark: Object, percept: Percept, agent: Self, task: Task) -> Object:
    """Keep the positions by eq. 4 as it is printed, and count in how many views there were any, or
    in how many in a row there were none.
    """
    rng = generator(f"{task.task_id}/{percept.label}")
    selves = agent.samples.numpy()
    kept_m, share = paper_rule.landmark(landmark.positions_m(), selves, percept, rng)
    if not share:
        return msgspec.structs.replace(landmark, misses=landmark.misses + 1)

    fitting = msgspec.structs.replace(landmark, sightings=landmark.sightings + 1, misses=0)
    return with_positions(fitting, kept_m)


def is_well_placed(landmark: Object, percept: Percept) -> bool:
    """Decide whether a landmark's samples are a cloud, no ring or ray, and the percept would place
    it by itself.
    """
    if not percept.has_place:
        return False
    return math.hypot(landmark.x_sd_m, landmark.y_sd_m) < MAX_SD_SHARE * percept.range_m


def moved_towards(
    positions_m: Floats, selves: Floats, percept: Percept, share: float, config: Config
) -> Floats:
    """Move (n, 2) samples of a landmark's position towards where it is seen from (n, 7) samples of
    the self, and draw them together, as an ensemble Kalman filter does (Evensen 1994).

    Rejection keeps the best of the samples that there are: if the first sighting was from afar, all
    of them may be wrong by as much. A view counts by its new `share`, and the less, the
    worse it fits: it may be of another landmark, or of a part of this one.
    """
    mean_m = positions_m.mean(axis=0)
    offsets_m = positions_m - mean_m
    covariance = offsets_m.T @ offsets_m / len(offsets_m)
    covariance += config.landmark_jitter_m**2 * np.eye(2)

    here = mean_pose(selves)
    direction_rad = float(here[2]) + percept.bearing_rad
    range_m = percept.range_m / (1 + float(selves[:, SelfColumn.RANGE_GAIN].mean()))
    along = np.array([math.cos(direction_rad), math.sin(direction_rad)])
    across = np.array([-along[1], along[0]])
    seen_m = here[:2] + range_m * along

    across_sd_m = range_m * percept.bearing_sd_rad
    noise = percept.range_sd_m**2 * np.outer(along, along)
    noise += across_sd_m**2 * np.outer(across, across)

    innovation_m = seen_m - mean_m
    squared = innovation_m @ np.linalg.solve(covariance + noise, innovation_m)
    doubt = 1 + float(squared) / DOUBTED**2
    gain = covariance @ np.linalg.inv(covariance + doubt / max(share, MIN_SHARE) * noise)

    moved_m = mean_m + gain @ innovation_m
    after = (np.eye(2) - gain) @ covariance
    shrink = np.linalg.cholesky((after + after.T) / 2) @ np.linalg.inv(
        np.linalg.cholesky(covariance)
    )
    return np.asarray(moved_m + offsets_m @ shrink.T)


def nearby_selves(selves: Floats) -> Floats:
    """Return (n, 7) samples of the self for placing landmarks relative to it, which is known
    however lost the agent is.

    The paper's samples start from their mean at each step (§5.4), so that landmarks are as certain
    as the last step was. Here the self's samples keep all that is uncertain since the start; drawn
    together about their mean, they state the same.
    """
    mean = mean_pose(selves)
    sd = spread(selves[:, :POSE_COLUMNS], mean)

    position_sd_m = max(float(np.hypot(sd[0], sd[1])), 1e-9)
    share = min(1.0, LOCAL_SHARE * LARGEST_SD_M / position_sd_m)
    if share == 1.0:
        return selves

    offset = selves[:, :POSE_COLUMNS] - mean
    offset[:, 2] = wrap_angle(offset[:, 2])
    poses = mean + share * offset
    return np.hstack([poses, selves[:, POSE_COLUMNS:]])


def first_positions(selves: Floats, percept: Percept, rng: np.random.Generator) -> Floats:
    """Draw (n, 2) samples of where an object may be that is seen for the first time from (n, 7)
    samples of the self.

    Seen by range alone it is on a ring, by bearing alone on a ray as long as FARTHEST_M.
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
        distance_m = rng.uniform(0.0, FARTHEST_M, number)

    direction = np.column_stack([np.cos(direction_rad), np.sin(direction_rad)])
    positions_m: Floats = selves[:, :2] + distance_m[:, None] * direction
    return positions_m


def with_positions(node: Object, positions_m: Floats) -> Object:
    """Replace the samples of the object's position by others, (n, 2)."""
    mean = positions_m.mean(axis=0)
    sd = spread(positions_m, mean)
    return msgspec.structs.replace(
        node,
        x_m=float(mean[0]),
        y_m=float(mean[1]),
        x_sd_m=float(sd[0]),
        y_sd_m=float(sd[1]),
        offsets_m=Matrix.of(positions_m - mean, "<f2"),
    )


def refreshed(
    before: Object, after: Object, percept: Percept, task: Task, graph: Graph
) -> list[Operation]:
    """Refresh the object, which was as `before`, by the percept in the view of `task`, and link it
    to the place there.

    Being seen excites its activation. Consciousness teaches its base level, except that a second
    view confirms the first: until then a new object may be a mistake, and is forgotten as soon as
    it is neither in view nor conscious.
    """
    base_level = graph.base_level(before)
    is_confirmed = before.sightings < MIN_SIGHTINGS <= after.sightings
    if is_confirmed and base_level < CONFIRMED_BASE_LEVEL:
        base_level += CONFIRMED_BASE_LEVEL

    names = learned_names(before.names, percept)
    appearances = before.appearances
    if percept.appearance is not None:
        seen = np.asarray(percept.appearance.direction.numpy(), np.float32)[None]
        sides = seen if appearances is None else np.vstack([appearances.numpy(), seen])
        appearances = Matrix.of(sides, "<f2")

    node = msgspec.structs.replace(
        after,
        names=names,
        appearances=appearances,
        function=percept.function or before.function,
        activation=percept.activation,
        base_level=base_level,
        cycle=task.cycle,
        width_m=percept.width_m,
        height_m=percept.height_m,
        last_seen_ns=task.stamp_ns,
    )
    agent = graph.agent
    if agent is not None:
        node = msgspec.structs.replace(
            node,
            seen_from_m=(agent.x_m - node.x_m, agent.y_m - node.y_m),
            last_sighting=sighting_of(percept, agent),
        )

    place = nearest_place(node.x_m, node.y_m, graph.cell_m(node.map), node.map)
    return [node, Link(source=node.id, target=place, kind=LinkKind.AT)]


def sighting_of(percept: Percept, agent: Self) -> Sighting | None:
    """Return how something is seen now; None if its range or bearing is unknown."""
    if not percept.has_place:
        return None

    path = agent.odometry
    range_m = percept.range_m / (1 + agent.range_gain)
    direction_rad = path.heading_rad + percept.bearing_rad
    return Sighting(
        x_m=path.x_m + range_m * math.cos(direction_rad),
        y_m=path.y_m + range_m * math.sin(direction_rad),
        range_sd_m=percept.range_sd_m,
        bearing_sd_rad=percept.bearing_sd_rad,
        odometry=path,
    )


def learned_names(known: Mapping[str, float], percept: Percept) -> dict[str, float]:
    """Add the evidence of a percept for names to what is known of an object; what it has for no
    name counts under the empty name. Only the likeliest names are kept.
    """
    seen = distribution(percept)
    added = {**seen, "": max(0.0, 1.0 - sum(seen.values()))}
    total = {name: known.get(name, 0.0) + added.get(name, 0.0) for name in {**known, **added}}

    likeliest = sorted(total, key=lambda name: (-total[name], name))[:MAX_NAMES]
    return {name: total[name] for name in likeliest if total[name] > 0}


def _mahalanobis2(positions_m: Floats, selves: Floats, percept: Percept) -> Floats:
    """Compute (n,) squared deviations of the percept from what each landmark and self predict."""
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
