"""The motion between two views of the same landmarks."""

from __future__ import annotations

import cmath

import pytest

from cogmap.services.procedural.guidance.alignment import Motion, aligned, pairs_of
from tests.support.world.guidance import relation, relations


def _motion(at_m: complex, heading_rad: float, *looks: str) -> Motion:
    then = list(relations(0j, 0.0, *looks).values())
    now = list(relations(at_m, heading_rad, *looks).values())
    found = aligned(pairs_of(then, now))
    assert found is not None
    return found[0]


def test_several_landmarks_give_how_the_agent_has_moved_and_turned() -> None:
    motion = _motion(2 + 1j, 0.1)

    assert abs(motion.origin_before() - (2 + 1j)) < 0.1
    assert motion.turn_rad == pytest.approx(-0.1, abs=0.01)


def test_one_landmark_gives_how_it_has_moved_as_if_it_had_not_turned() -> None:
    motion = _motion(2 + 1j, 0.0, "bakery")

    assert motion.turn_rad == 0.0
    assert motion.origin_before() == pytest.approx(2 + 1j)


def test_a_landmark_that_stands_elsewhere_does_not_count() -> None:
    then = list(relations().values())
    now = [*relations(1j).values()]
    now[0] = relation("bakery", 50 + 20j)

    found = aligned(pairs_of(then, now))

    assert found is not None
    motion, agreeing = found
    assert {pair.number for pair in agreeing} == {1, 2, 3}
    assert motion.origin_before() == pytest.approx(1j, abs=0.05)


def test_two_landmarks_that_do_not_agree_give_nothing() -> None:
    then = [relation("bakery", 20 + 0j), relation("school", 20 + 10j)]
    now = [relation("bakery", 20 + 0j), relation("school", 20 - 30j)]

    assert aligned(pairs_of(then, now)) is None
    assert aligned([]) is None


def test_of_objects_that_look_alike_each_is_the_nearest() -> None:
    then = [relation("house", 20 + 5j), relation("house", 20 - 5j)]
    now = [relation("house", 19 - 5j), relation("house", 19 + 5j), relation("shop", 20 + 5j)]

    pairs = pairs_of(then, now)

    assert [(pair.number, pair.seen) for pair in sorted(pairs)] == [(0, 1), (1, 0)]


def test_a_motion_turns_a_point_then_shifts_it() -> None:
    motion = Motion(cmath.rect(1.0, cmath.pi / 2), 3 + 0j)

    assert motion.moved(2 + 0j) == pytest.approx(3 + 2j)
    assert motion.moved(motion.origin_before()) == pytest.approx(0j)
