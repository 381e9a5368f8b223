"""The three predictions in a recording of place cells, each with its number and its chance."""

from __future__ import annotations

import enum
from typing import NamedTuple

import numpy as np
from scipy.stats import rankdata, spearmanr, wilcoxon

from cogmap.data.nwb import Recording
from cogmap.errors import UsageError
from cogmap.experiments.predictions import cofiring, events
from cogmap.experiments.predictions.fields import WINDOW_SHARE, Cell, place_cells
from cogmap.experiments.predictions.loop import (
    Loop,
    Movement,
    along,
    first_loop,
    movement_of,
    wrapped,
)
from cogmap.geometry.arrays import Booleans, Floats, Indices

MIN_CELLS = 8
MIN_EVENTS = 8
MIN_PAIRS = 20
DRAWS = 1000
ALPHA = 0.05
INTERVAL = (2.5, 97.5)


class Verdict(enum.StrEnum):
    """What a recording shows of a prediction. UNDECIDED: it has too little to tell."""

    FOUND = "found"
    NOT_FOUND = "not found"
    UNDECIDED = "undecided"


class Estimate(NamedTuple):
    """A value, the 95 % interval of its bootstrap, and the chance of it without the effect."""

    value: float
    low: float
    high: float
    p: float


class Replays(NamedTuple):
    """Prediction 1, since the loop was closed: of each cell, (c,), in how many reverse replays it
    took part, and how often the animal came back to its field. `forward` and `reverse` are events,
    `by_chance` as many would be reverse in shuffles; `ratio` is without those, over the cells whose
    field the animal came back to.
    """

    tested: int
    forward: int
    reverse: int
    by_chance: float
    replays: Indices
    revisits: Indices
    ratio: Estimate | None
    verdict: Verdict


class Shifts(NamedTuple):
    """Prediction 2, of c cells: how far back along the loop from its closure the field is
    `from_closure_m`, and by how much it shifted along the loop since, `shift_m`; `usual_m` is by
    how much it differs from one later pass to the others. `excess` is the mean of |shift| - usual;
    `decline` the rank correlation of that with the distance from the closure.
    """

    from_closure_m: Floats
    shift_m: Floats
    usual_m: Floats
    excess: Estimate | None
    decline: Estimate | None
    verdict: Verdict


class Synapses(NamedTuple):
    """Prediction 3, of m pairs of cells: the distance of their fields before, `apart_m`, by how
    much they came nearer, and the change of how they fire together in rest; `close` marks those
    within an eighth of the loop. `slope` is that change for a metre nearer, over close pairs,
    `correlation` that of their ranks; `decay` the rank correlation of its size, over what it is in
    shuffles of before and after, with the distance; it has no interval.
    """

    apart_m: Floats
    nearer_m: Floats
    change: Floats
    close: Booleans
    slope: Estimate | None
    correlation: float | None
    decay: Estimate | None
    verdict: Verdict


class Found(NamedTuple):
    """A recording's loop, place cells and predictions; `candidates` are events before any test."""

    recording: Recording
    loop: Loop
    cells: list[Cell]
    candidates: int
    rest_before_s: float
    rest_after_s: float
    replays: Replays
    shifts: Shifts
    synapses: Synapses


class Session(NamedTuple):
    """What the predictions are looked for in: the `movement`, where on the `loop` the animal is at
    each sample of it, `on_m`; place cells and their spikes; rest, and candidate events.
    """

    movement: Movement
    on_m: Floats
    loop: Loop
    cells: list[Cell]
    spikes_s: list[Floats]
    rests_s: Floats
    candidates_s: Floats


def measure(recording: Recording, seed: int) -> Found:
    """Look for the three predictions. Raises UsageError if the animal closed no loop, or too few
    cells have a field on it.
    """
    if len(recording.stamps_s) < 2:
        raise UsageError(f"{recording.name} has no positions: record where the animal is")

    movement = movement_of(recording.stamps_s, recording.positions_m)
    loop = first_loop(movement)
    if loop is None:
        raise UsageError(
            f"the animal in {recording.name} never comes back to a place in the direction in which "
            "it ran there before: give a recording in which it runs a loop more than once"
        )

    on_m = along(loop, movement)
    cells = place_cells(movement, on_m, loop, recording.spikes_s)
    if len(cells) < MIN_CELLS:
        raise UsageError(
            f"{len(cells)} of {len(recording.spikes_s)} units in {recording.name} have a place "
            f"field on its first loop, which is {loop.length_m:.1f} m long: it takes {MIN_CELLS}"
        )

    rng = np.random.default_rng(seed)
    rests_s = movement.rests_s if recording.rests_s is None else recording.rests_s
    spikes_s = [recording.spikes_s[cell.unit] for cell in cells]
    candidates_s = recording.events_s
    if candidates_s is None:
        candidates_s = events.bursts(rests_s, spikes_s)
    session = Session(movement, on_m, loop, cells, spikes_s, rests_s, candidates_s)
    before_s, after_s = cofiring.rest_seconds(rests_s, loop.closed_s)
    return Found(
        recording=recording,
        loop=loop,
        cells=cells,
        candidates=len(candidates_s),
        rest_before_s=before_s,
        rest_after_s=after_s,
        replays=_replays(session, rng),
        shifts=_shifts(cells, loop, rng),
        synapses=_synapses(session, rng),
    )


def _replays(session: Session, rng: np.random.Generator) -> Replays:
    """Count reverse replays since the loop was closed beside returns to the fields."""
    cells = session.cells
    loop = session.loop
    later_s = session.candidates_s[session.candidates_s[:, 0] >= loop.closed_s]
    is_on = np.isfinite(session.on_m)
    last = np.searchsorted(session.movement.stamps_s[is_on], later_s[:, 0]) - 1
    peaks_m = np.array([cell.peak_m for cell in cells])
    population = events.Population(peaks_m, loop.length_m, session.spikes_s)
    found = events.ordered(later_s, session.on_m[is_on][last], population, rng)

    tested = len(found.rho)
    reverse = int(found.is_reverse.sum())
    chance = float(found.by_chance.mean())
    takes_part = found.takes_part & found.is_reverse[:, None]
    returns = np.array([int((cell.crossed_s >= loop.closed_s).sum()) for cell in cells])
    is_revisited = returns > 0
    ratio: Estimate | None = None
    verdict = Verdict.UNDECIDED
    if tested >= MIN_EVENTS and is_revisited.sum() >= MIN_CELLS:
        drawn = rng.integers(0, tested, (DRAWS, tested))
        counts = found.is_reverse[drawn].sum(axis=1)
        parts = takes_part[:, is_revisited].sum(axis=1)
        draws = _true_share(counts, chance) * parts[drawn].sum(axis=1) / returns.sum()
        value = float(_true_share(np.array([reverse]), chance)[0] * parts.sum())
        low, high = np.percentile(draws, INTERVAL).tolist()
        p = _p(int((found.by_chance >= reverse).sum()), events.SHUFFLES)
        ratio = Estimate(value / float(returns.sum()), low, high, p)
        verdict = _verdict(p < ALPHA and low > 1)
    forward = int(found.is_forward.sum())
    counted = takes_part.sum(axis=0)
    return Replays(tested, forward, reverse, chance, counted, returns, ratio, verdict)


def _true_share(counts: Indices, chance: float) -> Floats:
    """Return the share of events that are more than by chance."""
    return np.asarray(np.maximum(0.0, 1 - chance / np.maximum(counts, 1)))


def _shifts(cells: list[Cell], loop: Loop, rng: np.random.Generator) -> Shifts:
    """Compare the shift of each field since the first revisit with how it differs from pass to
    pass later on.
    """
    rows = []
    for cell in cells:
        moved_m = cell.centre_after_m(loop.closed_s) - cell.centre_before_m(loop.closed_s)
        later_m = cell.centres_m[cell.crossed_s >= loop.closed_s]
        later_m = later_m[np.isfinite(later_m)]
        if np.isfinite(moved_m) and len(later_m) > 1:
            others_m = (later_m.sum() - later_m) / (len(later_m) - 1)
            differs_m = float(np.abs(later_m - others_m).mean())
            rows.append((loop.length_m - cell.peak_m, moved_m, differs_m))

    from_closure_m, shift_m, usual_m = np.array(rows).reshape(-1, 3).T
    if len(rows) < MIN_CELLS:
        return Shifts(from_closure_m, shift_m, usual_m, None, None, Verdict.UNDECIDED)

    excess_m = np.abs(shift_m) - usual_m
    drawn = rng.integers(0, len(rows), (DRAWS, len(rows)))
    low, high = np.percentile(excess_m[drawn].mean(axis=1), INTERVAL).tolist()
    p = float(wilcoxon(excess_m, alternative="greater").pvalue)
    excess = Estimate(float(excess_m.mean()), low, high, p)

    by_draw = _rank_correlations(excess_m[drawn], from_closure_m[drawn])
    low, high = np.percentile(by_draw, INTERVAL).tolist()
    tested = spearmanr(excess_m, from_closure_m, alternative="less")
    decline = Estimate(float(tested.statistic), low, high, float(tested.pvalue))
    verdict = _verdict(excess.p < ALPHA and excess.low > 0)
    return Shifts(from_closure_m, shift_m, usual_m, excess, decline, verdict)


def _synapses(session: Session, rng: np.random.Generator) -> Synapses:
    """Compare the change of how pairs fire together in rest with how much nearer their fields
    came.
    """
    cells = session.cells
    loop = session.loop
    peaks_m = np.array([cell.peak_m for cell in cells])
    before_m = peaks_m + [cell.centre_before_m(loop.closed_s) for cell in cells]
    after_m = peaks_m + [cell.centre_after_m(loop.closed_s) for cell in cells]
    known = np.flatnonzero(np.isfinite(before_m + after_m))
    nothing = np.zeros(0)
    undecided = Synapses(
        nothing, nothing, nothing, np.zeros(0, bool), None, None, None, Verdict.UNDECIDED
    )
    if min(cofiring.rest_seconds(session.rests_s, loop.closed_s)) < cofiring.MIN_REST_S:
        return undecided

    fired_s = [session.spikes_s[number] for number in known]
    pairs = cofiring.change_of(session.rests_s, session.candidates_s, loop.closed_s, fired_s, rng)
    start_m = before_m[known]
    moved_m = after_m[known] - start_m
    apart_m = _apart(start_m, pairs, loop)
    nearer_m = apart_m - _apart(start_m + moved_m, pairs, loop)
    close = apart_m < WINDOW_SHARE * loop.length_m
    if close.sum() < MIN_PAIRS:
        return undecided._replace(
            apart_m=apart_m, nearer_m=nearer_m, change=pairs.change, close=close
        )

    # By chance, cells shift by as much, but others do.
    correlation = float(spearmanr(pairs.change[close], nearer_m[close]).statistic)
    shuffled_m = np.array(
        [
            apart_m - _apart(start_m + rng.permutation(moved_m), pairs, loop)
            for _ in range(cofiring.SHUFFLES)
        ]
    )
    changes = np.tile(pairs.change[close], (cofiring.SHUFFLES, 1))
    by_chance = _rank_correlations(changes, shuffled_m[:, close])
    p = _p(int((by_chance >= correlation).sum()), cofiring.SHUFFLES)
    slope = _slope(pairs, nearer_m, close, p, rng)

    # Changes in units of what they are by chance, which is more for cells that fire together more.
    usual = np.maximum(pairs.shuffled.std(axis=0), 1e-12)
    sizes = np.abs(np.vstack([pairs.change[None, :], pairs.shuffled])) / usual
    decays = _rank_correlations(sizes, np.tile(apart_m, (len(sizes), 1)))
    p_decay = _p(int((decays[1:] <= decays[0]).sum()), cofiring.SHUFFLES)
    decay = Estimate(float(decays[0]), float("nan"), float("nan"), p_decay)
    verdict = _verdict(slope.p < ALPHA and slope.low > 0)
    return Synapses(apart_m, nearer_m, pairs.change, close, slope, correlation, decay, verdict)


def _slope(
    pairs: cofiring.Cofiring,
    nearer_m: Floats,
    close: Booleans,
    p: float,
    rng: np.random.Generator,
) -> Estimate:
    """Fit the change over a metre nearer, over close pairs; its interval is that of draws of
    cells, as pairs of one cell are not independent.
    """
    drawn = rng.multinomial(pairs.cells, np.full(pairs.cells, 1 / pairs.cells), DRAWS)
    drawn = np.vstack([np.ones(pairs.cells, np.int64), drawn])
    weights = drawn[:, pairs.first[close]] * drawn[:, pairs.second[close]]
    total = np.maximum(weights.sum(axis=1), 1)[:, None]
    x = nearer_m[close] - (weights @ nearer_m[close])[:, None] / total
    y = pairs.change[close] - (weights @ pairs.change[close])[:, None] / total
    slopes = (weights * x * y).sum(axis=1) / np.maximum((weights * x * x).sum(axis=1), 1e-12)
    low, high = np.percentile(slopes[1:], INTERVAL).tolist()
    return Estimate(float(slopes[0]), low, high, p)


def _apart(fields_m: Floats, pairs: cofiring.Cofiring, loop: Loop) -> Floats:
    """Return the distance along the loop of the fields of each pair, (m,)."""
    return np.abs(wrapped(fields_m[pairs.first] - fields_m[pairs.second], loop.length_m))


def _rank_correlations(one: Floats, other: Floats) -> Floats:
    """Return the rank correlation of each row of (s, n) with that of the other, (s,)."""
    x = rankdata(one, axis=1)
    y = rankdata(other, axis=1)
    x = x - x.mean(axis=1, keepdims=True)
    y = y - y.mean(axis=1, keepdims=True)
    scale = np.sqrt((x**2).sum(axis=1) * (y**2).sum(axis=1))
    return np.asarray((x * y).sum(axis=1) / np.maximum(scale, 1e-12))


def _p(as_extreme: int, shuffles: int) -> float:
    return (as_extreme + 1) / (shuffles + 1)


def _verdict(is_found: bool) -> Verdict:
    return Verdict.FOUND if is_found else Verdict.NOT_FOUND
