"""Candidate replay events in rest, and whether each replays the loop, forward or in reverse."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.stats import rankdata

from cogmap.geometry.arrays import Booleans, Floats, Indices

# A burst: the rate of all place cells, smoothed, is so many standard deviations over its mean, for
# so long, and at least so many cells fire. The usual bounds (such as Diba and Buzsaki 2007).
BIN_S = 0.005
SMOOTHING_S = 0.015
BURST_SD = 3.0
DURATION_S = (0.05, 0.8)
MIN_CELLS = 5
SHUFFLES = 1000
ALPHA = 0.05


class Events(NamedTuple):
    """Candidate events that were tested, (k,) each: `start_s`; the rank correlation `rho` of the
    time at which cells fire with the distance of their fields behind the animal, above 0 in
    reverse; whether it is `significant`, two-sided, among shuffles of the cells; which cells took
    part, (k, c). `by_chance` (s,) is how many of all events would be significant and reverse in
    each of the shuffles.
    """

    start_s: Floats
    rho: Floats
    is_significant: Booleans
    takes_part: Booleans
    by_chance: Indices

    @property
    def is_reverse(self) -> Booleans:
        """Mark the events that replay the loop in reverse, (k,)."""
        return self.is_significant & (self.rho > 0)

    @property
    def is_forward(self) -> Booleans:
        """Mark the events that replay the loop forward, (k,)."""
        return self.is_significant & (self.rho < 0)


class Population(NamedTuple):
    """Cells whose fields have their peaks at `peaks_m` (c,) along a loop, and the times of their
    spikes.
    """

    peaks_m: Floats
    length_m: float
    spikes_s: list[Floats]


def bursts(rests_s: Floats, spikes_s: list[Floats]) -> Floats:
    """Return beginnings and ends (k, 2) of bursts of the population in rest."""
    times_s = np.sort(np.concatenate(spikes_s)) if spikes_s else np.zeros(0)
    rates = []
    starts_s = []
    for begin_s, end_s in rests_s.tolist():
        edges_s = np.arange(begin_s, end_s, BIN_S)
        if len(edges_s) < 2:
            continue
        counts = np.diff(np.searchsorted(times_s, edges_s)).astype(float)
        rates.append(gaussian_filter1d(counts, SMOOTHING_S / BIN_S))
        starts_s.append(begin_s)
    if not rates:
        return np.zeros((0, 2))

    whole = np.concatenate(rates)
    mean = float(whole.mean())
    threshold = mean + BURST_SD * float(whole.std())
    found = []
    for begin_s, rate in zip(starts_s, rates, strict=True):
        above = np.concatenate([[False], rate > mean, [False]])
        edges = np.flatnonzero(np.diff(above.astype(int))).reshape(-1, 2)
        for first, last in edges.tolist():
            if rate[first:last].max() > threshold:
                found.append((begin_s + first * BIN_S, begin_s + last * BIN_S))
    spans_s = np.array(found).reshape(-1, 2)
    lasts_s = np.diff(spans_s, axis=1)[:, 0]
    shortest_s, longest_s = DURATION_S
    return np.asarray(spans_s[(lasts_s >= shortest_s) & (lasts_s <= longest_s)])


def ordered(
    spans_s: Floats, animal_m: Floats, population: Population, rng: np.random.Generator
) -> Events:
    """Test candidate events (k, 2) for order along the loop; `animal_m` (k,) is where along it the
    animal is. Those with too few cells are left out.
    """
    starts_s = []
    rhos = []
    significant = []
    parts = []
    by_chance = np.zeros(SHUFFLES, np.int64)
    for (begin_s, end_s), at_m in zip(spans_s.tolist(), animal_m.tolist(), strict=True):
        fired_s = _mean_times(begin_s, end_s, population.spikes_s)
        fires = np.isfinite(fired_s)
        if fires.sum() < MIN_CELLS:
            continue

        behind_m = (at_m - population.peaks_m[fires]) % population.length_m
        times = _standard(rankdata(fired_s[fires]))
        places = _standard(rankdata(behind_m))
        rho = float(times @ places)
        shuffled = rng.permuted(np.tile(places, (SHUFFLES, 1)), axis=1) @ times
        limit = np.quantile(np.abs(shuffled), 1 - ALPHA)
        by_chance += (shuffled > 0) & (np.abs(shuffled) > limit)
        starts_s.append(begin_s)
        rhos.append(rho)
        significant.append(abs(rho) > limit)
        parts.append(fires)

    return Events(
        start_s=np.array(starts_s),
        rho=np.array(rhos),
        is_significant=np.array(significant, bool),
        takes_part=np.array(parts, bool).reshape(-1, len(population.peaks_m)),
        by_chance=by_chance,
    )


def _mean_times(begin_s: float, end_s: float, spikes_s: list[Floats]) -> Floats:
    """Return the mean time at which each cell fires in an event, (c,); NaN if it does not."""
    times_s = np.full(len(spikes_s), np.nan)
    for number, spikes in enumerate(spikes_s):
        first, last = np.searchsorted(spikes, (begin_s, end_s))
        if last > first:
            times_s[number] = spikes[first:last].mean()
    return times_s


def _standard(ranks: Floats) -> Floats:
    """Return ranks of mean 0 whose squares add up to 1: the product of two is their correlation."""
    centred = ranks - ranks.mean()
    return np.asarray(centred / max(float(np.sqrt((centred**2).sum())), 1e-12))
