"""How alike what is seen and what is known look: by appearance, by name, and by size. Pure.

Each likeness is how much likelier two sights are of one object than of any two, as a ratio.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from cogmap.schemas.array import Matrix
from cogmap.schemas.nodes import Object
from cogmap.schemas.sensing import Appearance, Percept

P_NAME = 1 / 50
"""How likely any object has a certain name: perception was taught two dozen names of buildings, and
a language has some more."""

UNSEEN_SIDE = 0.2
"""How likely an object is seen from a side that it was not seen from: that looks like any other."""

MAX_LOG_ODDS = 5.0
"""A single look is never surer: the odds that a calibrated network reaches on towns kept apart."""

MAX_APPEARANCES = 8
"""A bound on what one object costs: four sides, in two lights each."""

SAME_COSINE = 0.9
"""Appearances with a higher cosine are the same one."""

SIZE_SD = 0.4
"""Standard deviation of the logarithm of a width that is seen, over sides, as between the sides of
the catalogue's buildings; and of the widths of all objects of a kind twice that."""


def likeness(percept: Percept, node: Object) -> float:
    """Return how much likelier a percept looks as it does if it is of an object than of any."""
    look = look_ratio(percept.appearance, node.appearances)
    if look is None:
        look = name_ratio(distribution(percept), node.names)
    if percept.whole:
        look *= size_ratio(percept.width_m, node.width_m)
    return look


def distribution(percept: Percept) -> dict[str, float]:
    """Return how likely the view alone makes each name of a percept; together 1 at most."""
    named = dict(percept.names)
    if percept.name:
        named[percept.name] = percept.evidence
    return named


def name_ratio(seen: Mapping[str, float], known: Mapping[str, float]) -> float:
    """Compare the probabilities of names in a view with the evidence for names over many; 1 if
    either has none.
    """
    total = sum(known.values())
    if not seen or not total:
        return 1.0

    ratio = max(0.0, 1 - sum(seen.values()))
    for name, probability in seen.items():
        # As if each object had been seen once more, with any name.
        known_share = (known.get(name, 0.0) + P_NAME) / (total + 1)
        ratio += probability * known_share / P_NAME
    return ratio


def look_ratio(seen: Appearance | None, known: Matrix | None) -> float | None:
    """Compare an appearance with those of an object, (n, d); None if either has none."""
    if seen is None or known is None:
        return None

    directions = np.asarray(known.numpy(), np.float32)
    direction = np.asarray(seen.direction.numpy(), np.float32)
    if directions.shape[1:] != direction.shape:
        return None
    cosine = float((directions @ direction).max())
    return odds(cosine, seen)


def odds(cosine: float, seen: Appearance) -> float:
    """Return the likeness of two sides whose directions have a cosine."""
    log_odds = min(seen.sharpness * (cosine - seen.even_cosine), MAX_LOG_ODDS)
    return (1 - UNSEEN_SIDE) * math.exp(log_odds) + UNSEEN_SIDE


def size_ratio(seen_m: float, known_m: float) -> float:
    """Compare two widths, 1 if either is unknown."""
    if not (seen_m > 0 and known_m > 0):
        return 1.0

    squared = (math.log(seen_m / known_m) / SIZE_SD) ** 2
    ratio = 2 * math.exp(-squared * 3 / 8)
    return max(ratio, UNSEEN_SIDE)


def is_new_side(seen: Appearance, known: Matrix | None) -> bool:
    """Decide whether an appearance differs from all that are known of an object, and is worth to be
    kept beside them.
    """
    if known is None:
        return True

    directions = np.asarray(known.numpy(), np.float32)
    cosines = directions @ np.asarray(seen.direction.numpy(), np.float32)
    return len(directions) < MAX_APPEARANCES and float(cosines.max()) < SAME_COSINE
