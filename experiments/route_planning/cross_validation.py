"""Assumptions of participants chosen on some problems, and measured on another: by leaving out one
problem at a time.

A candidate is compared with people by the median excess of its participants. The criterion, the
mean distance from people's median in widths of their interquartile range, was settled before any
candidate was measured by it.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cogmap.data.human_tours import HumanTours
from cogmap.data.tsplib import straight
from cogmap.errors import UsageError
from cogmap.experiments.route_planning.measure import above
from cogmap.experiments.route_planning.optimum import shortest_tour
from cogmap.experiments.route_planning.participants import (
    Assumptions,
    Revision,
    Start,
    tours_under,
)
from cogmap.geometry.arrays import Floats, Indices
from cogmap.parallel import Progress, parallel_map

# With one, no goals are reordered: activation alone decides, as in figure 5.
SPANS = ((3, 4, 5), (1,))
# Each cell divided in two by two: the pyramid of Graham, Joshi and Pizlo (2000).
FACTORS = (3, 2)
CANDIDATES = tuple(
    Assumptions(*chosen) for chosen in itertools.product(Start, Revision, SPANS, FACTORS)
)
# Nobody's quartiles are nearer than that: where most people find the shortest tour, they coincide.
MIN_RANGE = 0.001
MIN_PROBLEMS = 2
Metrics = dict[str, float]


class Compared(NamedTuple):
    """One problem: its name, people's excess (k,), and the median excess of each candidate's
    participants, (c,).
    """

    name: str
    people: Floats
    medians: Floats

    def is_within(self, candidate: int) -> bool:
        """Return whether a candidate's median lies within people's quartiles."""
        low, high = np.quantile(self.people, (0.25, 0.75)).tolist()
        median = float(self.medians[candidate])
        return bool(low <= median <= high)

    def distances(self) -> Floats:
        """Return how far each candidate's median is from people's, (c,), in widths of their
        interquartile range.
        """
        low, middle, high = np.quantile(self.people, (0.25, 0.5, 0.75)).tolist()
        width = max(high - low, MIN_RANGE)
        return np.asarray(np.abs(self.medians - middle) / width)


class Job(NamedTuple):
    """One candidate's participants on one problem."""

    problem: HumanTours
    shortest: Indices
    candidate: Assumptions
    participants: int
    seed: int


def measure(
    problems: Sequence[HumanTours],
    participants: int,
    seed: int,
    processes: int,
    progress: Progress,
) -> list[Compared]:
    """Plan every problem by the participants of every candidate."""
    shortest = parallel_map(_shortest, problems, processes)
    jobs = []
    for problem, tour in zip(problems, shortest, strict=True):
        for candidate in CANDIDATES:
            jobs.append(Job(problem, tour, candidate, participants, seed))

    medians = parallel_map(_median, jobs, processes, progress)
    found = []
    of_problem = np.reshape(medians, (len(problems), len(CANDIDATES)))
    for problem, tour, of_candidates in zip(problems, shortest, of_problem, strict=True):
        lengths = straight(problem.problem.positions)
        people = above(lengths, problem.tours, tour)
        found.append(Compared(problem.problem.name, people, of_candidates))

    return found


def metrics(problems: Sequence[Compared]) -> Metrics:
    """Return the share of problems left out on which the candidate that was chosen on the others
    agrees with people, and the share if it is chosen on all; and what was chosen.

    Raises UsageError if there are too few problems to leave one out.
    """
    if len(problems) < MIN_PROBLEMS:
        raise UsageError(
            f"assumptions are chosen on other problems than the one that is left out: give at "
            f"least {MIN_PROBLEMS} that people drew tours of"
        )

    in_sample = chosen(problems)
    folds = []
    for left_out in range(len(problems)):
        others = [*problems[:left_out], *problems[left_out + 1 :]]
        folds.append(chosen(others))

    is_within = []
    is_within_in_sample = []
    found: Metrics = {}
    for problem, candidate in zip(problems, folds, strict=True):
        name = problem.name.lower()
        is_within.append(problem.is_within(candidate))
        is_within_in_sample.append(problem.is_within(in_sample))
        found[f"{name}_left_out_above_optimum_median"] = float(problem.medians[candidate])
        found[f"{name}_left_out_within_iqr"] = float(problem.is_within(candidate))
        found |= described(f"{name}_left_out", CANDIDATES[candidate])

    commonest = Counter(folds).most_common(1)
    return {
        "within_iqr_share": float(np.mean(is_within)),
        "within_iqr_share_in_sample": float(np.mean(is_within_in_sample)),
        "candidates": float(len(CANDIDATES)),
        "folds_that_agree_share": commonest[0][1] / len(folds),
        **described("in_sample", CANDIDATES[in_sample]),
        **found,
    }


def chosen(problems: Sequence[Compared]) -> int:
    """Return the candidate whose medians are nearest to people's on the mean over `problems`."""
    distances = [problem.distances() for problem in problems]
    mean = np.mean(distances, axis=0)
    return int(mean.argmin())


def described(prefix: str, assumptions: Assumptions) -> Metrics:
    """Return assumptions as numbers, for a table of metrics."""
    return {
        f"{prefix}_begins_at_given": float(assumptions.start is Start.GIVEN),
        f"{prefix}_removes_crossings": float(assumptions.revision is Revision.CROSSINGS),
        f"{prefix}_straightens": float(assumptions.revision is Revision.STRAIGHTENED),
        f"{prefix}_span": float(np.mean(assumptions.spans)),
        f"{prefix}_factor": float(assumptions.factor),
    }


def _shortest(problem: HumanTours) -> Indices:
    return shortest_tour(straight(problem.problem.positions))


def _median(job: Job) -> float:
    """Return the median excess of a candidate's participants."""
    positions = job.problem.problem.positions
    lengths = straight(positions)
    first_visited = Counter(int(tour[0]) for tour in job.problem.tours)
    given, _ = first_visited.most_common(1)[0]

    tours = tours_under(
        job.candidate, lengths, positions, job.participants, seed=job.seed, given=given
    )
    excess = above(lengths, tours, job.shortest)
    return float(np.median(excess))
