"""Problems, and how much longer than the shortest tour those of people, of the model and on a flat
map are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cogmap.data.human_tours import HumanTours
from cogmap.data.tsplib import straight
from cogmap.experiments.route_planning.optimum import shortest_tour
from cogmap.experiments.route_planning.participants import tours_of
from cogmap.geometry.arrays import Floats, Indices
from cogmap.parallel import Progress, parallel_map
from cogmap.services.codelets.planning.tours import route_length

# Of people's problems: medians over fewer participants differ from seed to seed.
PARTICIPANTS = 400
# Of problems drawn at random, DRAWN of each size.
DRAWN_PARTICIPANTS = 20
DRAWN = 5
SIZES = (*range(4, 10), *range(10, 121, 10))
# The same tour begun elsewhere adds up to another last digit.
_DIGITS = 9
# So many goals has the problem whose tours are drawn.
EXAMPLE_GOALS = 30


@dataclass(frozen=True, eq=False)
class Job:
    """A problem: (n, 2) positions, and the tours of its people, if any; how many simulated
    participants plan it.
    """

    name: str
    positions: Floats
    people: Sequence[Indices]
    participants: int
    seed: int


@dataclass(frozen=True, eq=False)
class Planned:
    """Of one problem: its shortest tour, and by what share longer those of people (k,), of the
    model's participants (p,) are: on a hierarchy of maps, as drawn and straightened, and on a flat
    map.

    `typical` and `typical_flat` are tours whose excess is the median.
    """

    name: str
    positions: Floats
    shortest: Indices
    people: Floats
    hierarchical: Floats
    straightened: Floats
    flat: Floats
    typical: Indices
    typical_flat: Indices

    @property
    def goals(self) -> int:
        """Return how many goals it has."""
        return len(self.positions)

    @property
    def people_quartiles(self) -> tuple[float, float]:
        """Return people's first and third quartiles."""
        quartiles = np.quantile(self.people, (0.25, 0.75))
        low, high = quartiles.tolist()
        return low, high

    @property
    def is_within_quartiles(self) -> bool:
        """Return whether the median of the model lies within the quartiles of people."""
        low, high = self.people_quartiles
        median = float(np.median(self.hierarchical))
        return low <= median <= high


def human_jobs(problems: Sequence[HumanTours], participants: int, seed: int) -> list[Job]:
    """Return the problems that people drew tours of."""
    return [
        Job(problem.name, problem.positions, tours, participants, seed)
        for problem, tours in problems
    ]


def drawn_jobs(sizes: Sequence[int], number: int, seed: int) -> list[Job]:
    """Return `number` problems of each size, their goals drawn uniformly from a square."""
    jobs = []

    for size in sizes:
        for problem in range(number):
            rng = np.random.default_rng([seed, size, problem])
            positions = rng.uniform(0.0, 1.0, (size, 2))
            jobs.append(Job(f"drawn {size} {problem}", positions, [], DRAWN_PARTICIPANTS, seed))

    return jobs


def measure(jobs: Sequence[Job], processes: int, progress: Progress) -> list[Planned]:
    """Plan every problem. They are in the order given, whatever the number of processes."""
    return parallel_map(planned, jobs, processes, progress)


def planned(job: Job) -> Planned:
    """Plan one problem, by straight distances."""
    lengths = straight(job.positions)
    shortest = shortest_tour(lengths)
    tours = tours_of(lengths, job.positions, job.participants, job.seed)
    hierarchical = above(lengths, tours.hierarchical, shortest)
    flat = above(lengths, tours.flat, shortest)

    return Planned(
        name=job.name,
        positions=job.positions,
        shortest=shortest,
        people=above(lengths, job.people, shortest),
        hierarchical=hierarchical,
        straightened=above(lengths, tours.straightened, shortest),
        flat=flat,
        typical=tours.hierarchical[_median_index(hierarchical)],
        typical_flat=tours.flat[_median_index(flat)],
    )


def above(lengths: Floats, tours: Sequence[Indices], shortest: Indices) -> Floats:
    """Return by what share of the shortest tour each of k is longer, (k,)."""
    least = route_length(lengths, shortest, closed=True)
    found = [route_length(lengths, tour, closed=True) for tour in tours]
    excess = np.array(found) / least - 1.0
    return np.round(excess, _DIGITS)


def _median_index(excess: Floats) -> int:
    order = np.argsort(excess, kind="stable")
    middle = (len(order) - 1) // 2
    return int(order[middle])
