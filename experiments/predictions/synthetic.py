"""A recording that no animal made: place cells on a track, with the predicted effects or without.

It shows the format of a file, and tests find the effects in it where they are, and not where they
are not. Its numbers are round ones of that order, fitted to no data.
"""

from __future__ import annotations

import enum
from collections.abc import Collection

import numpy as np

from cogmap.data.nwb import Recording
from cogmap.geometry.arrays import Booleans, Floats
from cogmap.geometry.polylines import points_at

TRACK_M = ((0.0, 0.0), (1.2, 0.0), (1.2, 0.8), (0.0, 0.8), (0.0, 0.0))
LENGTH_M = 4.0
RATE_HZ = 25.0
SPEED_M_S = 0.25
LAPS = 8
REST_BEFORE_S = 240.0
REST_S = 30.0
JITTER_M = 0.002
CELLS = 36
FIELD_M = 0.12
PEAK_HZ = 15.0
BASE_HZ = 0.1
SHIFT_M = 0.25
SHIFT_SD_M = 0.1
TOGETHER_HZ = 0.12
DECAY_PER_M = 4.0
TOGETHER_S = 0.01
REPLAYS = 5
NOISE_BURSTS = 2
BURST_S = 0.15
TAKES_PART = 0.7


class Effect(enum.StrEnum):
    """The predictions. REPLAYS: the loop is replayed in reverse five times in each rest since the
    first lap; else bursts are as many, in no order. SHIFTS: fields shift after it, most where the
    lap ends; else they stay. SYNAPSES: pairs of cells fire together in rest by exp(-k d) of the
    distance of their fields as it is; else as it was at first.
    """

    REPLAYS = "replays"
    SHIFTS = "shifts"
    SYNAPSES = "synapses"


def recording(seed: int, effects: Collection[Effect]) -> Recording:
    """Make a recording of a track that is run eight times, with rest before and after each lap, in
    which these effects are.
    """
    rng = np.random.default_rng(seed)
    stamps_s, along_m, is_running = _laps()
    line_m = np.array(TRACK_M)
    positions_m = points_at(line_m, along_m % LENGTH_M)
    positions_m = positions_m + rng.normal(0.0, JITTER_M, positions_m.shape)

    closed_s = float(stamps_s[np.searchsorted(along_m, LENGTH_M)])
    before_m = (np.arange(CELLS) + rng.uniform(0.2, 0.8, CELLS)) * LENGTH_M / CELLS
    after_m = before_m
    if Effect.SHIFTS in effects:
        share = before_m / LENGTH_M
        after_m = before_m - SHIFT_M * share + rng.normal(0.0, SHIFT_SD_M, CELLS)

    trains: list[list[Floats]] = [[] for _ in range(CELLS)]
    is_after = stamps_s >= closed_s
    for number, train in enumerate(trains):
        centre_m = np.where(is_after, after_m[number], before_m[number])
        offset_m = (along_m - centre_m + LENGTH_M / 2) % LENGTH_M - LENGTH_M / 2
        in_field_hz = PEAK_HZ * np.exp(-0.5 * (offset_m / FIELD_M) ** 2)
        rate_hz = BASE_HZ + np.where(is_running, in_field_hz, 0.0)
        counts = rng.poisson(rate_hz / RATE_HZ)
        times_s = np.repeat(stamps_s, counts)
        train.append(times_s + rng.uniform(0.0, 1 / RATE_HZ, len(times_s)))

    rests_s = _rests(stamps_s, is_running)
    together_m = after_m if Effect.SYNAPSES in effects else before_m
    for begin_s, end_s in rests_s.tolist():
        is_later = begin_s > REST_BEFORE_S
        _fire_together(trains, together_m if is_later else before_m, begin_s, end_s, rng)
        if is_later:
            starts_s = np.linspace(begin_s + 1.0, end_s - 1.0, REPLAYS + NOISE_BURSTS)
            _burst(trains, before_m, starts_s, Effect.REPLAYS in effects, rng)

    names = ", ".join(sorted(effects)) or "none"
    return Recording(
        name=f"synthetic-{seed}",
        description=f"SYNTHETIC, simulated by Cogmap: no animal was recorded. Predicted effects "
        f"in it: {names}. Seed {seed}.",
        stamps_s=stamps_s,
        positions_m=positions_m,
        spikes_s=[np.sort(np.concatenate(train)) for train in trains],
        rests_s=rests_s,
    )


def _laps() -> tuple[Floats, Floats, Booleans]:
    """Return stamps (n,), how far the animal has run (n,), and whether it runs (n,)."""
    lap_s = LENGTH_M / SPEED_M_S
    total_s = REST_BEFORE_S + LAPS * (lap_s + REST_S)
    stamps_s = np.arange(0.0, total_s, 1 / RATE_HZ)
    into_s = np.maximum(stamps_s - REST_BEFORE_S, 0.0)
    lap, in_lap_s = np.divmod(into_s, lap_s + REST_S)
    is_running = (stamps_s >= REST_BEFORE_S) & (in_lap_s < lap_s)
    along_m = lap * LENGTH_M + np.minimum(in_lap_s, lap_s) * SPEED_M_S
    return stamps_s, along_m, is_running


def _rests(stamps_s: Floats, is_running: Booleans) -> Floats:
    padded = np.concatenate([[True], is_running, [True]])
    edges = np.flatnonzero(np.diff(padded.astype(int))).reshape(-1, 2)
    last = len(stamps_s) - 1
    return np.asarray(stamps_s[np.minimum(edges, last)])


def _fire_together(
    trains: list[list[Floats]],
    centres_m: Floats,
    begin_s: float,
    end_s: float,
    rng: np.random.Generator,
) -> None:
    """Add coincident spikes to each pair of cells, as often as exp(-k d) of their fields."""
    first, second = np.triu_indices(CELLS, k=1)
    apart_m = np.abs(centres_m[first] - centres_m[second]) % LENGTH_M
    apart_m = np.minimum(apart_m, LENGTH_M - apart_m)
    rate_hz = TOGETHER_HZ * np.exp(-DECAY_PER_M * apart_m)
    counts = rng.poisson(rate_hz * (end_s - begin_s))
    times_s = rng.uniform(begin_s, end_s, counts.sum())
    for cells in (np.repeat(first, counts), np.repeat(second, counts)):
        fired_s = times_s + rng.uniform(0.0, TOGETHER_S, len(times_s))
        for number, train in enumerate(trains):
            train.append(fired_s[cells == number])


def _burst(
    trains: list[list[Floats]],
    centres_m: Floats,
    starts_s: Floats,
    is_ordered: bool,
    rng: np.random.Generator,
) -> None:
    """Add bursts: replays from the end of the loop back to its beginning, and some in no order."""
    is_replay = rng.permutation(len(starts_s)) < REPLAYS
    for start_s, replays in zip(starts_s.tolist(), is_replay.tolist(), strict=True):
        backwards = 1 - centres_m / LENGTH_M
        if not (replays and is_ordered):
            backwards = rng.permutation(backwards)
        for number, train in enumerate(trains):
            if rng.random() < TAKES_PART:
                spikes = rng.integers(1, 4)
                jitter_s = rng.normal(0.0, 0.006, spikes)
                train.append(start_s + backwards[number] * BURST_S + jitter_s)
