"""A recorder that continues the log of one that was killed, and what no log of a run holds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.cli.launch.drive_metrics import Recording
from cogmap.recording.completeness import logs_of
from cogmap.recording.recorder import Recorder, Summary
from cogmap.recording.selection import to_record
from cogmap.recording.storage.reader import LogReader
from cogmap.runtime.state.outbox import Outbox
from cogmap.schemas import topics
from cogmap.testing import odometry

LATER_NS = 2**62


class Run:
    """The folder of a run with a source of odometry in it, and recorders one after the other."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.network = MemoryNetwork()
        self.bus = MemoryBus(self.network)
        self.outbox = Outbox(folder / "sim.outbox")
        self.bus.serve_past(topics.ODOMETRY, "sim", self.outbox.read)
        self.published = 0

    def record(self, name: str, after: Sequence[str] = ()) -> Recorder:
        """An open recorder."""
        about = {"agent": "a", "config": "{}"}
        logs = [self.folder / log for log in after]
        recorder = Recorder(
            MemoryBus(self.network), self.folder / name, to_record(), about, after=logs
        )
        recorder.open()
        return recorder

    def publish(self, number: int, *, keeps: bool = True) -> None:
        """Publish so many messages, which a source that `keeps` them has in its outbox."""
        for _ in range(number):
            envelope, payload = self._next(keeps)
            self.bus.publish(topics.ODOMETRY, payload, envelope)

    def lose(self, number: int) -> None:
        """Publish so many messages, which the source keeps, that reach nobody."""
        for _ in range(number):
            self._next(keeps=True)

    def _next(self, keeps: bool) -> tuple[Envelope, bytes]:
        message = odometry(self.published)
        envelope = Envelope("sim", message.seq, LATER_NS, 1, 1, earlier=0)
        payload = encode(message)
        if keeps:
            self.outbox.append(topics.ODOMETRY, message.seq, encode(envelope), payload)
        self.published += 1
        return envelope, payload

    def kill(self, recorder: Recorder) -> None:
        """End a recorder without a summary in its log."""
        pump_all(recorder)
        recorder.flush()
        recorder.abandon()

    def recorded(self) -> list[int]:
        """The numbers in all logs, as they were written."""
        numbers: list[int] = []
        for path in logs_of(self.folder):
            records = LogReader(path).records({topics.ODOMETRY})
            numbers += [record.sequence for record in records]
        return numbers

    def recording(self) -> Recording:
        """How the recording of the run went."""
        published = {"sim": {topics.ODOMETRY.name: self.published}}
        found = Recording.of_run(logs_of(self.folder), published)
        assert found is not None
        return found


@pytest.fixture
def run(tmp_path: Path) -> Run:
    return Run(tmp_path)


def pump_all(recorder: Recorder) -> None:
    while recorder.pump():
        pass


def finished(recorder: Recorder) -> Summary:
    pump_all(recorder)
    return recorder.close()


def test_what_came_while_no_recorder_was_there_is_fetched(run: Run) -> None:
    run.publish(2)
    run.kill(run.record("log.mcap"))
    recorder = run.record("log-2.mcap", ["log.mcap"])
    run.publish(3)
    run.kill(recorder)
    run.publish(4)
    continued = run.record("log-3.mcap", ["log.mcap", "log-2.mcap"])
    pump_all(continued)
    run.publish(5)

    summary = finished(continued)

    assert run.recorded() == list(range(14))
    assert summary.fetched == {"odometry": 4}
    assert summary.never_drop_whole
    assert not summary.rejected
    assert run.recording().never_drop_whole
    assert run.recording().logs == 3


def test_the_last_messages_are_fetched_though_no_other_shows_them(run: Run) -> None:
    recorder = run.record("log.mcap")
    run.publish(3)
    run.kill(recorder)
    run.publish(4)

    summary = finished(run.record("log-2.mcap", ["log.mcap"]))

    assert run.recorded() == list(range(7))
    assert summary.fetched == {"odometry": 4}


def test_what_no_source_has_kept_is_counted_at_the_boundary_of_two_logs(run: Run) -> None:
    recorder = run.record("log.mcap")
    run.publish(3)
    run.kill(recorder)
    run.publish(4, keeps=False)
    continued = run.record("log-2.mcap", ["log.mcap"])
    run.publish(5)

    summary = finished(continued)

    assert summary.lost == {"odometry": 4}
    assert not summary.never_drop_whole
    recording = run.recording()
    assert recording.lost == {"odometry": 4}
    assert recording.gaps == ["odometry (never drop): 4 of sim missing, number 3 to 6"]


def test_what_came_after_the_last_recorder_is_counted(run: Run) -> None:
    recorder = run.record("log.mcap")
    run.publish(3)
    run.kill(recorder)
    run.publish(4)

    recording = run.recording()

    assert recording.lost == {"odometry": 4}
    assert recording.gaps == ["odometry (never drop): the last 4 of sim missing"]


@pytest.mark.parametrize("finishes", [True, False])
def test_an_instance_that_is_in_no_log_is_counted(run: Run, finishes: bool) -> None:
    recorder = run.record("log.mcap")
    if finishes:
        recorder.close()
    else:
        run.kill(recorder)
    run.publish(4, keeps=False)

    assert run.recording().lost == {"odometry": 4}


def test_a_recorder_that_ends_fetches_what_the_bus_has_not_delivered(run: Run) -> None:
    recorder = run.record("log.mcap")
    run.publish(3)
    pump_all(recorder)
    run.lose(1)

    recorder.close()

    assert run.recorded() == [0, 1, 2, 3]


def test_a_recorder_whose_time_to_end_is_over_fetches_no_more_and_says_what_it_lacks(
    run: Run,
) -> None:
    recorder = run.record("log.mcap")
    run.publish(2)
    pump_all(recorder)
    run.lose(3)
    run.publish(1)

    summary = recorder.close(fetch_s=0.0)

    assert run.recorded() == [0, 1, 5]
    assert summary.lost == {"odometry": 3}
    assert not summary.fetched


def test_the_first_messages_of_a_source_that_began_later_are_fetched(run: Run) -> None:
    recorder = run.record("log.mcap")
    run.lose(2)
    run.publish(1)

    summary = finished(recorder)

    assert run.recorded() == [0, 1, 2]
    assert summary.never_drop_whole


def test_logs_are_in_the_order_in_which_they_were_begun(tmp_path: Path) -> None:
    for name in ("log-10.mcap", "log.mcap", "log-2.mcap", "log-old.mcap", "other.mcap"):
        (tmp_path / name).touch()

    assert [path.name for path in logs_of(tmp_path)] == ["log.mcap", "log-2.mcap", "log-10.mcap"]
