"""`cogmap log predictions`: what a log shows of the paper's predictions of place cells."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cogmap.errors import LogError, UsageError
from cogmap.schemas.array import Array
from cogmap.schemas.cognition import Direction, Replay, RouteReplay
from cogmap.schemas.nodes import LoopClosure
from tests.support.logs import SECOND_NS, delta, write_log
from tests.support.reference import REFERENCE
from tests.support.system.commands import log_command, log_facts

DECAY = 0.5
PLACES = 40
PASSES = 6


def replay(seq: int, places: int = PLACES) -> Replay:
    """The correction of a straight path of places 1 m and 1 s apart: of the 4 m by which the newest
    is moved back, each has its share by the square of the distance driven.
    """
    stamps_ns = np.arange(places)[::-1] * SECOND_NS
    before_m = np.column_stack([np.arange(places)[::-1], np.zeros(places)]).astype(float)
    share = before_m / (places - 1)
    shifts_m = -4.0 * share**2
    pairs = np.column_stack([np.arange(places - 1), np.arange(1, places)])
    apart_m = -np.diff((before_m + shifts_m)[:, 0])
    changes = np.exp(-DECAY * apart_m) - np.exp(-DECAY)
    return Replay(
        seq=seq,
        source="codelets",
        cycle=seq,
        replays=PASSES,
        closed=["closure:1"],
        undone=[],
        stamps_ns=Array.of(stamps_ns),
        positions_m=Array.of(before_m),
        shifts_m=Array.of(shifts_m),
        pairs=Array.of(pairs.astype(np.int32)),
        strength_changes=Array.of(changes),
        decay_per_m=DECAY,
    )


def closure(name: str, from_s: float, to_s: float, *, accepted: bool | None = True) -> LoopClosure:
    return LoopClosure(
        id=f"closure:{name}",
        from_ns=round(from_s * SECOND_NS),
        to_ns=round(to_s * SECOND_NS),
        cue="view-1",
        ahead_m=0.0,
        left_m=0.0,
        range_m=0.0,
        bearing_rad=0.0,
        sd_m=1.0,
        sd_rad=0.1,
        accepted=accepted,
    )


@pytest.fixture
def drive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A log with two corrections, after the first ten places were passed again; one closure was
    rejected.
    """
    monkeypatch.chdir(tmp_path)
    closures = [
        closure("1", 0, 100),
        closure("2", 9, 109),
        closure("3", 20, 112, accepted=False),
    ]
    route = RouteReplay(
        seq=1,
        source="codelets",
        cycle=1,
        direction=Direction.REVERSE,
        map="map",
        cells=Array.of(np.zeros((1, 2)), "<i4"),
    )
    messages = [delta(1, *closures), replay(1), replay(2), route]
    rows = [(number * SECOND_NS, message) for number, message in enumerate(messages)]
    return write_log(tmp_path / "drive.mcap", rows)


def test_replays_are_counted_beside_revisits_by_place(drive: Path) -> None:
    facts = log_facts("predictions", drive)

    assert facts["corrections"] == 2
    assert facts["replays"] == 2 * PASSES
    assert facts["revisits"] == 1
    assert facts["places_replayed"] == PLACES
    assert facts["places_revisited"] == 10
    assert facts["place_replays_over_revisits"] == 2 * PASSES
    assert facts["route_replays_reverse"] == 1


def test_each_time_that_the_agent_comes_back_is_a_revisit(tmp_path: Path) -> None:
    thrice = [closure("1", 0, 100), closure("2", 5, 200), closure("3", 10, 203)]
    another_place = closure("4", 90, 206)
    rows = [(0, delta(1, *thrice, another_place)), (1, replay(1))]

    log = write_log(tmp_path / "log.mcap", rows)
    facts = log_facts("predictions", log, "-o", tmp_path / "figure.png")

    assert facts["revisits"] == 3


def test_shifts_are_given_by_their_distance_from_the_closure(drive: Path) -> None:
    facts = log_facts("predictions", drive)

    assert facts["loop_m"] == PLACES - 1
    assert facts["shift_max_m"] == pytest.approx(4.0)
    assert facts["shift_far_from_closure_m"] < 0.2
    assert facts["shift_near_closure_m"] > 3.0
    assert -1.0 < facts["shift_and_distance_from_closure_correlation"] < -0.9


def test_synapses_change_less_the_farther_two_fields_are_apart(drive: Path) -> None:
    facts = log_facts("predictions", drive)
    changes = [value for key, value in facts.items() if key.startswith("strength_change_mean_abs")]

    assert facts["close_pairs"] == PLACES - 1
    assert facts["strength_and_shift_correlation_close_pairs"] > 0.99
    assert 0 < facts["strength_change_per_m_close_pairs"] < DECAY
    assert changes[0] > changes[-1] > 0


def test_the_figure_is_a_picture_and_has_the_same_bytes_each_time(drive: Path) -> None:
    printed = log_command("predictions", drive).stdout
    log_command("predictions", drive, "-o", "first.pdf")
    log_command("predictions", drive, "--figure", "second.pdf")

    assert "replays: 12 in 2 corrections, of 1 revisits: 12.0 times as many" in printed
    assert Path("drive-predictions.png").read_bytes().startswith(b"\x89PNG")
    assert Path("first.pdf").read_bytes() == Path("second.pdf").read_bytes()


def test_a_log_that_holds_no_closure_is_refused_in_one_sentence(tmp_path: Path) -> None:
    figure = tmp_path / "figure.png"
    with pytest.raises(LogError, match=r"no loop was closed.*give a drive that returns"):
        log_command("predictions", REFERENCE, "-o", figure)
    assert not figure.exists()


def test_a_figure_of_another_kind_is_refused(drive: Path) -> None:
    with pytest.raises(UsageError, match=r"-o figure\.gif: name a file that ends in"):
        log_command("predictions", drive, "-o", "figure.gif")
