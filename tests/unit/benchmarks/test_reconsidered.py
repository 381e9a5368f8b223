"""A robot that is elsewhere, while one landmark fits where it believes to be."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.localization.loop import LocalizationLoop
from benchmarks.localization.senses import TICK_S, Moment, seen
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose, relative
from schemas.sensing import Percept

LANDMARKS = {"a": (10.0, 4.0), "b": (14.0, -6.0), "c": (22.0, 1.0)}
FORWARDS = np.array([[2.0, 0.0, TICK_S, 0.02, 0.002]])
STEP_M = 0.4
VIEWS = 12


def _turned_about_a() -> Floats:
    """A pose that sees `a` as the origin does, from another side."""
    x_m, y_m = LANDMARKS["a"]
    turned = np.array([x_m, y_m, 1.0])
    to_origin = relative(np.array([x_m, y_m, 0.0]), np.zeros(3))
    return compose(turned, to_origin)


def _percept(label: str, robot_x_m: float) -> Percept:
    x_m, y_m = LANDMARKS[label]
    ahead_m = x_m - robot_x_m
    return seen(label, math.atan2(y_m, ahead_m), math.hypot(y_m, ahead_m))


def _believed_after(order: str) -> Floats:
    """Where a robot believes to be that drove from the origin, straight on, but was told that it
    starts elsewhere, and saw landmarks in that order, one in each view.
    """
    loop = LocalizationLoop(tuple(_turned_about_a().tolist()), LANDMARKS, surveyed=True)
    for number in range(VIEWS):
        label = order[number % len(order)]
        percept = _percept(label, (number + 1) * STEP_M)
        loop.live(Moment((number + 1) * TICK_S, FORWARDS, [percept], True))

    loop.close()
    return loop.pose


def test_three_landmarks_seen_in_turn_tell_where_it_is_though_one_fits_elsewhere() -> None:
    assert _believed_after("abac") == pytest.approx((VIEWS * STEP_M, 0.0, 0.0), abs=0.3)


def test_one_landmark_that_does_not_fit_moves_it_nowhere() -> None:
    elsewhere = compose(_turned_about_a(), np.array([VIEWS * STEP_M, 0.0, 0.0]))

    assert _believed_after("ab")[:2] == pytest.approx(elsewhere[:2], abs=0.3)
