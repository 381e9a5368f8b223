"""When a view that nobody has answered is published again."""

from __future__ import annotations

import pytest

from cogmap.runtime.repetition import (
    CHECK_NS,
    DOUBTED_AFTER_NS,
    DOUBTED_VIEWS,
    KEPT_WAITS,
    REPEAT_AFTER_NS,
    UNDOUBTED_AFTER_NS,
    Repetition,
)
from cogmap.schemas.process import Presence

START_NS = 10**12


class Waiting:
    """Looks at the wait for views every CHECK_NS of wall time."""

    def __init__(self) -> None:
        self.repetition = Repetition()
        self.view_ns = 1
        self._wall_ns = START_NS

    def times_asked_in(self, duration_ns: int) -> int:
        asked = 0
        for _ in range(duration_ns // CHECK_NS):
            asked += self.repetition.is_due(self.view_ns, self._wall_ns)
            self._wall_ns += CHECK_NS
        return asked

    def answer(self) -> None:
        self.repetition.on_answer()
        self.view_ns += 1


@pytest.fixture
def waiting() -> Waiting:
    return Waiting()


def presence(*, alive: bool, instance: str = "motor") -> Presence:
    return Presence(module=instance, instance=instance, alive=alive, observer="sim")


def leave_and_return(waiting: Waiting, instance: str = "motor") -> None:
    for alive in (False, True):
        waiting.repetition.on_presence(presence(alive=alive, instance=instance))


def test_where_all_stayed_a_view_is_repeated_after_longer_than_any_cycle(waiting: Waiting) -> None:
    assert waiting.times_asked_in(REPEAT_AFTER_NS) == 0
    assert waiting.times_asked_in(2 * REPEAT_AFTER_NS) == 2


def test_once_it_is_known_how_long_answers_take_one_that_is_missing_is_asked_for_sooner(
    waiting: Waiting,
) -> None:
    for _ in range(KEPT_WAITS + 1):
        waiting.times_asked_in(CHECK_NS)
        waiting.answer()

    assert waiting.times_asked_in(UNDOUBTED_AFTER_NS) == 0
    assert waiting.times_asked_in(UNDOUBTED_AFTER_NS) == 1


def test_whoever_joins_has_lost_nothing(waiting: Waiting) -> None:
    waiting.repetition.on_presence(presence(alive=True))

    assert waiting.times_asked_in(REPEAT_AFTER_NS) == 0


def test_nothing_is_repeated_while_a_module_is_away(waiting: Waiting) -> None:
    waiting.repetition.on_presence(presence(alive=False))

    assert waiting.times_asked_in(REPEAT_AFTER_NS) == 0


def test_a_view_is_repeated_soon_and_again_once_a_module_came_back(waiting: Waiting) -> None:
    assert waiting.times_asked_in(2 * DOUBTED_AFTER_NS) == 0
    leave_and_return(waiting)

    assert waiting.times_asked_in(DOUBTED_AFTER_NS) == 0
    assert waiting.times_asked_in(4 * DOUBTED_AFTER_NS) == 4


def test_what_follows_a_return_is_doubted_for_as_many_views_as_may_lack_something(
    waiting: Waiting,
) -> None:
    leave_and_return(waiting)
    for _ in range(DOUBTED_VIEWS - 1):
        waiting.answer()
    assert waiting.times_asked_in(2 * DOUBTED_AFTER_NS) == 1

    waiting.answer()

    assert waiting.times_asked_in(REPEAT_AFTER_NS) == 0


def test_on_a_slow_machine_nobody_is_asked_again_who_is_only_slow(waiting: Waiting) -> None:
    for _ in range(KEPT_WAITS):
        waiting.times_asked_in(2 * DOUBTED_AFTER_NS)
        waiting.answer()
    waiting.times_asked_in(CHECK_NS)
    leave_and_return(waiting)

    assert waiting.times_asked_in(5 * DOUBTED_AFTER_NS) == 0
    assert waiting.times_asked_in(2 * DOUBTED_AFTER_NS) == 1
