"""What is learned of a drive."""

from __future__ import annotations

import pytest

from cogmap.schemas.cognition import Relation
from cogmap.services.procedural.guidance.lessons import STOP_NS, Lesson, Lessons
from cogmap.testing import PERIOD_NS
from tests.support.world.guidance import driven, relations

STOP_CYCLES = STOP_NS // PERIOD_NS


class Drive:
    """A drive straight on, a metre a cycle."""

    def __init__(self) -> None:
        self.lessons = Lessons(step_m=2.0, ahead_m=10.0)
        self.learned: list[Lesson] = []
        self._cycle = 0
        self._at_m = 0

    def on(self, metres: int, *looks: str) -> None:
        """Drive on, and see all, or this."""
        for _ in range(metres):
            self._at_m += 1
            self._view(relations(complex(self._at_m), 0.0, *looks), drives=True)

    def blind(self, metres: int) -> None:
        """Drive on, and see nothing."""
        for _ in range(metres):
            self._at_m += 1
            self._view({}, drives=True)

    def stand(self, cycles: int) -> None:
        """Stand, and see all."""
        for _ in range(cycles):
            self._view(relations(complex(self._at_m)), drives=False)

    def _view(self, seen: dict[str, Relation], *, drives: bool) -> None:
        self._cycle += 1
        me = driven(complex(self._at_m), cycle=self._cycle)
        self.learned += self.lessons.on_view(me, seen.values(), drives)


def test_a_lesson_begins_at_each_step_and_ends_as_far_ahead() -> None:
    drive = Drive()
    drive.on(15)

    first, second, third = drive.learned
    assert first.path_m[0] == 0j
    assert first.path_m[-1] == pytest.approx(10 + 0j)
    assert [each.look for each in first.landmarks] == ["bakery", "school", "library", "museum"]
    assert second.landmarks[0].range_m < first.landmarks[0].range_m
    assert third.path_m[-1] == pytest.approx(10 + 0j)


def test_where_nothing_is_seen_a_lesson_leads_to_where_something_is() -> None:
    drive = Drive()
    drive.on(1)
    drive.blind(30)
    assert drive.learned == []

    drive.on(3)

    assert drive.learned[0].path_m[-1] == pytest.approx(30 + 1j * 0, abs=3)


def test_where_one_landmark_is_seen_lessons_begin_farther_apart() -> None:
    drive = Drive()
    drive.on(24)
    drive.on(24, "museum")
    drive.on(12)

    alone = [lesson for lesson in drive.learned if len(lesson.landmarks) == 1]
    several = [lesson for lesson in drive.learned if len(lesson.landmarks) > 1]
    assert 0 < len(alone) < len(several) / 1.25


def test_a_long_stop_ends_all_lessons_and_a_short_one_none() -> None:
    drive = Drive()
    drive.on(5)
    drive.stand(STOP_CYCLES)
    before = len(drive.learned)
    drive.on(1)
    drive.stand(STOP_CYCLES + 1)

    assert before == 0
    assert [abs(lesson.path_m[-1]) for lesson in drive.learned] == pytest.approx([5.0, 3.0, 1.0])


def test_an_agent_that_does_not_drive_learns_nothing() -> None:
    drive = Drive()
    drive.stand(3 * STOP_CYCLES)

    assert drive.learned == []


def test_a_view_that_becomes_conscious_late_is_no_step_back() -> None:
    drive = Drive()
    drive.on(8)
    late = driven(5 + 0j, cycle=5)

    assert drive.lessons.on_view(late, relations(5 + 0j).values(), True) == []
    drive.on(6)
    assert drive.learned[0].path_m[-1] == pytest.approx(10 + 0j)
