"""The time until a robot is localized again after a part of its log was cut out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from benchmarks.localization.drives import follow
from benchmarks.localization.senses import moments
from benchmarks.localization.truth import Truth
from benchmarks.report import Metrics
from cogmap.data.mrclam import Robot
from cogmap.geometry.arrays import Floats

CUTS = 10
CUT_S = 60.0
LEAD_S = 60.0
WATCHED_S = 240.0
FOUND_M = 0.5
HOLDS_S = 20.0


class Recovery(NamedTuple):
    """After one cut: the time until the error is below FOUND_M for HOLDS_S, and how much of the
    time after that it is above; all of the time that was watched if it never is.
    """

    lost_s: float
    over_share: float


def evaluate_recovery(robot: Robot, landmarks: dict[int, tuple[float, float]]) -> Metrics:
    """Measure the mean and the worst of a robot's recoveries, on a map of surveyed landmarks.

    The cuts are spread over its log. Nothing in them reaches it: neither that it moved nor what it
    saw.
    """
    begin_s, end_s = robot.odometry[[0, -1], 0].tolist()
    latest_s = end_s - begin_s - CUT_S - WATCHED_S
    cuts_s = np.linspace(LEAD_S, latest_s, CUTS).tolist()
    found = [_recovery(robot, landmarks, cut_s) for cut_s in cuts_s]

    return {
        "recovery_s": float(np.mean([each.lost_s for each in found])),
        "recovery_worst_s": max(each.lost_s for each in found),
        "recovery_over_share": float(np.mean([each.over_share for each in found])),
    }


def recovery_of(since_s: Floats, errors_m: Floats) -> Recovery:
    """Find the recovery in (n,) errors, in order of their times since the cut's end."""
    is_over = errors_m > FOUND_M
    over_s = np.append(since_s[is_over], np.inf)
    next_over_s = over_s[np.searchsorted(over_s, since_s)]
    ends_s = since_s[-1]

    holds = (next_over_s - since_s > HOLDS_S) & (since_s + HOLDS_S <= ends_s)
    if not holds.any():
        return Recovery(float(ends_s), 1.0)

    found = int(holds.argmax())
    return Recovery(float(since_s[found]), float(is_over[found:].mean()))


def _recovery(robot: Robot, landmarks: dict[int, tuple[float, float]], cut_s: float) -> Recovery:
    """Measure the recovery from a cut that begins `cut_s` after the log begins; the robot knows
    where it is a while before.
    """
    begin_s = float(robot.odometry[0, 0])
    resumed_s = begin_s + cut_s + CUT_S
    first_s = begin_s + cut_s - LEAD_S
    last_s = resumed_s + WATCHED_S
    every = moments(robot, (cut_s, cut_s + CUT_S))
    log = [moment for moment in every if first_s <= moment.stamp_s <= last_s]
    stamps_s = np.array([moment.stamp_s for moment in log])

    truth = Truth.at(robot, stamps_s)
    start_x_m, start_y_m, start_rad = truth.poses[0].tolist()
    online = follow(log, landmarks, (start_x_m, start_y_m, start_rad), 0).online

    is_tick = np.array([moment.tick for moment in log])
    after = truth.only(is_tick & (stamps_s > resumed_s))
    return recovery_of(stamps_s[after.is_known] - resumed_s, after.errors_m(online))
