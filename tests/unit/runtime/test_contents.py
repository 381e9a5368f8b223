"""Two messages with one number: the same one again, or another."""

from __future__ import annotations

from collections.abc import Sequence

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.interface import Arrival
from cogmap.runtime.delivery.contents import MAX_UNLIKE, REMEMBERED, Contents
from cogmap.runtime.delivery.intake import Intake
from cogmap.schemas import topics
from cogmap.schemas.sensing import Odometry


def arrival_of(number: int, speed_m_s: float = 0.0) -> Arrival:
    """Odometry of the simulation."""
    message = Odometry(
        stamp_ns=number,
        source="sim",
        seq=number,
        speed_m_s=speed_m_s,
        turn_rate_rad_s=0.0,
        dt_s=0.1,
    )
    return Arrival(topics.ODOMETRY, encode(message), Envelope("sim", number, 1, 2, 3), 4)


def accepted(intake: Intake, arrivals: Sequence[Arrival]) -> list[float]:
    """The speeds of those that are received."""
    messages = (intake.accept(arrival) for arrival in arrivals)
    return [message.speed_m_s for message in messages if isinstance(message, Odometry)]


def test_a_lie_with_the_next_number_does_not_hide_the_message_that_has_it() -> None:
    intake = Intake()

    lie, true = arrival_of(1, 99.0), arrival_of(1, 1.0)
    assert accepted(intake, [arrival_of(0), lie, true, arrival_of(2, 2.0)]) == [0.0, 99.0, 1.0, 2.0]
    assert not intake.gaps
    (note,) = intake.notes()
    assert note.startswith("1 messages contradict others of the same number")
    assert "odometry: number 1 of sim" in note


def test_the_same_message_counts_once_beside_another_of_its_number() -> None:
    intake = Intake()
    lie, true = arrival_of(1, 99.0), arrival_of(1, 1.0)

    assert accepted(intake, [lie, true, lie, true, true]) == [99.0, 1.0]
    assert intake.rejected["odometry"] == 3


def test_a_message_and_a_lie_in_its_name_each_count_once_whichever_came_first() -> None:
    lie, true = arrival_of(1, 99.0), arrival_of(1, 1.0)
    for first, second in ((lie, true), (true, lie)):
        intake = Intake()
        accepted(intake, [first, second, second, first, second])

        (note,) = intake.notes()
        assert note.startswith("1 messages contradict others")
        assert intake.rejected["odometry"] == 3


def test_numbers_that_are_far_apart_are_not_taken_for_one() -> None:
    contents = Contents()
    for apart in (2**61, 2**61 - 1, 2**62):
        for seq in (1, 1 + apart):
            envelope = Envelope("sim", seq, 1, 2, 3)
            assert not contents.contradicts(envelope, str(seq).encode())
            contents.add(envelope, str(seq).encode())


def test_of_any_number_of_lies_none_keeps_the_true_one_out() -> None:
    intake = Intake()
    lies = [arrival_of(1, 1.0 + number) for number in range(3 * MAX_UNLIKE)]

    accepted(intake, lies)

    assert accepted(intake, [arrival_of(1, -1.0)]) == [-1.0]


def test_what_is_long_past_is_known_by_its_number_alone() -> None:
    intake = Intake()
    accepted(intake, [arrival_of(number) for number in range(REMEMBERED + 1)])

    assert accepted(intake, [arrival_of(0, 9.0)]) == []
    assert accepted(intake, [arrival_of(1, 9.0)]) == [9.0]
