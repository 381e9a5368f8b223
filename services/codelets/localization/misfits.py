"""Decides what follows from landmarks that do not fit: the agent is elsewhere, or they are.

One landmark that does not fit may be mistaken for another. The agent is lost if several do not fit;
if a single one does not, the agent is elsewhere only if all that was seen in the last seconds
fits another pose.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.schemas.codelets import Task
from cogmap.schemas.nodes import NEVER_NS, Self
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.localization.measurement_model import (
    Measurements,
    compare,
    cost_of_mistake,
    log_likelihood,
    measurements,
)
from cogmap.services.codelets.localization.recovery import (
    MIN_FITTING,
    best_of,
    relocalize,
    seen_before,
)
from cogmap.services.codelets.localization.sampling import inflate, position_sd_m, resample

# In each of a lost agent's first views its pose is so many times less certain: 11 times in all.
INFLATION = 1.5
MAX_INFLATIONS = 6
# Views in a row that fit no sample, of two landmarks or more, after which the agent relocalizes;
# fewer are enough if so many landmarks fit another pose: those do not agree by mistake
# (measured on MRCLAM's robots 1 and 2, with a minute of their logs cut out).
MISFITS_TO_RELOCALIZE = 8
EARLY_MISFITS = 3
EARLY_FITTING = 3
# After so many times as many it can be nowhere else on the map.
NOT_ELSEWHERE_AFTER = 2
# Measured on MRCLAM's robots, with a minute of their logs cut out 50 times.
RECENT_NS = 10_000_000_000


@dataclass(frozen=True)
class Estimate:
    """The samples that were kept, the share of those tried that they are, and for how many views
    nothing has fitted.

    `first_misfit` names the landmark that did not fit first; `is_lost` states that another did not
    fit since: then it is the agent that is elsewhere, not the landmark. `was_kidnapped` states
    that it was found where it cannot have moved to, `is_not_elsewhere` that it can be nowhere else
    on the map: what it sees is new.
    """

    samples: Floats
    share: float = 1.0
    misfit_count: int = 0
    first_misfit: str = ""
    is_lost: bool = False
    was_kidnapped: bool = False
    is_not_elsewhere: bool = False


def misfit(past: Estimate, seen: Measurements) -> Estimate:
    """Return the estimate after a view in which nothing fits. If several landmarks do not fit, the
    agent is elsewhere; one that does not fit for long stands elsewhere, or is another.
    """
    count = past.misfit_count + 1
    first = past.first_misfit or seen.labels[0]
    is_lost = past.is_lost or any(label != first for label in seen.labels)
    is_landmark = not is_lost and count >= MISFITS_TO_RELOCALIZE
    return Estimate(past.samples, 0.0, count, first, is_lost, is_not_elsewhere=is_landmark)


def inflated(found: Estimate, limit_m: float, rng: np.random.Generator) -> Estimate:
    """Make the pose of a lost agent less certain in its first views, unless its standard deviation
    has reached `limit_m`, that of path integration alone.
    """
    is_newly_lost = found.is_lost and found.misfit_count <= MAX_INFLATIONS
    if not is_newly_lost or position_sd_m(found.samples) >= limit_m:
        return found

    return replace(found, samples=inflate(found.samples, INFLATION, rng))


def recent_percepts(
    found: Estimate, task: Task, agent: Self, graph: Graph, odometry: Floats
) -> list[Percept]:
    """Return what is evidence of where the agent is, in the view of `task` and before, while
    something does not fit: everything since a landmark fitted, if the agent is lost, else the
    landmarks that were seen whole in the last seconds. Of one that is hidden in part another part
    is in view from the next place: several of those would fit a pose beside the true one better.

    By path integration alone, the agent is at `odometry` (3,).
    """
    since_ns = agent.misfits.last_fit_ns
    if not found.is_lost:
        # Path integration does not lead from what was seen before it was found to what it sees now.
        since_ns = max(task.stamp_ns - RECENT_NS, agent.misfits.found_ns)

    in_view = {percept.label for percept in task.percepts}
    before = seen_before(graph, odometry, since_ns)
    recent = [*task.percepts, *(percept for percept in before if percept.label not in in_view)]
    return [percept for percept in recent if percept.whole or found.is_lost]


def relocalized(
    found: Estimate,
    percepts: list[Percept],
    graph: Graph,
    rng: np.random.Generator,
) -> Estimate:
    """Return where the agent is by all `percepts`, after a view in which something does not fit."""
    seen = measurements(percepts, graph, NEVER_NS)
    if seen is None:
        return found
    if found.is_lost:
        return _where_most_fits(found, seen, rng)
    return _reconsidered(found, seen, rng)


def _where_most_fits(lost: Estimate, seen: Measurements, rng: np.random.Generator) -> Estimate:
    """Relocalize by all that is `seen`, once several landmarks have not fitted for long.

    The agent is where most of them fit one pose together; the more do, the sooner. If there is no
    such pose for a while, the agent is nowhere else. It relocalizes at once if its position is less
    certain than one look at a landmark makes it.
    """
    nearest_m = float(seen.range_m.min())
    is_unsure = position_sd_m(lost.samples) > nearest_m
    enough = MIN_FITTING if is_unsure else MISFITS_TO_RELOCALIZE
    if lost.misfit_count < min(enough, EARLY_MISFITS):
        return lost

    samples = relocalize(lost.samples, seen, rng)
    min_fitting = MIN_FITTING if lost.misfit_count >= enough else EARLY_FITTING
    best = best_of(samples, seen, is_unsure, min_fitting)
    if best is not None:
        found = resample(best, len(samples), 0.0, rng)
        return Estimate(found, 0.0, was_kidnapped=not is_unsure)

    if lost.misfit_count >= NOT_ELSEWHERE_AFTER * enough:
        return Estimate(lost.samples, 0.0, is_not_elsewhere=True)
    return lost


def _reconsidered(doubtful: Estimate, seen: Measurements, rng: np.random.Generator) -> Estimate:
    """Move the estimate to a pose, if there is one, that explains all that is `seen` so much better
    that the agent can be where it is believed only if more than one landmark is mistaken.

    Others may fit the believed pose nevertheless, as landmarks in a row do from several places.
    """
    if len(seen.labels) < EARLY_FITTING:
        return doubtful

    required = _best_log_likelihood(doubtful.samples, seen) + cost_of_mistake()
    if required >= 0:
        return doubtful

    samples = relocalize(doubtful.samples, seen, rng)
    best = best_of(samples, seen, False, EARLY_FITTING)
    if best is None or _best_log_likelihood(best, seen) <= required:
        return doubtful

    found = resample(best, len(samples), 0.0, rng)
    return Estimate(found, 0.0, was_kidnapped=True)


def _best_log_likelihood(samples: Floats, seen: Measurements) -> float:
    """Compute the logarithm of the likelihood of what is seen at the one of (n, 7) samples which
    explains it best, at most 0.
    """
    return float(log_likelihood(compare(samples, seen).density, seen.weights).max())
