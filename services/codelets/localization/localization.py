"""The localization codelet: where the agent is (paper §5.4, eq. 1-3).

Recursive Bayes by rejection sampling: samples move with the self-motion, and are kept with a
probability proportional to the likelihood of what is seen. Its cost grows with the landmarks in
view, not with the map.
"""

from __future__ import annotations

import math

import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose, mean_pose, relative
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.schemas.array import Matrix
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Link, Phase
from cogmap.schemas.nodes import (
    NEVER_NS,
    POSE_COLUMNS,
    SELF_ID,
    LinkKind,
    Misfits,
    Object,
    Observations,
    PathIntegration,
    PathSegment,
    Self,
    SelfColumn,
    nearest_place,
    object_id,
)
from cogmap.services.codelets.config import SECTION, Config
from cogmap.services.codelets.localization.information import (
    AROUND_RAD,
    new_share,
    new_view_share,
    variances_when_placed,
)
from cogmap.services.codelets.localization.measurement_model import (
    GATE,
    Measurements,
    compare,
    log_likelihood,
    measurements,
)
from cogmap.services.codelets.localization.misfits import (
    Estimate,
    inflated,
    misfit,
    recent_percepts,
    relocalized,
)
from cogmap.services.codelets.localization.motion_model import dead_reckon, move, with_gains
from cogmap.services.codelets.localization.recovery import relocalize_heading
from cogmap.services.codelets.localization.sampling import (
    centred,
    generator,
    rejection_resample,
    resample,
    tempering_exponent,
)
from cogmap.services.codelets.nodes import nodes_of

# Three stages reach a likelihood that keeps one sample in 64 of those that would be kept at once.
STAGES = 3
# Headings this far apart whose mean direction is shorter than ALIKE, that of a spread of one
# radian, may be any.
TURNED_RAD = 1.0
ALIKE = 0.6
# After so long without another misfit, those before say nothing of where the agent is now.
FORGOTTEN_NS = 20_000_000_000


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """Return one task in each cycle."""
    percepts = [*context.percepts.objects, *context.waiting]
    seen = [object_id(label) for label in sorted(percept.label for percept in percepts)]
    about = [SELF_ID, *(name for name in seen if name in graph.nodes)]
    return [context.task(CODELET.name, about, percepts=percepts, with_motions=True)]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Move the self node's samples, correct them by the landmarks in view, and link it to its new
    place.

    The paper restarts each step from the mean of the samples. These continue from the samples
    themselves: what the agent does not know of its heading now, it must still not know when it
    comes to matter.
    """
    agent = graph.agent
    if agent is None or task.motions is None:
        raise MessageError(f"task {task.task_id}: no self node, or no self-motion")

    rng = generator(task.task_id)
    motions = np.asarray(task.motions.numpy(), np.float64)
    if agent.stamp_ns > task.since_ns:
        # An answer that came late has moved the agent since this task was made.
        motions = _later(motions, (task.stamp_ns - agent.stamp_ns) * 1e-9)
    before = with_gains(agent.samples.numpy(), config, rng)
    moved = move(resample(before, config.samples, 0.0, rng), motions, config, rng)
    moved_sd = motions[:, 3:5] * motions[:, 2:3]
    variances = agent.odometry.variances() + np.square(moved_sd).sum(axis=0)

    stationary_since_ns = NEVER_NS
    if not motions[:, :2].any():
        stationary_since_ns = agent.stationary_since_ns
        if stationary_since_ns == NEVER_NS:
            stationary_since_ns = max(0, agent.stamp_ns)

    # Misfits are forgotten once none has followed for long.
    found = Estimate(moved)
    if task.stamp_ns <= agent.misfits.last_ns + FORGOTTEN_NS:
        before_it = agent.misfits
        found = Estimate(moved, 1.0, before_it.count, before_it.label, before_it.is_lost)

    seen = measurements(task.percepts, graph, config.largest_landmark_sd_m, stationary_since_ns)
    if seen is not None:
        since = variances - variances_when_placed(graph, seen)
        weights = new_share(moved, seen, since)
        if config.landmarks == "buildings":
            agent_m = moved[:, :2].mean(axis=0)
            landmarks = nodes_of(graph, Object, map(object_id, seen.labels))
            weights *= [new_view_share(each, agent_m, AROUND_RAD) for each in landmarks]
        found = correct(found, seen, weights, config, rng)
        away_m2 = agent.odometry.x_m**2 + agent.odometry.y_m**2
        path_m2 = float(variances[0]) + float(variances[1]) * away_m2
        found = inflated(found, math.sqrt(path_m2), rng)

    gains = found.samples[:, POSE_COLUMNS:].mean(axis=0)
    odometry = dead_reckon(agent.odometry.pose(), motions, gains)
    if seen is not None and found.misfit_count:
        percepts = recent_percepts(found, task, agent, graph, odometry)
        found = relocalized(found, percepts, graph, config, rng)

    if found.was_kidnapped:
        # Self-motion did not measure the kidnapping: the step there counts as one that was driven,
        # as certain as the pose that was found.
        odometry = compose(odometry, relative(mean_pose(moved), mean_pose(found.samples)))
        _, offsets = centred(found.samples)
        variances += np.square(offsets).mean(axis=0)[1:POSE_COLUMNS]

    after = msgspec.structs.replace(
        _self_node(task, agent, found),
        stationary_since_ns=stationary_since_ns,
        odometry=PathIntegration(
            x_m=float(odometry[0]),
            y_m=float(odometry[1]),
            heading_rad=float(odometry[2]),
            variance_m2=float(variances[0]),
            variance_rad2=float(variances[1]),
        ),
    )
    place = nearest_place(after.x_m, after.y_m, graph.cell_m(after.map), after.map)
    return Answer([after, Link(source=after.id, target=place, kind=LinkKind.AT)])


CODELET = Codelet(
    name="localization",
    phase=Phase.LOCALIZATION,
    due=due,
    run=run,
    reads=frozenset({Self, Object, PathSegment, Observations}),
    writes=frozenset({Self, LinkKind.AT}),
    config=Config,
    section=SECTION,
)


def correct(
    past: Estimate, seen: Measurements, weights: Floats, config: Config, rng: np.random.Generator
) -> Estimate:
    """Reject samples by what is in view, each landmark by its weight (k,).

    If most of that fits no sample, all are kept, until the agent must be elsewhere. If rejection
    would keep too few, it is done in stages: each by a part of the likelihood, the product of all
    parts being the whole, from samples as many as before, drawn around those that the stage before
    has kept. Stages cannot follow a heading that may be any: then the landmarks determine which
    headings are tried.
    """
    headings_rad = past.samples[:, 2]
    length = np.hypot(np.cos(headings_rad).mean(), np.sin(headings_rad).mean())
    is_heading_known = np.ptp(headings_rad) <= TURNED_RAD or length >= ALIKE
    if seen.has_bearing.any() and not is_heading_known:
        return Estimate(relocalize_heading(past.samples, seen, rng), 0.0)

    compared = compare(past.samples, seen)
    counts = seen.weights.astype(np.float32)
    fitting = (counts @ (compared.squared < GATE**2)).max()
    if 2 * fitting < counts.sum():
        return misfit(past, seen)

    samples = past.samples
    exponent_left = 1.0
    share = 1.0
    for stage in range(STAGES):
        scores = log_likelihood(compared.density, weights)
        exponent = exponent_left
        if stage < STAGES - 1:
            largest_step = tempering_exponent(scores, config.kept_samples / len(scores))
            exponent = min(exponent_left, largest_step)

        kept, kept_share = rejection_resample(samples, exponent * scores, config.kept_samples, rng)
        share *= kept_share
        exponent_left -= exponent
        if exponent_left <= 0:
            break

        samples = resample(kept, len(samples), 0.0, rng)
        compared = compare(samples, seen)

    return Estimate(kept, share)


def _later(motions: Floats, duration_s: float) -> Floats:
    """Return the rows of self-motion in the last `duration_s`, by their own durations."""
    durations_s = motions[:, 2]
    until_end_s = np.cumsum(durations_s[::-1])[::-1]
    middle_s = until_end_s - durations_s / 2
    later: Floats = motions[middle_s < duration_s]
    return later


def _self_node(task: Task, agent: Self, found: Estimate) -> Self:
    """Return the self node with the estimate after localization."""
    mean, offsets = centred(found.samples)
    sd = np.sqrt(np.einsum("nd,nd->d", offsets, offsets) / len(offsets))
    has_gains = bool(sd[POSE_COLUMNS:].any())
    samples = found.samples if has_gains else found.samples[:, :POSE_COLUMNS]

    past = agent.misfits
    is_misfit = found.misfit_count > past.count
    misfits = Misfits(
        count=found.misfit_count,
        label=found.first_misfit,
        is_lost=found.is_lost,
        last_ns=task.stamp_ns if is_misfit else past.last_ns,
        last_fit_ns=past.last_fit_ns if found.misfit_count else task.stamp_ns,
        not_elsewhere_ns=task.stamp_ns if found.is_not_elsewhere else past.not_elsewhere_ns,
        found_ns=task.stamp_ns if found.was_kidnapped else past.found_ns,
    )
    return msgspec.structs.replace(
        agent,
        activation=1.0,
        base_level=1.0,
        cycle=task.cycle,
        stamp_ns=task.stamp_ns,
        x_m=float(mean[0]),
        y_m=float(mean[1]),
        heading_rad=float(mean[2]),
        x_sd_m=float(sd[0]),
        y_sd_m=float(sd[1]),
        heading_sd_rad=float(sd[2]),
        kept_share=found.share,
        speed_gain=float(mean[SelfColumn.SPEED_GAIN]),
        turn_gain=float(mean[SelfColumn.TURN_GAIN]),
        range_gain=float(mean[SelfColumn.RANGE_GAIN]),
        misfits=misfits,
        samples=Matrix.of(samples),
    )
