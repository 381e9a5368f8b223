"""Simulated participants: the model with the limits that people are known to have.

Each keeps three, four or five goals in mind at a time (4 +- 1 chunks: Cowan 2001) and judges
lengths with the error of the paper's observations (3 % of the distance, §5.4). Its grids are turned
and mirrored at random, and it begins to plan at any goal: a closed tour is as long from wherever it
is begun. What is drawn city by city cannot be taken back, so the tour is not straightened.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats, Indices
from cogmap.services.codelets.planning.tours import TourSettings, follow_activation, order

LENGTH_ERROR = 0.03
SPANS = (3, 4, 5)


class Tours(NamedTuple):
    """The order (n,) in which each participant visits the goals: planned on a hierarchy of maps,
    the same straightened in the end, and on a flat map.
    """

    hierarchical: list[Indices]
    straightened: list[Indices]
    flat: list[Indices]


def tours_of(lengths: Floats, positions: Floats, number: int, seed: int) -> Tours:
    """Plan closed tours of `number` participants, by true (n, n) lengths and (n, 2) positions."""
    tours = Tours([], [], [])

    for participant in range(number):
        rng = np.random.default_rng([seed, participant])
        start = int(rng.integers(len(lengths)))
        goals = np.roll(np.arange(len(lengths)), -start)

        # Each length is judged with an error of its own, the same in both directions.
        true = lengths[np.ix_(goals, goals)]
        errors = np.triu(rng.normal(0.0, LENGTH_ERROR, true.shape), 1)
        judged = true * np.maximum(1.0 + (errors + errors.T), 0.0)
        turned = _turned(positions[goals], rng)
        limits = TourSettings(span=int(rng.choice(SPANS)))
        hierarchical = order(judged, turned, limits._replace(straightens=False))
        tours.hierarchical.append(goals[hierarchical])
        tours.straightened.append(goals[order(judged, turned, limits)])
        tours.flat.append(goals[follow_activation(judged)])

    return tours


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
