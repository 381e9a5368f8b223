"""Simulated participants: the model with the limits that people are known to have.

Each judges lengths with the error of the paper's observations (3 % of the distance, §5.4), and its
grids are turned and mirrored at random. What is assumed of them beside that is stated in
`Assumptions`.
"""

from __future__ import annotations

import enum
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from cogmap.experiments.route_planning.crossings import uncrossed
from cogmap.geometry.arrays import Floats, Indices
from cogmap.services.codelets.planning.tours import TourSettings, follow_activation, order

LENGTH_ERROR = 0.03


class Start(enum.Enum):
    """The goal at which a participant begins to plan."""

    # A closed tour is as long from wherever it is begun.
    ANYWHERE = "anywhere"
    # The one at which people had to begin to draw.
    GIVEN = "given"


class Revision(enum.Enum):
    """What a participant changes of a tour once it is planned."""

    # What is drawn city by city cannot be taken back.
    NONE = "none"
    # Legs that cross are seen at once (van Rooij, Stege and Schactman 2003).
    CROSSINGS = "crossings"
    # The whole tour, wherever a part is shorter in reverse, as the robot does.
    STRAIGHTENED = "straightened"


class Assumptions(NamedTuple):
    """What is assumed of participants: where they begin, what they revise, how many goals they keep
    in mind at a time, each one of `spans`, and by what `factor` their grids grow finer.

    By default they keep 4 +- 1 in mind (Cowan 2001), and a factor of 3 is that of Madl et al.
    (2013).
    """

    start: Start = Start.ANYWHERE
    revision: Revision = Revision.NONE
    spans: tuple[int, ...] = (3, 4, 5)
    factor: int = 3


DEFAULT = Assumptions()


class Tours(NamedTuple):
    """The order (n,) in which each participant visits the goals: planned on a hierarchy of maps,
    the same straightened in the end, and on a flat map.
    """

    hierarchical: list[Indices]
    straightened: list[Indices]
    flat: list[Indices]


class _Problem(NamedTuple):
    """A problem as one participant sees it: its `goals` (n,), beginning with the first, the lengths
    that it judges them apart, where they lie on its grids, and its span.
    """

    goals: Indices
    judged: Floats
    turned: Floats
    span: int


def tours_of(lengths: Floats, positions: Floats, number: int, seed: int) -> Tours:
    """Plan closed tours of `number` participants, by true (n, n) lengths and (n, 2) positions."""
    tours = Tours([], [], [])

    rngs = _generators(number, seed)
    for goals, judged, turned, span in _problems(lengths, positions, rngs, DEFAULT):
        settings = TourSettings(span=span, factor=DEFAULT.factor)
        hierarchical = order(judged, turned, settings._replace(straightens=False))
        tours.hierarchical.append(goals[hierarchical])
        tours.straightened.append(goals[order(judged, turned, settings)])
        tours.flat.append(goals[follow_activation(judged)])

    return tours


def tours_under(
    assumptions: Assumptions,
    lengths: Floats,
    positions: Floats,
    number: int,
    *,
    seed: int,
    given: int,
) -> list[Indices]:
    """Plan closed tours as `tours_of` does, by participants of whom that is assumed; `given` is the
    goal at which people had to begin.
    """
    tours = []
    rngs = _generators(number, seed)
    problems = _problems(lengths, positions, rngs, assumptions, given)

    for goals, judged, turned, span in problems:
        settings = TourSettings(
            span=span,
            factor=assumptions.factor,
            straightens=assumptions.revision is Revision.STRAIGHTENED,
        )
        tour = goals[order(judged, turned, settings)]
        if assumptions.revision is Revision.CROSSINGS:
            tour = uncrossed(tour, positions)
        tours.append(tour)

    return tours


def _problems(
    lengths: Floats,
    positions: Floats,
    rngs: Sequence[np.random.Generator],
    assumptions: Assumptions,
    given: int = 0,
) -> Iterator[_Problem]:
    """Yield the problem as each participant sees it, of whom each has a generator."""
    for rng in rngs:
        start = int(rng.integers(len(lengths)))
        if assumptions.start is Start.GIVEN:
            start = given
        goals = np.roll(np.arange(len(lengths)), -start)

        # Each length is judged with an error of its own, the same in both directions.
        true = lengths[np.ix_(goals, goals)]
        errors = np.triu(rng.normal(0.0, LENGTH_ERROR, true.shape), 1)
        judged = true * np.maximum(1.0 + (errors + errors.T), 0.0)
        turned = _turned(positions[goals], rng)
        yield _Problem(goals, judged, turned, span=int(rng.choice(assumptions.spans)))


def _generators(number: int, seed: int) -> list[np.random.Generator]:
    """Return a generator for each of `number` participants."""
    return [np.random.default_rng([seed, participant]) for participant in range(number)]


def _turned(positions: Floats, rng: np.random.Generator) -> Floats:
    """Turn (n, 2) positions by any angle, and mirror them or not."""
    angle_rad = rng.uniform(0.0, 2 * np.pi)
    side = rng.choice([-1.0, 1.0])
    cos = np.cos(angle_rad)
    sin = np.sin(angle_rad)

    along = [cos, sin]
    across = [-side * sin, side * cos]
    turned = positions @ np.column_stack([along, across])
    return np.asarray(turned)
