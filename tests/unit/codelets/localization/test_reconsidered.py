"""A landmark that does not fit, weighed together with what was seen just before."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pytest
from msgspec.structs import replace

from benchmarks.localization.loop import LocalizationLoop
from benchmarks.localization.senses import TICK_S, Moment
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose, relative
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.localization.measurement_model import cost_of_mistake
from cogmap.testing import percept_at

LANDMARKS = {
    "a": (10.0, 4.0),
    "near a": (10.1, 4.1),
    "b": (14.0, -6.0),
    "c": (22.0, 1.0),
    "d": (20.0, 8.0),
    "e": (9.0, -4.0),
    "f": (25.0, 1.0),
    "g": (18.0, -12.0),
}
FORWARDS = np.array([[2.0, 0.0, TICK_S, 0.02, 0.002]])
STEP = np.array([0.4, 0.0, 0.0])
ORIGIN = np.zeros(3)
FAR = np.array([6.0, -9.0, 1.0])


def _turned_about_a() -> Floats:
    """A pose that sees `a` as the origin does, from another side."""
    x_m, y_m = LANDMARKS["a"]
    to_origin = relative(np.array([x_m, y_m, 0.0]), ORIGIN)
    return compose(np.array([x_m, y_m, 1.0]), to_origin)


def _percept(label: str, pose: Floats, stands_at: str = "") -> Percept:
    """A landmark seen from a pose, or what stands at another one taken for it."""
    return percept_at(pose, label, LANDMARKS[stands_at or label])


def _poses(start: Floats, number: int) -> list[Floats]:
    """The poses after each of so many steps."""
    return [compose(start, (step + 1) * STEP) for step in range(number)]


def _believed(start: Floats, views: Iterable[list[Percept]]) -> Floats:
    """Where a robot that was told its start believes to be after a step forwards to each view."""
    loop = LocalizationLoop(tuple(start.tolist()), LANDMARKS, surveyed=True)
    for number, percepts in enumerate(views):
        loop.live(Moment((number + 1) * TICK_S, FORWARDS, percepts, True))

    loop.close()
    return loop.pose


def _seen_in_turn(order: str) -> list[list[Percept]]:
    """Landmarks seen one in each view, on the way from the origin straight on."""
    poses = _poses(ORIGIN, len(order))
    return [[_percept(label, pose)] for label, pose in zip(order, poses, strict=True)]


def test_three_landmarks_seen_in_turn_tell_where_it_is_though_one_fits_elsewhere() -> None:
    believed = _believed(_turned_about_a(), _seen_in_turn("abacabacabac"))

    assert believed == pytest.approx(12 * STEP, abs=0.3)


def test_landmarks_hidden_in_part_move_it_nowhere_though_all_would_fit_elsewhere() -> None:
    start = _turned_about_a()
    views = []
    for percepts in _seen_in_turn("abacabacabac"):
        views.append([replace(percept, whole=False) for percept in percepts])

    believed = _believed(start, views)

    assert believed[:2] == pytest.approx(compose(start, 12 * STEP)[:2], abs=0.3)


def test_one_landmark_that_does_not_fit_moves_it_nowhere() -> None:
    start = _turned_about_a()
    believed = _believed(start, _seen_in_turn("abababababab"))

    assert believed[:2] == pytest.approx(compose(start, 12 * STEP)[:2], abs=0.3)


def test_one_mistaken_name_moves_it_nowhere_though_all_would_fit_elsewhere() -> None:
    poses = _poses(ORIGIN, 10)
    rivals = _poses(_turned_about_a(), 10)
    views = []
    for number in range(0, 10, 2):
        views.append([_percept("a", poses[number]), _percept("near a", poses[number])])
        views.append([_percept("c", rivals[number + 1])])

    assert _believed(ORIGIN, views)[:2] == pytest.approx((10 * STEP)[:2], abs=0.3)


def test_what_was_seen_before_it_was_found_does_not_mislead_it_afterwards() -> None:
    poses = _poses(ORIGIN, 6)
    found = [["b", "c"], ["d", "e"], ["f"], ["f"]]
    views = []
    for labels, pose in zip(found, poses, strict=False):
        views.append([_percept(label, pose) for label in labels])

    views.append([_percept("g", poses[4], stands_at="d")])
    views.append([_percept("f", poses[5])])
    assert _believed(FAR, views[:4])[:2] == pytest.approx(poses[3][:2], abs=0.3)
    assert _believed(FAR, views)[:2] == pytest.approx(poses[5][:2], abs=0.3)


def test_a_mistaken_name_costs_as_much_as_it_is_unlikely() -> None:
    assert cost_of_mistake() == pytest.approx(math.log(1000))
