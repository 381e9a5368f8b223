"""A drive that cannot succeed is ended, and the reason is named."""

from __future__ import annotations

import pytest

from cogmap.cli.launch.outcome import Ending, Outcome
from cogmap.cli.launch.watchdog import MIN_MOVE_M, STALLED_S, STUCK_S, Situation, Watchdog
from cogmap.schemas.sensing import SpeedLimit


def after(wall_s: float, drive_s: float, moved_m: float = 0.0, **more: object) -> Ending | None:
    """What the watchdog finds when so much has changed since the first look at a drive."""
    watchdog = Watchdog()
    first = Situation(now_s=100.0, drive_s=10.0, place_m=(5.0, 2.0), commands=50)
    facts = {"commands": 60, **more}
    there_m = (5.0, 2.0 + moved_m)
    later = Situation(now_s=100.0 + wall_s, drive_s=10.0 + drive_s, place_m=there_m, **facts)
    assert watchdog.check(first) is None
    return watchdog.check(later)


def test_a_robot_that_moves_is_left_alone() -> None:
    assert after(STUCK_S, STUCK_S, moved_m=MIN_MOVE_M) is None


def test_a_robot_that_stands_for_a_while_is_left_alone() -> None:
    assert after(STUCK_S - 0.1, STUCK_S - 0.1, halted_by=SpeedLimit.OBSTACLE) is None


@pytest.mark.parametrize(
    ("facts", "outcome", "words"),
    [
        ({"halted_by": SpeedLimit.OBSTACLE}, Outcome.STUCK, "halted by obstacle"),
        ({}, Outcome.STUCK, "though its wheels turn"),
        ({"halted_by": SpeedLimit.POSE_AGE}, Outcome.TOO_SLOW, "this machine is too slow"),
        ({"missing": ["epam"]}, Outcome.STALLED, "epam is not ready"),
        ({"commands": 50}, Outcome.STALLED, "no motor command arrived"),
    ],
)
def test_a_robot_that_stays_where_it_is_ends_the_drive_with_the_reason(
    facts: dict[str, object], outcome: Outcome, words: str
) -> None:
    ending = after(STUCK_S, STUCK_S, **facts)

    assert ending is not None
    assert ending.outcome is outcome
    assert words in ending.reason


def test_time_that_stands_still_ends_the_drive_with_who_is_missing() -> None:
    ending = after(STALLED_S, 0.0, missing=["epam", "workspace"])

    assert ending is not None
    assert ending.outcome is Outcome.STALLED
    assert "epam, workspace is not ready" in ending.reason


def test_lockstep_that_is_slow_is_not_stalled() -> None:
    assert after(10 * STALLED_S, 0.2) is None


def test_each_move_begins_the_wait_anew() -> None:
    watchdog = Watchdog()
    for step in range(10):
        seconds = step * (STUCK_S - 1.0)
        situation = Situation(
            now_s=seconds, drive_s=seconds, place_m=(step * MIN_MOVE_M, 0.0), commands=step
        )
        assert watchdog.check(situation) is None


def test_a_robot_that_backs_away_and_returns_again_and_again_is_stuck() -> None:
    watchdog = Watchdog()
    endings = []
    for second in range(round(STUCK_S) + 1):
        back_m = 0.6 * MIN_MOVE_M * (second % 2)
        situation = Situation(
            now_s=float(second), drive_s=float(second), place_m=(3.0 - back_m, 0.0), commands=second
        )
        endings.append(watchdog.check(situation))

    *before, last = endings
    assert before == [None] * len(before)
    assert last is not None
    assert last.outcome is Outcome.STUCK


@pytest.mark.parametrize("reason", [SpeedLimit.NO_ROUTE, SpeedLimit.AT_GOAL])
def test_a_robot_that_waits_for_a_goal_is_not_stuck(reason: SpeedLimit) -> None:
    assert after(10 * STUCK_S, 10 * STUCK_S, halted_by=reason) is None


def test_a_robot_that_is_charged_is_not_stuck() -> None:
    assert after(10 * STUCK_S, 10 * STUCK_S, is_charging=True) is None


def test_a_robot_that_stands_in_a_recording_is_not_stuck() -> None:
    halted = {"halted_by": SpeedLimit.RECORDING, "is_recorded": True}

    assert after(10 * STUCK_S, 10 * STUCK_S, **halted) is None
    assert after(STALLED_S, 0.0, **halted) is not None, "a player that is silent is stalled"


def test_a_robot_that_is_out_of_energy_ends_the_drive() -> None:
    watchdog = Watchdog()
    ending = watchdog.check(Situation(0.0, 10.0, (5.0, 2.0), commands=50, is_out=True))

    assert ending is not None
    assert ending.outcome is Outcome.OUT_OF_ENERGY
    assert ending.outcome.exit_code == 1


def test_only_a_drive_to_its_end_exits_with_0() -> None:
    codes = {outcome: outcome.exit_code for outcome in Outcome}

    assert codes.pop(Outcome.ROUTE_COMPLETE) == 0
    assert codes.pop(Outcome.RECORDING_OVER) == 0
    assert codes.pop(Outcome.INTERRUPTED) == 130
    assert set(codes.values()) == {1}


def test_a_drive_whose_time_somebody_lets_stand_is_left_alone() -> None:
    assert after(2 * STALLED_S, 0.0, is_paused=True) is None
