"""How a route past several stops is refined, as people are argued to do: a few successive stops at
a time, and where the route crosses itself (van Rooij, Stege and Schactman 2003).

A route is (m,) stops, the first and the last fixed; lengths are (k, k) whole numbers, symmetric.
Each change makes the route shorter, so that refinement ends.
"""

from __future__ import annotations

import functools
import itertools

import numpy as np

from cogmap.geometry.arrays import Indices


def length_of(route: Indices, lengths: Indices) -> int:
    """Add up the legs from the first stop to the last."""
    legs = lengths[route[:-1], route[1:]]
    return int(legs.sum())


def reorder(route: Indices, lengths: Indices, span: int) -> Indices:
    """Reorder a route until no `span` successive stops have a better order between their
    neighbours.
    """
    size = min(span, len(route) - 2)
    if size < 2:
        return route

    orders = all_orders(size)
    better = route.copy()
    is_better = True
    while is_better:
        is_better = False
        for first in range(len(route) - size - 1):
            window = better[first : first + size + 2]
            between = lengths[np.ix_(window, window)]
            sums = between[orders[:, :-1], orders[:, 1:]].sum(axis=1)
            best = int(sums.argmin())
            # The first order is the present one.
            if sums[best] < sums[0]:
                better[first : first + size + 2] = window[orders[best]]
                is_better = True

    return better


@functools.cache
def all_orders(size: int) -> Indices:
    """Return every order (size!, size + 2) of `size` stops between two that stay; the present one
    comes first.
    """
    end = size + 1
    orders = []

    for inner in itertools.permutations(range(1, end)):
        orders.append((0, *inner, end))

    return np.array(orders, np.int64)


def straighten(route: Indices, lengths: Indices) -> Indices:
    """Straighten a route until no part of it is shorter in reverse; what saves most is reversed
    first.

    By straight distances, no two legs cross then (Flood 1956).
    """
    straight = route.copy()
    while True:
        # What is saved by reversing the part between two legs, the first of them earlier.
        froms = straight[:-1]
        tos = straight[1:]
        legs = lengths[froms, tos]
        crossed = lengths[np.ix_(froms, froms)] + lengths[np.ix_(tos, tos)]
        savings = np.triu(legs[:, None] + legs - crossed, 2)

        first, last = np.unravel_index(savings.argmax(), savings.shape)
        if savings[first, last] <= 0:
            return straight

        part = slice(first + 1, last + 1)
        straight[part] = straight[part][::-1].copy()
