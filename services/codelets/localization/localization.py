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
from cogmap.geometry.se2 import compose, mean_pose, relative
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
    Observations,
    PathSegment,
    Self,
    SelfColumn,
    nearest_place,
    object_id,
)
from cogmap.services.codelets.config import SECTION, Config
from cogmap.services.codelets.localization.measurement_model import (
    Sighting,
    compare,
    log_likelihood,
    sightings,
)
from cogmap.services.codelets.localization.misfits import (
    Estimate,
    inflated,
    misfit,
    relocalized,
    seen_of_late,
)
from cogmap.services.codelets.localization.motion_model import dead_reckon, move, with_gains
from cogmap.services.codelets.localization.novelty import novelty, variances_when_placed
from cogmap.services.codelets.localization.recovery import relocalize_heading
from cogmap.services.codelets.localization.sampling import (
    Samples,
    centred,
    generator,
    rejection_resample,
    resample,
    tempering_exponent,
)
from cogmap.services.codelets.mapping.path import odometry_of, variances_of

STAGES = 3
# Headings a radian apart, and those whose mean direction is no longer than that of a spread of one.
TURNED_RAD = 1.0
ALIKE = 0.6
FORGOTTEN_NS = 20_000_000_000


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """One task in each cycle."""
    percepts = context.percepts.objects
    about = [SELF_ID]
    for label in sorted(percept.label for percept in percepts):
        name = object_id(label)
        if name in graph.nodes:
            about.append(name)

    task = context.task(CODELET.name, about, percepts=percepts, with_motions=True)
    return [task]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Move the self node's samples, correct them by the landmarks in view, and link it to its new
    place.

    Where the paper restarts each step from the mean of the samples, these continue from the samples
    themselves: what the agent does not know of its heading now, it must still not know when it
    comes to matter.
    """
    agent = graph.agent
    if agent is None or task.motions is None:
        raise MessageError(f"task {task.task_id}: no self node, or no self-motion")

    rng = generator(task.task_id)
    motions = np.asarray(task.motions.numpy(), np.float64)
    before = with_gains(agent.samples.numpy(), config, rng)
    moved = move(resample(before, config.samples, 0.0, rng), motions, config, rng)

    stationary_since_ns = _stationary_since(agent, bool(motions[:, :2].any()))
    seen = sightings(task.percepts, graph, config.largest_landmark_sd_m, stationary_since_ns)
    moved_sd = motions[:, 3:5] * motions[:, 2:3]
    variances = variances_of(agent) + np.square(moved_sd).sum(axis=0)

    found = _past(agent, moved, task.stamp_ns)
    if seen is not None:
        since = variances - variances_when_placed(graph, seen)
        weights = novelty(moved, seen, since) / config.correlated_views
        found = _correct(found, seen, weights, config, rng)
        found = inflated(found, _path_sd_m(agent, variances), rng)

    gains = found.samples[:, POSE_COLUMNS:].mean(axis=0)
    odometry = dead_reckon(odometry_of(agent), motions, gains)
    if seen is not None and found.misfit_count:
        percepts = seen_of_late(found, task, graph, odometry)
        found = relocalized(found, percepts, graph, config, rng)

    if found.was_kidnapped:
        # Self-motion did not measure the kidnapping: the step there counts as one that was driven,
        # as certain as the pose that was found.
        step = relative(mean_pose(moved), mean_pose(found.samples))
        odometry = compose(odometry, step)
        _, offsets = centred(found.samples)
        found_variances = np.square(offsets).mean(axis=0)
        variances += found_variances[1:POSE_COLUMNS]

    estimate = _self_node(task, agent, found)
    after = msgspec.structs.replace(
        estimate,
        stationary_since_ns=stationary_since_ns,
        odometry_x_m=float(odometry[0]),
        odometry_y_m=float(odometry[1]),
        odometry_heading_rad=float(odometry[2]),
        odometry_variance_m2=float(variances[0]),
        odometry_variance_rad2=float(variances[1]),
    )
    return Answer(_operations(after, graph))


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


def _stationary_since(agent: Self, moves: bool) -> int:
    """The stamp at which the agent stopped; NEVER_NS where it moves."""
    if moves:
        return NEVER_NS

    if agent.stationary_since_ns == NEVER_NS:
        return max(0, agent.stamp_ns)
    return agent.stationary_since_ns


def _past(agent: Self, moved: Samples, stamp_ns: int) -> Estimate:
    """The estimate before; misfits are forgotten where nothing has followed for long."""
    forgotten_ns = agent.last_misfit_ns + FORGOTTEN_NS
    if stamp_ns > forgotten_ns:
        return Estimate(moved)

    return Estimate(
        moved,
        misfit_count=agent.misfit_count,
        first_misfit=agent.first_misfit,
        is_lost=agent.is_lost,
    )


def _correct(
    past: Estimate, seen: Sighting, weights: Samples, config: Config, rng: np.random.Generator
) -> Estimate:
    """Reject samples by what is in view, each landmark by its weight (k,).

    Where most of that fits no sample, all are kept, until the agent must be elsewhere. Where
    rejection would keep too few, it is done in stages: each by a part of the likelihood, the
    product of all parts being the whole, from samples as many as before, drawn around those that
    the stage before has kept. Stages cannot follow a heading that may be any: there the landmarks
    determine which headings are tried.
    """
    if _is_heading_unknown(past.samples[:, 2]) and seen.has_bearing.any():
        turned = relocalize_heading(past.samples, seen, config, rng)
        return Estimate(turned, 0.0)

    compared = compare(past.samples, seen)
    is_fitting = compared.squared < config.gate**2
    counts = seen.weights.astype(np.float32)
    fitting = (counts @ is_fitting).max()
    if 2 * fitting < counts.sum():
        return misfit(past, seen, config)

    samples = past.samples
    exponent_left = 1.0
    share = 1.0
    for stage in range(STAGES):
        scores = log_likelihood(compared.density, config.outlier_share, weights)
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


def _is_heading_unknown(headings_rad: Samples) -> bool:
    """Whether the headings (n,) are so far apart that nearly any may be the agent's."""
    if np.ptp(headings_rad) <= TURNED_RAD:
        return False

    mean_x = np.cos(headings_rad).mean()
    mean_y = np.sin(headings_rad).mean()
    mean_length = np.hypot(mean_x, mean_y)
    return bool(mean_length < ALIKE)


def _path_sd_m(agent: Self, variances: Samples) -> float:
    """The standard deviation of where path integration alone would have the agent, by its
    `variances` since the start, in m^2 and rad^2.
    """
    variance_m2, variance_rad2 = variances.tolist()
    away_m2 = agent.odometry_x_m**2 + agent.odometry_y_m**2
    return math.sqrt(variance_m2 + variance_rad2 * away_m2)


def _self_node(task: Task, agent: Self, found: Estimate) -> Self:
    """The self node after localization; what path integration measured is as before."""
    mean, offsets = centred(found.samples)
    variance = np.einsum("nd,nd->d", offsets, offsets) / len(offsets)
    sd = np.sqrt(variance)
    has_gains = bool(sd[POSE_COLUMNS:].any())
    samples = found.samples if has_gains else found.samples[:, :POSE_COLUMNS]

    is_misfit = found.misfit_count > agent.misfit_count
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
        misfit_count=found.misfit_count,
        first_misfit=found.first_misfit,
        is_lost=found.is_lost,
        last_misfit_ns=task.stamp_ns if is_misfit else agent.last_misfit_ns,
        last_fit_ns=agent.last_fit_ns if found.misfit_count else task.stamp_ns,
        not_elsewhere_ns=task.stamp_ns if found.is_not_elsewhere else agent.not_elsewhere_ns,
        found_ns=task.stamp_ns if found.was_kidnapped else agent.found_ns,
        speed_gain=float(mean[SelfColumn.SPEED_GAIN]),
        turn_gain=float(mean[SelfColumn.TURN_GAIN]),
        range_gain=float(mean[SelfColumn.RANGE_GAIN]),
        samples=Matrix.of(samples),
    )


def _operations(agent: Self, graph: Graph) -> list[Operation]:
    cell_m = graph.cell_m(agent.map)
    place = nearest_place(agent.x_m, agent.y_m, cell_m, agent.map)
    link = Link(source=agent.id, target=place, kind=LinkKind.AT)
    return [agent, link]
