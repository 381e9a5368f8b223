"""Place fields along a loop: which cells have one, and where it was at each pass."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from cogmap.experiments.predictions.loop import Loop, Movement, wrapped
from cogmap.geometry.arrays import Booleans, Floats, Indices

BINS = 100
SMOOTHING_BINS = 2.0
# A field lies within an eighth of the loop to either side of its peak, and so do its shifts.
WINDOW_SHARE = 1 / 8
WINDOW_BINS = 10
# Place cells: of cells that fire on the loop, those neither silent nor firing everywhere. Chosen on
# no recording, for none was at hand.
MIN_SPIKES = 20
MAX_MEAN_HZ = 7.0
MIN_PEAK_HZ = 2.0
MIN_INFORMATION_BITS = 0.25
MIN_PASS_SPIKES = 3


class Cell(NamedTuple):
    """A place cell: the number of its unit, its field's peak `peak_m` along the loop over the whole
    recording, and its passes: `crossed_s` (p,) when the animal crossed the peak, `centres_m` (p,)
    the field's centre at that pass relative to the peak; NaN if it fired too little.
    """

    unit: int
    peak_m: float
    crossed_s: Floats
    centres_m: Floats

    def centre_before_m(self, closed_s: float) -> float:
        """Return the mean centre of the passes before the loop was closed, NaN if there is none."""
        return _mean(self.centres_m[self.crossed_s < closed_s])

    def centre_after_m(self, closed_s: float) -> float:
        """Return the mean centre of the passes since the loop was closed, NaN if there is none."""
        return _mean(self.centres_m[self.crossed_s >= closed_s])


def place_cells(
    movement: Movement, along_m: Floats, loop: Loop, spikes_s: list[Floats]
) -> list[Cell]:
    """Return the cells of a recording that have a field on the loop; `along_m` (n,) is where on the
    loop the animal is at each sample of running.
    """
    is_on = np.isfinite(along_m)
    stamps_s = movement.stamps_s[is_on]
    dt_s = movement.dt_s[is_on]
    on_m = along_m[is_on]
    occupied_s = _smooth(_sums(on_m, dt_s, loop))

    cells = []
    for unit, times_s in enumerate(spikes_s):
        rows = _rows(times_s, stamps_s, dt_s)
        if len(rows) < MIN_SPIKES:
            continue

        counts = _sums(on_m[rows], np.ones(len(rows)), loop)
        rates_hz = _smooth(counts) / np.maximum(occupied_s, 1e-9)
        rates_hz[occupied_s < dt_s.min()] = 0.0
        share = occupied_s / occupied_s.sum()
        mean_hz = len(rows) / dt_s.sum()
        is_placed = rates_hz.max() >= MIN_PEAK_HZ and mean_hz <= MAX_MEAN_HZ
        if not is_placed or _information_bits(rates_hz, share) < MIN_INFORMATION_BITS:
            continue

        peak_m = (int(rates_hz.argmax()) + 0.5) * loop.length_m / BINS
        offset_m = wrapped(on_m - peak_m, loop.length_m)
        crossed_s, centres_m = _passes(stamps_s, dt_s, offset_m, rows, loop)
        cells.append(Cell(unit, peak_m, crossed_s, centres_m))
    return cells


def _sums(along_m: Floats, values: Floats, loop: Loop) -> Floats:
    """Sum values by the bin of the loop that they are in, (BINS,)."""
    numbers = (along_m / loop.length_m * BINS).astype(np.int64)
    return np.asarray(np.bincount(np.clip(numbers, 0, BINS - 1), values, BINS), np.float64)


def _smooth(values: Floats) -> Floats:
    return np.asarray(gaussian_filter1d(values, SMOOTHING_BINS, mode="wrap"))


def _rows(times_s: Floats, stamps_s: Floats, dt_s: Floats) -> Indices:
    """Return, for each spike in a sample of running on the loop, the sample, (k,)."""
    rows = np.searchsorted(stamps_s, times_s, side="right") - 1
    is_during = (rows >= 0) & (times_s - stamps_s[rows] < dt_s[rows] * (1 + 1e-6))
    return np.asarray(rows[is_during])


def _information_bits(rates_hz: Floats, share: Floats) -> float:
    """Return what a spike says of the place, in bits (Skaggs et al. 1993)."""
    mean_hz = float((rates_hz * share).sum())
    relative = rates_hz / mean_hz
    fires = relative > 0
    return float((share[fires] * relative[fires] * np.log2(relative[fires])).sum())


def _passes(
    stamps_s: Floats, dt_s: Floats, offset_m: Floats, spike_rows: Indices, loop: Loop
) -> tuple[Floats, Floats]:
    """Return when the animal crossed the peak of a field, and the field's centre at each pass: the
    mean offset, each part of the field weighted by the rate there.
    """
    half_m = WINDOW_SHARE * loop.length_m
    crossed_s = []
    centres_m = []
    for begin, end in _runs(np.abs(offset_m) < half_m):
        passed_m = offset_m[begin:end]
        if not (passed_m.min() < 0 < passed_m.max() and np.ptp(passed_m) > half_m):
            continue

        edges_m = np.linspace(-half_m, half_m, WINDOW_BINS + 1)
        occupied_s, _ = np.histogram(passed_m, edges_m, weights=dt_s[begin:end])
        fired = spike_rows[(spike_rows >= begin) & (spike_rows < end)]
        fired_m = offset_m[fired]
        number = np.clip(np.digitize(fired_m, edges_m) - 1, 0, WINDOW_BINS - 1)
        weight = 1 / np.maximum(occupied_s[number], 1e-9)
        centre_m = np.nan
        if len(fired) >= MIN_PASS_SPIKES:
            centre_m = float((weight * fired_m).sum() / weight.sum())
        crossed_s.append(float(stamps_s[begin + int(np.argmax(passed_m >= 0))]))
        centres_m.append(centre_m)
    return np.array(crossed_s), np.array(centres_m)


def _runs(marks: Booleans) -> list[tuple[int, int]]:
    """Return the beginning and end of each row of marked samples."""
    padded = np.concatenate([[False], marks, [False]])
    change = np.flatnonzero(np.diff(padded.astype(int)))
    return [(int(begin), int(end)) for begin, end in change.reshape(-1, 2)]


def _mean(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")
