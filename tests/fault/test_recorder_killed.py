"""A recorder as its own process on Zenoh: what is in its file when it is killed, and when it is
asked to end.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.interface import Member
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.recording.storage.reader import LogReader, Record
from cogmap.recording.storage.recover import recover
from cogmap.schemas import topics
from cogmap.testing import odometry
from tests.support.system.disks import full_after
from tests.support.system.networks import routed

TIMEOUT_S = 30.0
AGENT = "recorded"
FLUSH_S = 0.25
SLACK_S = 0.5
FULL_BYTES = 100_000


@pytest.fixture
def endpoint() -> Iterator[str]:
    with routed() as address:
        yield address


class Publisher:
    """Publishes odometry on Zenoh, a few hundred times a second."""

    def __init__(self, endpoint: str) -> None:
        self.bus = ZenohBus(endpoint, AGENT)
        self.bus.declare(topics.ODOMETRY)
        self.count = 0
        self._pause = threading.Event()
        self._here = threading.Event()
        self.bus.watch(self._saw)

    def _saw(self, member: Member, alive: bool) -> None:
        if member.module == "recorder" and alive:
            self._here.set()

    def await_recorder(self) -> None:
        assert self._here.wait(TIMEOUT_S)

    def publish(self) -> None:
        now_ns = time.time_ns()
        message = odometry(self.count, stamp_ns=now_ns)
        envelope = Envelope("sim", self.count, 2**62, now_ns, now_ns)
        self.bus.publish(topics.ODOMETRY, encode(message), envelope)
        self.count += 1
        self._pause.wait(0.002)

    def publish_until_it_grows(self, path: Path, times: int) -> None:
        """Publish until the file has grown so often."""
        size = path.stat().st_size
        deadline_s = time.monotonic() + TIMEOUT_S
        while times:
            assert time.monotonic() < deadline_s, "the file does not grow"
            self.publish()
            grown = path.stat().st_size
            times -= grown > size
            size = grown


@pytest.fixture
def publisher(endpoint: str) -> Iterator[Publisher]:
    publisher = Publisher(endpoint)
    yield publisher
    publisher.bus.close()


def start(endpoint: str, path: Path, *options: str) -> subprocess.Popen[str]:
    """A recorder of what is published at `endpoint`."""
    program = [sys.executable, "-m", "cogmap.cli.main", "log", "record"]
    target = ["-o", str(path), "--connect", endpoint, "--agent", AGENT]
    return subprocess.Popen(
        [*program, *target, *options],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def recorded(path: Path) -> list[Record]:
    """The records of odometry in a log."""
    reader = LogReader(path)
    return list(reader.records({topics.ODOMETRY}))


def seqs(records: list[Record]) -> list[int]:
    return [record.sequence for record in records]


def end_of_errors(recorder: subprocess.Popen[str]) -> str:
    """The last line of what a recorder that ends with code 2 prints as errors."""
    _, errors = recorder.communicate(timeout=TIMEOUT_S)
    assert recorder.returncode == 2
    assert "Traceback" not in errors
    return errors.strip().splitlines()[-1]


def test_a_killed_recorder_loses_only_what_came_since_its_last_flush(
    endpoint: str, publisher: Publisher, tmp_path: Path
) -> None:
    path = tmp_path / "log.mcap"
    saved = tmp_path / "saved.mcap"
    recorder = start(endpoint, path)
    publisher.await_recorder()
    publisher.publish_until_it_grows(path, 4)
    publisher.publish()

    recorder.kill()
    killed_ns = time.time_ns()
    recorder.wait()

    found = recorded(path)
    lost_s = (killed_ns - found[-1].log_time_ns) / 1e9
    assert seqs(found) == list(range(len(found)))
    assert lost_s < FLUSH_S + SLACK_S

    recovery = recover(path, saved)
    assert recovery.messages == len(found)
    assert seqs(recorded(saved)) == seqs(found)


@pytest.mark.parametrize("how", ["SIGTERM", "SIGINT", "end of input"])
def test_a_recorder_that_is_asked_to_end_has_every_message(
    endpoint: str, publisher: Publisher, tmp_path: Path, how: str
) -> None:
    path = tmp_path / "log.mcap"
    recorder = start(endpoint, path, "--json", "--tied")
    assert recorder.stdin is not None
    assert recorder.stdout is not None
    publisher.await_recorder()
    publisher.publish_until_it_grows(path, 2)

    if how == "end of input":
        recorder.stdin.close()
    else:
        recorder.send_signal(getattr(signal, how))
    summary = json.loads(recorder.stdout.read())

    count = summary["messages"]["odometry"]
    assert recorder.wait() == 0
    assert summary["never_drop_whole"]
    assert count == len(recorded(path))
    assert count > 0
    assert LogReader(path).about("summary")


def test_a_recorder_on_a_full_disk_ends_with_one_sentence(
    endpoint: str, publisher: Publisher, tmp_path: Path
) -> None:
    path = tmp_path / "log.mcap"
    with full_after(FULL_BYTES):
        recorder = start(endpoint, path)
    publisher.await_recorder()

    deadline_s = time.monotonic() + TIMEOUT_S
    while recorder.poll() is None:
        assert time.monotonic() < deadline_s, "the recorder does not end"
        publisher.publish()

    last = end_of_errors(recorder)
    assert last.startswith(f"cogmap: cannot write {path} (")
    assert last.endswith("free some space, or write to another disk")


def test_a_recorder_that_cannot_write_its_file_ends_with_one_sentence(
    endpoint: str, tmp_path: Path
) -> None:
    file = tmp_path / "file"
    file.write_text("no folder")

    recorder = start(endpoint, file / "log.mcap")

    last = end_of_errors(recorder)
    assert last.endswith("name a file in a folder that can be written to")
