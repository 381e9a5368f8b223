"""Localization in stages, by what is new in each view, of an agent that may be lost: beyond the
paper, whose own rule is `paper_rule`.

The paper restarts each step from the mean of the samples. These continue from the samples
themselves: what the agent does not know of its heading now, it must still not know when it comes to
matter.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose, mean_pose, relative
from cogmap.graph.graph import Graph
from cogmap.schemas.codelets import Task
from cogmap.schemas.nodes import POSE_COLUMNS, Object, Self, object_id
from cogmap.services.codelets.config import Config
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


class Step(NamedTuple):
    """What is localized by: the self node before, the (m, 5) motions since, and since when it is
    stationary after them. `variances` (2,) are path integration's after the motions, in m^2 and
    rad^2.
    """

    task: Task
    graph: Graph
    agent: Self
    motions: Floats
    variances: Floats
    stationary_since_ns: int


class Localized(NamedTuple):
    """The estimate after a step, and the pose (3,) and variances (2,) of path integration alone."""

    found: Estimate
    odometry: Floats
    variances: Floats


def localized(step: Step, config: Config, rng: np.random.Generator) -> Localized:
    """Move the samples, and correct them by the landmarks in view."""
    task, graph, agent, motions, variances, stationary_since_ns = step
    before = with_gains(agent.samples.numpy(), config, rng)
    moved = move(resample(before, config.samples, 0.0, rng), motions, config, rng)

    # Misfits are forgotten once none has followed for long.
    found = Estimate(moved)
    if task.stamp_ns <= agent.misfits.last_ns + FORGOTTEN_NS:
        before_it = agent.misfits
        found = Estimate(moved, 1.0, before_it.count, before_it.label, before_it.is_lost)

    seen = measurements(task.percepts, graph, stationary_since_ns)
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
        found = relocalized(found, percepts, graph, rng)

    if found.was_kidnapped:
        # Self-motion did not measure the kidnapping: the step there counts as one that was driven,
        # as certain as the pose that was found.
        odometry = compose(odometry, relative(mean_pose(moved), mean_pose(found.samples)))
        _, offsets = centred(found.samples)
        variances = variances + np.square(offsets).mean(axis=0)[1:POSE_COLUMNS]

    return Localized(found, odometry, variances)


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
