"""What becomes of an agent that sees landmarks where they should not be: it is elsewhere, or they
are.

A landmark that does not fit may be mistaken for another. Several tell of the agent, and one does
where all that was seen of late fits another pose.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cogmap.graph.graph import Graph
from cogmap.schemas.codelets import Task
from cogmap.schemas.nodes import NEVER_NS
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.localization.measurement_model import (
    Sighting,
    compare,
    cost_of_mistake,
    log_likelihood,
    sightings,
)
from cogmap.services.codelets.localization.recovery import (
    SEVERAL,
    believed_of,
    relocalize,
    seen_before,
)
from cogmap.services.codelets.localization.sampling import Samples, inflate, position_sd_m, resample

INFLATION = 1.5
MAX_INFLATIONS = 6
PATIENCE = 2
# So many landmarks do not agree by mistake: so few views that fit nothing are enough then.
MANY = 3
EARLY_MISFITS = 3
LATELY_NS = 10_000_000_000


@dataclass(frozen=True)
class Estimate:
    """The samples that were kept, the share of those tried that they are, and for how many views
    nothing has fitted.

    `first_misfit` names the landmark that did not fit first; `is_lost` states whether another did
    not fit since: then it is the agent that is elsewhere, not the landmark. `was_kidnapped` states
    that it was found where it cannot have moved to, `is_not_elsewhere` that it can be nowhere else
    on the map: what it sees is new.
    """

    samples: Samples
    share: float = 1.0
    misfit_count: int = 0
    first_misfit: str = ""
    is_lost: bool = False
    was_kidnapped: bool = False
    is_not_elsewhere: bool = False


def misfit(past: Estimate, seen: Sighting, config: Config) -> Estimate:
    """Nothing fits. Where several landmarks do not, the agent is elsewhere; one that does not for
    long stands elsewhere, or is another.
    """
    count = past.misfit_count + 1
    first = past.first_misfit or seen.labels[0]
    has_other = any(label != first for label in seen.labels)
    is_lost = past.is_lost or has_other
    is_landmark = not is_lost and count >= config.misfits_to_relocalize
    return Estimate(past.samples, 0.0, count, first, is_lost, is_not_elsewhere=is_landmark)


def inflated(found: Estimate, limit_m: float, rng: np.random.Generator) -> Estimate:
    """In the first views of a lost agent its pose is less certain than it seemed, but no less than
    to `limit_m`, the standard deviation of path integration alone.
    """
    is_newly_lost = found.is_lost and found.misfit_count <= MAX_INFLATIONS
    if not is_newly_lost or position_sd_m(found.samples) >= limit_m:
        return found

    samples = inflate(found.samples, INFLATION, rng)
    return replace(found, samples=samples)


def seen_of_late(found: Estimate, task: Task, graph: Graph, odometry: Samples) -> list[Percept]:
    """What tells where the agent is, in the view of `task` and before, while something does not
    fit: all since a landmark fitted, where the agent is lost, else that of the last seconds.

    Path integration alone has the agent at `odometry` (3,).
    """
    agent = graph.agent
    if agent is None:
        return task.percepts
    if found.is_lost:
        return _all_seen(task.percepts, seen_before(graph, odometry, agent.last_fit_ns))

    # Path integration does not lead from what was seen before it was found to what is seen now.
    since_ns = max(task.stamp_ns - LATELY_NS, agent.found_ns)
    return _all_seen(task.percepts, seen_before(graph, odometry, since_ns))


def relocalized(
    found: Estimate,
    percepts: list[Percept],
    graph: Graph,
    config: Config,
    rng: np.random.Generator,
) -> Estimate:
    """Where the agent is by all `percepts`, after a view in which something does not fit."""
    if found.is_lost:
        return _where_most_fits(found, percepts, graph, config, rng)
    return _reconsidered(found, percepts, graph, config, rng)


def _all_seen(in_view: list[Percept], before: list[Percept]) -> list[Percept]:
    """The percepts in view, and those of landmarks that were seen before and are not in view."""
    labels = {percept.label for percept in in_view}

    percepts = list(in_view)
    for percept in before:
        if percept.label not in labels:
            percepts.append(percept)
    return percepts


def _where_most_fits(
    lost: Estimate,
    percepts: list[Percept],
    graph: Graph,
    config: Config,
    rng: np.random.Generator,
) -> Estimate:
    """Where several landmarks have not fitted for long, the agent is elsewhere: relocalize by all
    `percepts`.

    That is where most of them fit one pose, together, all the sooner where they are MANY; else,
    after a while, it is nowhere else. It is at once where its position is less certain than one
    look at a landmark makes it.
    """
    seen = sightings(percepts, graph, config.largest_landmark_sd_m, NEVER_NS)
    if seen is None:
        return lost

    nearest_m = float(seen.range_m.min())
    is_unsure = position_sd_m(lost.samples) > nearest_m
    enough = SEVERAL if is_unsure else config.misfits_to_relocalize
    if lost.misfit_count < min(enough, EARLY_MISFITS):
        return lost

    samples = relocalize(lost.samples, seen, config, rng)
    several = SEVERAL if lost.misfit_count >= enough else MANY
    believed = believed_of(samples, seen, is_unsure, several, config)
    if believed is not None:
        found = resample(believed, len(samples), 0.0, rng)
        return Estimate(found, 0.0, was_kidnapped=not is_unsure)

    if lost.misfit_count >= PATIENCE * enough:
        return Estimate(lost.samples, 0.0, is_not_elsewhere=True)
    return lost


def _reconsidered(
    doubtful: Estimate,
    percepts: list[Percept],
    graph: Graph,
    config: Config,
    rng: np.random.Generator,
) -> Estimate:
    """Where a landmark does not fit: the pose that explains all `percepts` so much better that more
    than one of them would have to be mistaken for the agent to be where it is believed.

    Others may fit there nevertheless, as landmarks in a row do from several places.
    """
    seen = sightings(percepts, graph, config.largest_landmark_sd_m, NEVER_NS)
    if seen is None or len(seen.labels) < MANY:
        return doubtful

    here = _best_log_likelihood(doubtful.samples, seen, config)
    required = here + cost_of_mistake(config.outlier_share)
    if required >= 0:
        return doubtful

    samples = relocalize(doubtful.samples, seen, config, rng)
    believed = believed_of(samples, seen, False, MANY, config)
    if believed is None or _best_log_likelihood(believed, seen, config) <= required:
        return doubtful

    found = resample(believed, len(samples), 0.0, rng)
    return Estimate(found, 0.0, was_kidnapped=True)


def _best_log_likelihood(samples: Samples, seen: Sighting, config: Config) -> float:
    """That of what is seen at the one of (n, 7) samples which explains it best, at most 0."""
    density = compare(samples, seen).density
    scores = log_likelihood(density, config.outlier_share, seen.weights)
    return float(scores.max())
