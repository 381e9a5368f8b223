"""The joint association of all percepts of a view: which of them are of which objects, given that
all are seen from one pose, and no two are of one object.

After joint compatibility (Neira and Tardos 2001): each association that is followed has a belief of
the pose of its own, which every percept that it gives to an object makes surer. So an error of the
pose moves all percepts together, and what is told apart by one percept tells the others. The
belief begins as a mixture, for the pose may be surer than it is right.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.se2 import wrap_angle
from cogmap.schemas.sensing import Percept
from cogmap.services.workspace.association.beliefs import FARTHEST_M, Belief, Possible
from cogmap.services.workspace.association.crowding import (
    log_crowding,
    nearest_known_m2,
    nearest_seen_m2,
)

BEAM = 32
"""Associations that are followed at once; each percept has a few possible objects."""

NONE = -1
"""A percept that is of no object that is known."""

MISJUDGED = 0.02
"""How likely a percept is placed much worse than it states: a part is taken for the whole, or two
for one. Its errors are WIDER times as large then (three rendered towns of blocks: up to 80 m,
2.5 % of the errors along the line of sight and 2.9 % of those across are beyond three standard
deviations; chosen on three other towns)."""

WIDER = 3.0
DOUBTED = 2.0
"""A percept that deviates by so many standard deviations moves the belief half as much."""

MIN_DISTANCE_M = 0.1
"""Nothing is seen from nearer; directions stay defined."""


class Association(NamedTuple):
    """The likeliest object of each of k percepts, or NONE, (k,), how likely that is, (k,), which
    objects each may be of and how likely, and the logarithm of how likely all that is seen is.
    """

    objects: Indices
    probability: Floats
    shares: list[dict[int, float]]
    log_evidence: float


def associate(percepts: Sequence[Possible], belief: Belief) -> Association:
    """Find which object each percept is of, seen from a pose that is believed so."""
    chosen = np.zeros((len(belief.means), 0), np.int64)

    # The percepts that are told best come first: a wrong beginning is seen early.
    order = sorted(range(len(percepts)), key=lambda number: len(percepts[number].numbers))
    for place, number in enumerate(order):
        possible = percepts[number]
        others = [percepts[other].percept for other in order[:place]]
        seen_m2 = nearest_seen_m2(possible.percept, others)
        nearest_m2 = np.minimum(nearest_known_m2(belief, possible), seen_m2)
        log_none = possible.log_none + log_crowding(possible.percept, nearest_m2)
        stays = belief._replace(log_weights=belief.log_weights + log_none)

        # Each object with each association that has not given it to another percept.
        is_taken = (chosen == possible.numbers[:, None, None]).any(axis=2)
        which, rows = np.nonzero(~is_taken)
        sources = belief.sources[rows]
        after = seen(
            belief.take(rows),
            possible.percept,
            possible.places_m[sources, which],
            possible.own_m2[sources, which],
        )
        log_weights = after.log_weights + possible.log_likeness[which]

        log_weights = np.concatenate([stays.log_weights, log_weights])
        best = np.argsort(-log_weights, kind="stable")[:BEAM]
        belief = Belief(
            means=np.concatenate([stays.means, after.means])[best],
            covariances=np.concatenate([stays.covariances, after.covariances])[best],
            log_weights=log_weights[best],
            sources=np.concatenate([stays.sources, after.sources])[best],
        )
        every = np.arange(len(chosen))
        given = np.concatenate([np.full(len(chosen), NONE), possible.numbers[which]])
        before = np.concatenate([every, rows])
        chosen = np.column_stack([chosen[before[best]], given[best]])

    highest = belief.log_weights.max()
    shares = np.exp(belief.log_weights - highest)
    log_evidence = float(highest + np.log(shares.sum()))
    shares /= shares.sum()

    objects = np.full(len(percepts), NONE, np.int64)
    probability = np.ones(len(percepts))
    shares_of: list[dict[int, float]] = [{} for _ in percepts]
    for place, number in enumerate(order):
        values, which = np.unique(chosen[:, place], return_inverse=True)
        totals = np.bincount(which, shares)
        objects[number] = values[totals.argmax()]
        probability[number] = min(float(totals.max()), 1.0)
        shares_of[number] = dict(zip(values.tolist(), totals.tolist(), strict=True))

    return Association(objects, probability, shares_of, log_evidence)


def seen(belief: Belief, percept: Percept, places_m: Floats, own_m2: Floats) -> Belief:
    """Return each of the belief's h distributions once a percept is taken to be of an object, which
    stands at (h, 2) `places_m` with the covariances `own_m2`, (h, 2, 2). Its weights are multiplied
    by how much likelier the percept is then seen where it is than anything anywhere in view.
    """
    offset_m = places_m - belief.means[:, :2]
    distance_m = np.hypot(offset_m[:, 0], offset_m[:, 1]).clip(MIN_DISTANCE_M)
    towards = offset_m / distance_m[:, None]

    # Range and bearing, and how they change with the pose.
    direction_rad = np.arctan2(offset_m[:, 1], offset_m[:, 0])
    bearing_rad = direction_rad - belief.means[:, 2]
    innovation = np.column_stack(
        [percept.range_m - distance_m, wrap_angle(percept.bearing_rad - bearing_rad)]
    )
    change = np.zeros((len(offset_m), 2, 3))
    change[:, 0, :2] = -towards
    change[:, 1, 0] = towards[:, 1] / distance_m
    change[:, 1, 1] = -towards[:, 0] / distance_m
    change[:, 1, 2] = -1.0
    # What is uncertain of the object's place changes both as the pose does, the other way.
    noise = change[:, :, :2] @ own_m2 @ change[:, :, :2].mT
    noise += np.diag([percept.range_sd_m**2, percept.bearing_sd_rad**2])

    is_known: Booleans = np.array([percept.has_range, percept.has_bearing])
    if not is_known.any():
        return belief
    log_anywhere = float(np.log([FARTHEST_M, 2 * np.pi])[is_known].sum())
    dimensions = int(is_known.sum())
    innovation = innovation[:, is_known]
    change = change[:, is_known]
    noises = noise[:, is_known][:, :, is_known]

    spread = change @ belief.covariances @ change.mT + noises
    inverse = np.linalg.inv(spread)
    squared = np.einsum("hd,hde,he->h", innovation, inverse, innovation)
    _, log_determinant = np.linalg.slogdet(2 * np.pi * spread)

    well = np.log1p(-MISJUDGED) - squared / 2
    badly = np.log(MISJUDGED / WIDER**dimensions) - squared / (2 * WIDER**2)
    log_ratio = log_anywhere - log_determinant / 2 + np.logaddexp(well, badly)

    doubt = 1 + squared / DOUBTED**2
    doubted = spread + (doubt - 1)[:, None, None] * noises
    gain = belief.covariances @ change.mT @ np.linalg.inv(doubted)
    means = belief.means + np.einsum("hpd,hd->hp", gain, innovation)
    covariances = belief.covariances - gain @ change @ belief.covariances
    return belief._replace(
        means=means,
        covariances=(covariances + covariances.mT) / 2,
        log_weights=belief.log_weights + log_ratio,
    )
