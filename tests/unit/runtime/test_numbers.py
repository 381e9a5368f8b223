"""Which numbers of a source are new, and how many are missing by them."""

from __future__ import annotations

import pytest

from cogmap.errors import MessageError
from cogmap.runtime.delivery.numbers import MAX_JUMP, MAX_RANGES, Newest, Numbers

FAR = 2**61


def missing_after(*numbers: int) -> int:
    """How many are missing after these have come."""
    first, *others = numbers
    kept = Numbers(first)
    return sum(kept.add(number) for number in others)


def test_what_is_between_two_numbers_is_missing_until_it_comes() -> None:
    assert missing_after(0, 1, 5) == 3
    assert missing_after(0, 1, 5, 3) == 2
    assert missing_after(0, 1, 5, 3, 4, 2) == 0


def test_a_number_comes_twice_only_if_it_has_come() -> None:
    numbers = Numbers(10)
    for number in (11, 20, 21, 15):
        numbers.add(number)

    for number in (10, 11, 20, 21, 15):
        with pytest.raises(MessageError, match="came twice"):
            numbers.add(number)
    assert numbers.add(16) == -1


def test_a_stray_ahead_hides_none_of_those_that_continue_where_the_source_was() -> None:
    numbers = Numbers(0)

    assert numbers.add(MAX_JUMP) == MAX_JUMP - 1
    assert sum(numbers.add(number) for number in range(1, MAX_JUMP)) == 1 - MAX_JUMP


def test_a_number_too_far_ahead_is_refused_and_changes_nothing() -> None:
    numbers = Numbers(0)

    for _ in range(10):
        with pytest.raises(MessageError, match="is 2305843009213693952 ahead of the last"):
            numbers.add(FAR)

    assert numbers.last == 0
    assert numbers.add(1) == 0


def test_numbers_far_ahead_in_a_row_are_a_long_gap() -> None:
    numbers = Numbers(0)

    for number in (FAR, FAR + 1):
        with pytest.raises(MessageError, match="ahead of the last"):
            numbers.add(number)

    assert numbers.add(FAR + 2) == FAR + 1
    assert numbers.add(FAR + 3) == 0


def test_the_source_is_received_after_a_liar_had_a_row_of_far_numbers_believed() -> None:
    numbers = Numbers(0)
    for number in (FAR, FAR + 1):
        with pytest.raises(MessageError):
            numbers.add(number)
    numbers.add(FAR + 2)

    assert [numbers.add(number) for number in (1, 2, 3)] == [-1, -1, -1]


def test_far_numbers_that_the_source_interrupts_are_no_row() -> None:
    numbers = Numbers(0)
    for number in range(1, 20):
        with pytest.raises(MessageError, match="ahead of the last"):
            numbers.add(FAR + number)
        assert numbers.add(number) == 0


def test_the_numbers_of_many_gaps_take_no_more_room() -> None:
    numbers = Numbers(0)
    for number in range(2, 10 * MAX_RANGES, 2):
        numbers.add(number)

    with pytest.raises(MessageError, match="came twice"):
        numbers.add(3)
    assert numbers.add(10 * MAX_RANGES - 3) == -1


def test_what_came_before_the_first_that_was_received_is_new() -> None:
    assert missing_after(10, 5) == 4
    assert missing_after(10, 9) == 0


def test_where_any_may_be_missing_a_number_is_refused_only_if_it_is_far_ahead() -> None:
    newest = Newest()
    for number in (5, 6, 6, 3, MAX_JUMP):
        newest.add(number)

    for number in (FAR, FAR + 5):
        with pytest.raises(MessageError, match="ahead of the last"):
            newest.add(number)
    newest.add(7)
