"""Finding one cycle in a log, and all that the log holds of it."""

from __future__ import annotations

from pathlib import Path

from msgspec import structs

from cogmap.cli.explain import choice
from cogmap.cli.explain.moment import Moment, moment
from cogmap.recording.log import Log, open_log
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Phase
from cogmap.services.global_workspace.config import Config
from tests.support.cycles import CYCLE_NS, MS_NS, Cycles, action, command, delta
from tests.support.logs import Row, write_log
from tests.support.reference import REFERENCE


def found(path: Path, number: int) -> Moment:
    log = open_log(path)
    cycle = choice.numbered(log, number)
    return moment(log, cycle.number, cycle.stamp_ns)


def began_s(log: Log, cycle: int) -> float:
    """When the first message of a cycle was received, in seconds into the log."""
    number = choice.numbered(log, cycle)
    return moment(log, number.number, number.stamp_ns).at_s


def at(after_ms: int, cycle: int, message: Message) -> Row:
    return cycle * CYCLE_NS + after_ms * MS_NS, message


def test_a_time_of_the_log_means_the_newest_cycle_then(tmp_path: Path) -> None:
    cycles = Cycles()
    for cycle in range(1, 40):
        cycles.add(cycle, novelty=0.9)
    log = open_log(write_log(tmp_path / "drive.mcap", cycles.rows))

    for cycle in (1, 2, 17, 39):
        assert choice.at_time(log, began_s(log, cycle)).number == cycle
    assert choice.at_time(log, began_s(log, 18) - 0.001).number == 17
    assert choice.numbered(log, 23).stamp_ns == 23 * CYCLE_NS


def test_a_cycle_that_ended_before_its_attention_is_found_too(tmp_path: Path) -> None:
    cycles = Cycles()
    cycles.add(1, novelty=0.9)
    cycles.add_without_attention(2)
    cycles.add(3, novelty=0.9)
    log = open_log(write_log(tmp_path / "drive.mcap", cycles.rows))

    assert choice.at_time(log, began_s(log, 2)) == choice.numbered(log, 2)
    assert moment(log, 2, 2 * CYCLE_NS).competition is None


def test_an_answer_that_came_late_does_not_stand_for_its_view(tmp_path: Path) -> None:
    cycles = Cycles()
    cycles.add(1, novelty=0.9)
    cycles.add(2, novelty=0.9)
    late = structs.replace(delta(2, Phase.LATE, "1/landmark/library"), stamp_ns=CYCLE_NS)
    cycles.rows.append(at(70, 2, late))
    log = open_log(write_log(tmp_path / "drive.mcap", cycles.rows))

    found_then = choice.at_time(log, log.duration_s)

    assert found_then.number == 2
    assert found_then.stamp_ns == 2 * CYCLE_NS


def test_a_winner_that_had_waited_is_traced_to_the_cycle_in_which_it_entered(
    tmp_path: Path,
) -> None:
    patient = Config(no_broadcast_ticks=10**6)
    cycles = Cycles(patient)
    cycles.add(1, novelty=0.9)
    cycles.add(2, whereabouts=0.45)
    for cycle in range(3, 6):
        cycles.add(cycle)
    path = write_log(tmp_path / "drive.mcap", cycles.rows)

    waited = found(path, 5)
    assert waited.winner == "2/whereabouts/0"
    assert waited.entered["2/whereabouts/0"].cycle == 2
    assert waited.entered["2/whereabouts/0"].coalition.activation == 0.45


def test_a_coalition_without_an_id_is_known_by_codelet_and_cycle(tmp_path: Path) -> None:
    workspace = Cycles()
    workspace.add(1, novelty=0.9, ids=False)
    path = write_log(tmp_path / "drive.mcap", workspace.rows)

    assert found(path, 1).winner == "novelty/1"
    assert found(path, 1).entered["novelty/1"].cycle == 1


def test_without_a_broadcast_the_last_one_and_its_action_are_found(tmp_path: Path) -> None:
    cycles = Cycles()
    cycles.add(1, novelty=0.9)
    cycles.add(2, novelty=0.9)
    moment_found = found(write_log(tmp_path / "drive.mcap", cycles.rows), 2)

    assert moment_found.broadcast is None
    assert moment_found.winner == ""
    assert moment_found.earlier_broadcast is not None
    assert moment_found.earlier_broadcast.message.cycle == 1
    assert moment_found.earlier_action is not None
    assert moment_found.earlier_action.message.cycle == 1


def test_the_command_is_the_first_after_the_action(tmp_path: Path) -> None:
    rows = Cycles()
    rows.add(1, acts=False, novelty=0.9)
    rows.rows.append(at(70, 1, action(1)))
    rows.add(2)
    path = write_log(tmp_path / "drive.mcap", rows.rows)

    followed = found(path, 1).command
    assert followed is not None
    assert followed.message == command(2)
    assert followed.after_ms == 160.0


def test_without_an_action_the_command_is_the_answer_to_the_view(tmp_path: Path) -> None:
    cycles = Cycles()
    cycles.add(1, novelty=0.9)
    cycles.add(2)
    stopped = structs.replace(command(2), left_wheel_rad_s=0.0, right_wheel_rad_s=0.0)
    cycles.rows.append(at(90, 2, stopped))

    answer = found(write_log(tmp_path / "drive.mcap", cycles.rows), 2).command
    assert answer is not None
    assert answer.message == command(2)


def test_the_reference_drive_has_everything_of_each_cycle() -> None:
    for number in (1, 5, 9):
        each = found(REFERENCE, number)
        phases = [delta.message.phase for delta in each.deltas]

        assert each.view is not None
        assert each.percepts is not None
        assert each.view.message.frame == each.percepts.message.frame
        assert phases[0] is Phase.PERCEPTS
        assert phases[-1] is Phase.END
        assert each.competition is not None
        assert {contender.id for contender in each.competition.message.contenders} == set(
            each.entered
        )


def test_times_count_from_the_sensing_of_the_view() -> None:
    each = found(REFERENCE, 5)
    times_ms = []
    for logged in (each.view, each.percepts, each.competition, each.action, each.command):
        assert logged is not None
        assert logged.after_ms is not None
        times_ms.append(logged.after_ms)

    assert times_ms == sorted(times_ms)
    assert times_ms[0] > 0.0
    assert times_ms[-1] < 10_000.0
