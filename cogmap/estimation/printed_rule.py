"""Loops closed by eq. 9 of Madl et al. (2016) as it is printed: positions only, one loop after the
other.

A loop from a to b shifts the position x_j by alpha A d p_j, with d = x_a - x_b - c what is left of
its discrepancy, and p_j = (min(j, b) - a - 1) / (b - a - 1): nothing up to a + 1, all of it from b
on. The positions after b are those that the agent has reached since: they keep their distance from
b. A is the loop's precision over that of path integration, "S_i / S_P" (S are covariances in eq. 6,
so A is the mean variance of the loop's steps over that of its closure).

`reverse_replay` is near it: it begins at path integration alone, weighs each step by its own
covariance, and goes on to the least of eq. 7 over all loops together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices

# The paper has neither number. Each replay halves what is left of the most precise loop, so that
# ten leave a thousandth. Chosen by that sum, on no data.
LEARNING_RATE = 0.5
REPLAYS = 10


class Loops(NamedTuple):
    """m loops: position `b` (m,) was found to be `offset_m` (m, 2) short of position `a` (m,),
    which is c = x_a - x_b; that is known to `variance_m2` (m,).
    """

    a: Indices
    b: Indices
    offset_m: Floats
    variance_m2: Floats

    def select(self, chosen: Booleans) -> Loops:
        """Return the loops of a mask (m,)."""
        return Loops(
            a=self.a[chosen],
            b=self.b[chosen],
            offset_m=self.offset_m[chosen],
            variance_m2=self.variance_m2[chosen],
        )


def shares(count: int, a: int, b: int) -> Floats:
    """Return p_j of each of `count` positions for the loop from a to b, (count,)."""
    along = np.minimum(np.arange(count), b) - a - 1
    return np.asarray(along.clip(0) / (b - a - 1))


def precisions(loops: Loops, step_m2: Floats) -> Floats:
    """Return A of each loop, (m,), by (n - 1,) variances of the steps between n positions."""
    summed_m2 = np.concatenate([[0.0], np.cumsum(step_m2)])
    mean_m2 = (summed_m2[loops.b] - summed_m2[loops.a]) / (loops.b - loops.a)
    precision: Floats = mean_m2 / loops.variance_m2
    return precision


def rates(loops: Loops, step_m2: Floats) -> Floats:
    """Return alpha A of each loop, (m,): alpha is LEARNING_RATE over the largest A. With more, a
    loop would be closed beyond its end.
    """
    weights = precisions(loops, step_m2)
    rate: Floats = LEARNING_RATE * weights / weights.max()
    return rate


def replayed(positions_m: Floats, loops: Loops, alpha_a: Floats) -> Floats:
    """Replay (n, 2) positions once, backwards from the loop that closed last, by alpha A of each
    loop, (m,).
    """
    after_m = positions_m.copy()
    for number in np.argsort(-loops.b, kind="stable").tolist():
        a = int(loops.a[number])
        b = int(loops.b[number])
        left_m = after_m[a] - after_m[b] - loops.offset_m[number]
        after_m += alpha_a[number] * np.outer(shares(len(after_m), a, b), left_m)

    return after_m


def close_loops(positions_m: Floats, loops: Loops, step_m2: Floats) -> tuple[Floats, int]:
    """Replay (n, 2) positions REPLAYS times; return them, and that number. Loops of fewer than two
    steps are ignored.
    """
    chosen = loops.select(loops.b - loops.a > 1)
    if not len(chosen.a):
        return positions_m, 0

    alpha_a = rates(chosen, step_m2)
    after_m = positions_m
    for _ in range(REPLAYS):
        after_m = replayed(after_m, chosen, alpha_a)

    return after_m, REPLAYS
