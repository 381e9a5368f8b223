"""How pairs of cells fire together in rest, before a loop was closed and after."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices

BIN_S = 0.05
# Rest is shuffled in blocks, as what happens within a second is not independent.
BLOCK_S = 1.0
MAX_BLOCKS = 500
SHUFFLES = 500
MIN_REST_S = 30.0
MIN_SPIKES = 10
# Around candidate events, which fire cells together by themselves.
AROUND_EVENT_S = 0.1


class Cofiring(NamedTuple):
    """Of pairs of so many `cells`, `first` and `second` (m,): the change of the correlation of
    their spike counts in rest, (m,), and the same for shuffles of before and after, (s, m).
    """

    cells: int
    first: Indices
    second: Indices
    change: Floats
    shuffled: Floats


def rest_seconds(rests_s: Floats, closed_s: float) -> tuple[float, float]:
    """Return the seconds of rest before the loop was closed and after."""
    before_s = np.minimum(rests_s, closed_s)
    after_s = np.maximum(rests_s, closed_s)
    return float(np.diff(before_s, axis=1).sum()), float(np.diff(after_s, axis=1).sum())


def change_of(
    rests_s: Floats,
    events_s: Floats,
    closed_s: float,
    spikes_s: list[Floats],
    rng: np.random.Generator,
) -> Cofiring:
    """Compare how cells fire together in rest outside of the events (k, 2), before and after.

    Cells that fire fewer than MIN_SPIKES times there, on either side, are in no pair.
    """
    begins_s = _bins(rests_s, events_s)
    counts = np.zeros((len(begins_s), len(spikes_s)))
    for number, times_s in enumerate(spikes_s):
        ends = np.searchsorted(times_s, begins_s + BIN_S)
        counts[:, number] = ends - np.searchsorted(times_s, begins_s)

    is_after = begins_s >= closed_s
    fires = np.minimum(counts[is_after].sum(axis=0), counts[~is_after].sum(axis=0)) >= MIN_SPIKES
    chosen = np.flatnonzero(fires)
    rows, columns = np.triu_indices(len(chosen), k=1)
    first = chosen[rows]
    second = chosen[columns]

    # Sums a block are all that correlations need, so that shuffles of blocks are sums again.
    block = _blocks(is_after)
    blocks = int(block[-1]) + 1 if len(block) else 0
    starts = np.searchsorted(block, np.arange(blocks))
    products = [(part.T @ part)[first, second] for part in np.split(counts, starts[1:])]
    sums = _Sums(
        bins=np.add.reduceat(np.ones(len(block)), starts),
        one=np.add.reduceat(counts, starts, axis=0),
        squares=np.add.reduceat(counts**2, starts, axis=0),
        products=np.array(products),
    )
    after = is_after[starts]
    change = sums.change(after[None, :], first, second)[0]
    labels = rng.permuted(np.tile(after, (SHUFFLES, 1)), axis=1)
    return Cofiring(len(spikes_s), first, second, change, sums.change(labels, first, second))


class _Sums(NamedTuple):
    """Sums over the bins of each of b blocks: of bins (b,), of counts and their squares (b, c), and
    of the products of m pairs (b, m).
    """

    bins: Floats
    one: Floats
    squares: Floats
    products: Floats

    def change(self, is_after: Booleans, first: Indices, second: Indices) -> Floats:
        """Return correlations after less those before, (s, m), for (s, b) marks of the blocks."""
        after = self._correlations(is_after.astype(float), first, second)
        before = self._correlations((~is_after).astype(float), first, second)
        return np.asarray(after - before)

    def _correlations(self, weights: Floats, first: Indices, second: Indices) -> Floats:
        bins = (weights @ self.bins)[:, None]
        means = weights @ self.one / bins
        sds = np.sqrt(np.maximum(weights @ self.squares / bins - means**2, 1e-12))
        products = weights @ self.products / bins
        covariances = products - means[:, first] * means[:, second]
        return np.asarray(covariances / (sds[:, first] * sds[:, second]))


def _bins(rests_s: Floats, events_s: Floats) -> Floats:
    """Return the beginnings (n,) of the bins of rest that no event touches."""
    parts = [np.arange(begin, end - BIN_S, BIN_S) for begin, end in rests_s.tolist()]
    begins_s = np.concatenate(parts) if parts else np.zeros(0)
    begins_s.sort()
    is_free = np.ones(len(begins_s), bool)
    for begin_s, end_s in events_s.tolist():
        first = np.searchsorted(begins_s, begin_s - AROUND_EVENT_S - BIN_S)
        last = np.searchsorted(begins_s, end_s + AROUND_EVENT_S)
        is_free[first:last] = False
    return np.asarray(begins_s[is_free])


def _blocks(is_after: Booleans) -> Indices:
    """Number the blocks of bins, (n,) from 0 on: so many bins each that there are not too many, and
    none with bins of both before and after.
    """
    size = max(round(BLOCK_S / BIN_S), -(-len(is_after) // MAX_BLOCKS))
    before = int((~is_after).sum())
    number = np.arange(before) // size
    later = np.arange(len(is_after) - before) // size
    begin = int(number[-1]) + 1 if before else 0
    return np.concatenate([number, begin + later])
