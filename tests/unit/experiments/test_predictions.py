"""The paper's predictions in recordings of place cells: found where they are, and only there."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cogmap.data.nwb import Recording
from cogmap.errors import UsageError
from cogmap.experiments.predictions import events, synthetic
from cogmap.experiments.predictions.loop import along, first_loop, movement_of
from cogmap.experiments.predictions.measure import Found, Verdict, measure
from cogmap.experiments.predictions.metrics import metrics_of
from cogmap.experiments.predictions.synthetic import Effect
from cogmap.geometry.arrays import Floats

RATE_HZ = 20.0
SEED = 1
PEAKS_M: Floats = np.arange(0.0, 4.0, 0.4)


@cache
def found(*effects: Effect) -> Found:
    """What is found in a synthetic recording with these effects."""
    return measure(synthetic.recording(SEED, effects), SEED)


def verdicts(*effects: Effect) -> list[Verdict]:
    measured = found(*effects)
    return [
        measured.replays.verdict,
        measured.shifts.verdict,
        measured.synapses.verdict,
    ]


def recording_of(positions_m: np.ndarray) -> Recording:
    stamps_s = np.arange(len(positions_m)) / RATE_HZ
    return Recording("animal", "", stamps_s, positions_m, [])


def run_along(line_m: np.ndarray, speed_m_s: float = 0.4) -> np.ndarray:
    """Positions of an animal that runs along a line at this speed."""
    lengths_m = np.hypot(*np.diff(line_m, axis=0).T)
    at_m = np.concatenate([[0.0], np.cumsum(lengths_m)])
    run_m = np.arange(0.0, at_m[-1], speed_m_s / RATE_HZ)
    return np.column_stack([np.interp(run_m, at_m, line_m[:, axis]) for axis in (0, 1)])


def test_all_three_predictions_are_found_where_they_are() -> None:
    assert verdicts(*Effect) == [Verdict.FOUND] * 3


def test_none_is_found_where_none_is() -> None:
    assert verdicts() == [Verdict.NOT_FOUND] * 3


@pytest.mark.parametrize(
    ("effects", "expected"),
    [
        ((Effect.REPLAYS,), (True, False, False)),
        ((Effect.SHIFTS,), (False, True, False)),
        ((Effect.SHIFTS, Effect.SYNAPSES), (False, True, True)),
    ],
)
def test_each_prediction_is_found_without_the_others(
    effects: tuple[Effect, ...], expected: tuple[bool, ...]
) -> None:
    assert tuple(each is Verdict.FOUND for each in verdicts(*effects)) == expected


def test_replays_and_revisits_are_counted_since_the_loop_was_closed() -> None:
    measured = found(*Effect)
    replays = measured.replays
    made = synthetic.LAPS * synthetic.REPLAYS

    assert abs(replays.reverse - made) <= 3
    assert replays.by_chance < 3
    assert set(replays.revisits.tolist()) == {synthetic.LAPS - 1}
    assert replays.ratio is not None
    expected = made * synthetic.TAKES_PART / (synthetic.LAPS - 1)
    assert replays.ratio.value == pytest.approx(expected, rel=0.15)
    assert replays.ratio.low < replays.ratio.value < replays.ratio.high


def test_shifts_are_those_that_were_made_least_where_the_loop_begins() -> None:
    shifts = found(*Effect).shifts
    share = 1 - shifts.from_closure_m / found(*Effect).loop.length_m
    at_end = share > 0.75

    assert shifts.shift_m[at_end].mean() == pytest.approx(-0.875 * synthetic.SHIFT_M, abs=0.08)
    assert shifts.decline is not None
    assert shifts.decline.value < 0


def test_the_same_seed_gives_the_same_numbers() -> None:
    recording = synthetic.recording(SEED, [*Effect])
    again = metrics_of(measure(recording, SEED), None)

    assert again == metrics_of(found(*Effect), None)
    assert recording.description.startswith("SYNTHETIC")


def test_a_recording_that_ends_with_the_first_return_decides_nothing() -> None:
    whole = synthetic.recording(SEED, [*Effect])
    end_s = found(*Effect).loop.closed_s + synthetic.REST_S + 1.5
    is_before = whole.stamps_s < end_s
    cut = replace(
        whole,
        stamps_s=whole.stamps_s[is_before],
        positions_m=whole.positions_m[is_before],
        spikes_s=[times_s[times_s < end_s] for times_s in whole.spikes_s],
        rests_s=None,
    )

    measured = measure(cut, SEED)
    metrics = metrics_of(measured, None)

    assert measured.replays.verdict is Verdict.UNDECIDED
    assert measured.shifts.verdict is Verdict.UNDECIDED
    assert measured.synapses.verdict is Verdict.UNDECIDED
    assert metrics["shift_excess_m"] is None
    assert metrics["place_replays_over_revisits_p"] is None


def test_an_animal_that_never_returns_is_refused_in_one_sentence() -> None:
    away = recording_of(run_along(np.array([[0.0, 0.0], [8.0, 0.0]])))

    with pytest.raises(UsageError, match=r"never comes back to a place.*: give a recording"):
        measure(away, SEED)


def test_a_loop_without_place_cells_is_refused_in_one_sentence() -> None:
    silent = replace(synthetic.recording(SEED, []), spikes_s=[np.array([1.0])] * 3)

    with pytest.raises(UsageError, match=r"0 of 3 units in .* have a place field"):
        measure(silent, SEED)


def test_to_turn_round_is_not_to_close_a_loop() -> None:
    track_m = np.array([[0.0, 0.0], [2.0, 0.0]] * 3)
    positions_m = run_along(track_m)
    loop = first_loop(movement_of(np.arange(len(positions_m)) / RATE_HZ, positions_m))

    assert loop is not None
    assert loop.length_m == pytest.approx(4.0, rel=0.1)
    assert loop.closed_s == pytest.approx(10.0, abs=0.6)


def test_there_and_back_are_different_places_of_a_loop() -> None:
    track_m = np.array([[0.0, 0.0], [2.0, 0.0]] * 3)
    positions_m = run_along(track_m)
    movement = movement_of(np.arange(len(positions_m)) / RATE_HZ, positions_m)
    loop = first_loop(movement)
    assert loop is not None
    along_m = along(loop, movement)

    middle = np.abs(movement.positions_m[:, 0] - 0.6) < 0.02
    there = along_m[middle & (movement.ahead[:, 0] > 0)]
    back = along_m[middle & (movement.ahead[:, 0] < 0)]
    assert np.ptp(there) < 0.2
    assert np.ptp(back) < 0.2
    assert back.mean() - there.mean() == pytest.approx(2.8, abs=0.2)


def test_the_order_of_an_event_is_told_from_where_the_animal_is() -> None:
    spikes_s = [np.array([1 + 0.01 * peak_m, 3 - 0.01 * peak_m]) for peak_m in PEAKS_M]
    spans_s = np.array([[0.9, 1.2], [2.9, 3.2]])

    population = events.Population(PEAKS_M, 4.0, spikes_s)
    tested = events.ordered(spans_s, np.array([3.7, 3.7]), population, np.random.default_rng(0))

    assert tested.is_forward.tolist() == [True, False]
    assert tested.is_reverse.tolist() == [False, True]
    assert tested.takes_part.all()


def test_events_with_too_few_cells_are_not_tested() -> None:
    spikes_s = [np.array([1.0])] * (events.MIN_CELLS - 1) + [np.zeros(0)] * 6
    population = events.Population(PEAKS_M, 4.0, spikes_s)
    span_s = np.array([[0.9, 1.1]])

    tested = events.ordered(span_s, np.zeros(1), population, np.random.default_rng(0))

    assert not len(tested.rho)
    assert not tested.by_chance.any()
