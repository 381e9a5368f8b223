"""Assumptions of participants chosen on some problems, and measured on another: by leaving out one
problem at a time.

A candidate is compared with people by the median excess of its participants: by the mean distance
from people's median in widths of their interquartile range. That was settled before any candidate
was measured by it.

Few problems do not decide between candidates that are nearly as near to people, so that the nearest
one is another if a single problem is left out. Such a choice is made stable by bagging (Breiman
1996): problems are drawn again and again, and each candidate counts by how often it is the nearest.
The participants are then a mixture, each with the assumptions of one candidate.
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
# Of the problems that assumptions are chosen on.
RESAMPLES = 1000
Metrics = dict[str, float]


class Compared(NamedTuple):
    """One problem: its name, people's excess (k,), and that of the participants of each candidate,
    (c, p).
    """

    name: str
    people: Floats
    participants: Floats

    def is_within(self, median: float) -> bool:
        """Return whether a median lies within people's quartiles."""
        low, high = np.quantile(self.people, (0.25, 0.75)).tolist()
        return bool(low <= median <= high)

    def distances(self) -> Floats:
        """Return how far each candidate's median is from people's, (c,), in widths of their
        interquartile range.
        """
        low, middle, high = np.quantile(self.people, (0.25, 0.5, 0.75)).tolist()
        width = max(high - low, MIN_RANGE)
        medians = np.median(self.participants, axis=1)
        return np.asarray(np.abs(medians - middle) / width)

    def median_of(self, shares: Floats) -> float:
        """Return the median of participants of whom each candidate has its share (c,)."""
        excess = self.participants.ravel()
        _, number = self.participants.shape
        weights = np.repeat(shares, number)

        order = np.argsort(excess, kind="stable")
        below = np.cumsum(weights[order])
        middle = int(np.searchsorted(below, below[-1] / 2))
        return float(excess[order][middle])


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

    excess = parallel_map(_excess, jobs, processes, progress)
    found = []
    of_problem = np.reshape(excess, (len(problems), len(CANDIDATES), participants))
    for problem, tour, of_candidates in zip(problems, shortest, of_problem, strict=True):
        lengths = straight(problem.problem.positions)
        people = above(lengths, problem.tours, tour)
        found.append(Compared(problem.problem.name, people, of_candidates))

    return found


def metrics(problems: Sequence[Compared]) -> Metrics:
    """Return the share of problems left out on which participants agree with people whose
    assumptions were chosen on the others, and the share if they are chosen on all; and what was
    chosen. Beside it, the share if the nearest candidate alone is taken.

    Raises UsageError if there are too few problems to leave one out.
    """
    if len(problems) < MIN_PROBLEMS:
        raise UsageError(
            f"assumptions are chosen on other problems than the one that is left out: give at "
            f"least {MIN_PROBLEMS} that people drew tours of"
        )

    distances = np.array([problem.distances() for problem in problems])
    in_sample = shares_of(distances)
    is_within = []
    is_within_in_sample = []
    is_nearest_within = []
    folds = []
    found: Metrics = {}
    for left_out, problem in enumerate(problems):
        others = np.delete(distances, left_out, axis=0)
        nearest = int(others.mean(axis=0).argmin())
        folds.append(nearest)
        nearest_median = float(np.median(problem.participants[nearest]))
        is_nearest_within.append(problem.is_within(nearest_median))

        shares = shares_of(others)
        median = problem.median_of(shares)
        is_within.append(problem.is_within(median))
        is_within_in_sample.append(problem.is_within(problem.median_of(in_sample)))
        name = problem.name.lower()
        found[f"{name}_left_out_above_optimum_median"] = median
        found[f"{name}_left_out_within_iqr"] = float(is_within[-1])
        found |= described(f"{name}_left_out", shares)

    commonest = Counter(folds).most_common(1)
    return {
        "within_iqr_share": float(np.mean(is_within)),
        "within_iqr_share_in_sample": float(np.mean(is_within_in_sample)),
        "within_iqr_share_of_nearest": float(np.mean(is_nearest_within)),
        "candidates": float(len(CANDIDATES)),
        "folds_that_agree_share": commonest[0][1] / len(folds),
        **described("in_sample", in_sample),
        **found,
    }


def shares_of(distances: Floats) -> Floats:
    """Return in which share of samples of the problems, drawn with replacement, each candidate is
    the nearest on the mean, (c,), by (n, c) distances.
    """
    number, candidates = distances.shape
    rng = np.random.default_rng(number)
    drawn = rng.integers(number, size=(RESAMPLES, number))
    means = distances[drawn].mean(axis=1)
    wins = np.bincount(means.argmin(axis=1), minlength=candidates)
    return np.asarray(wins / RESAMPLES)


def described(prefix: str, shares: Floats) -> Metrics:
    """Return what is assumed on the mean over candidates, each by its share (c,), as numbers."""
    numbers = []
    for start, revision, spans, factor in CANDIDATES:
        is_given = float(start is Start.GIVEN)
        uncrosses = float(revision is Revision.CROSSINGS)
        straightens = float(revision is Revision.STRAIGHTENED)
        numbers.append((is_given, uncrosses, straightens, float(np.mean(spans)), float(factor)))

    names = ("begins_at_given", "removes_crossings", "straightens", "span", "factor")
    means = (shares @ np.array(numbers)).tolist()
    return {f"{prefix}_{name}": mean for name, mean in zip(names, means, strict=True)}


def _shortest(problem: HumanTours) -> Indices:
    return shortest_tour(straight(problem.problem.positions))


def _excess(job: Job) -> Floats:
    """Return the excess of a candidate's participants, (p,)."""
    positions = job.problem.problem.positions
    lengths = straight(positions)
    first_visited = Counter(int(tour[0]) for tour in job.problem.tours)
    given, _ = first_visited.most_common(1)[0]

    tours = tours_under(
        job.candidate, lengths, positions, job.participants, seed=job.seed, given=given
    )
    return above(lengths, tours, job.shortest)
