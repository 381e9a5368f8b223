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
    """From the first stop to the last."""
    legs = lengths[route[:-1], route[1:]]
    return int(legs.sum())


def reorder(route: Indices, lengths: Indices, span: int) -> Indices:
    """The route once no `span` successive stops have a better order between their neighbours."""
    size = min(span, len(route) - 2)
    if size < 2:
        return route

    orders = _orders(size)
    better = route.copy()
    is_better = True
    while is_better:
        is_better = False
        for first in range(len(route) - size - 1):
            window = better[first : first + size + 2]
            best = _best_order(window, lengths, orders)
            if best is not None:
                better[first : first + size + 2] = window[best]
                is_better = True

    return better


def _best_order(window: Indices, lengths: Indices, orders: Indices) -> Indices | None:
    """The shortest of `orders` of a window's stops, None where that is the present one, the first
    of `orders`.
    """
    between = lengths[np.ix_(window, window)]
    legs = between[orders[:, :-1], orders[:, 1:]]
    sums = legs.sum(axis=1)

    best = int(sums.argmin())
    if sums[best] == sums[0]:
        return None

    chosen: Indices = orders[best]
    return chosen


@functools.cache
def _orders(size: int) -> Indices:
    """(size!, size + 2): every order of `size` stops between two that stay; the present one comes
    first.
    """
    end = size + 1
    orders = []

    for inner in itertools.permutations(range(1, end)):
        orders.append((0, *inner, end))

    return np.array(orders, np.int64)


def straighten(route: Indices, lengths: Indices) -> Indices:
    """The route once no part of it is shorter in reverse; what saves most is reversed first.

    By straight distances, no two legs cross then (Flood 1956).
    """
    straight = route.copy()

    while True:
        savings = _savings(straight, lengths)
        first, last = np.unravel_index(savings.argmax(), savings.shape)
        if savings[first, last] <= 0:
            return straight

        part = slice(first + 1, last + 1)
        straight[part] = straight[part][::-1].copy()


def _savings(route: Indices, lengths: Indices) -> Indices:
    """(m - 1, m - 1): what is saved by reversing the part between two legs, the first leg earlier;
    elsewhere 0.
    """
    froms = route[:-1]
    tos = route[1:]
    legs = lengths[froms, tos]

    present = legs[:, None] + legs
    between_froms = lengths[np.ix_(froms, froms)]
    between_tos = lengths[np.ix_(tos, tos)]
    return np.triu(present - between_froms - between_tos, 2)
