"""The log commands as users run them."""

from __future__ import annotations

import contextlib
import json
import os
import pty
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cogmap.bus.interface import Member
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.errors import UsageError
from cogmap.recording.diff import diff
from cogmap.recording.info import info
from cogmap.recording.recorder import Recorder
from cogmap.recording.storage.format import topics_to_record
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.testing import odometry
from tests.support.logs import SECOND_NS, scan, write_log
from tests.support.system.commands import log_command, log_facts
from tests.support.system.networks import await_members, routed

COUNT = 5
TIMEOUT_S = 30.0
AGENT = "replayed"
REPLAY = [sys.executable, "-m", "cogmap.cli.main", "log", "replay"]
PLAYED = {"odometry": COUNT, "sensory/scan": COUNT}


def write(path: Path, speed_m_s: float = 1.0, without: int | None = None) -> Path:
    """Odometry and scans, a second apart, without those of one number."""
    values = Array.of(np.arange(4, dtype=np.float32))
    rows: list[tuple[int, Message]] = []
    for seq in range(COUNT):
        if seq == without:
            continue
        at_ns = SECOND_NS * (seq + 1)
        rows.append((at_ns, odometry(seq, stamp_ns=at_ns, speed_m_s=speed_m_s)))
        rows.append((at_ns, scan(seq, stamp_ns=at_ns, values=values)))
    return write_log(path, rows, incarnation=5)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return write(tmp_path / "log.mcap")


def cat(path: Path, *arguments: str) -> list[dict[str, Any]]:
    """What `cogmap log cat` prints as JSON, message by message."""
    result = log_command("cat", path, *arguments, "--json")
    return [json.loads(line) for line in result.stdout.splitlines()]


def test_info_counts_the_messages_of_each_topic_by_source(path: Path) -> None:
    found = log_facts("info", path)
    text = log_command("info", path).stdout

    assert found["agent"] == "a"
    assert found["messages"] == 2 * COUNT
    assert found["duration_s"] == pytest.approx(4.0)
    assert found["gaps"] == []

    (wheels,) = (topic for topic in found["topics"] if topic["topic"] == "odometry")
    assert wheels["count"] == COUNT
    assert wheels["rate_hz"] == pytest.approx(1.25)
    assert wheels["sources"] == {"sim": COUNT}

    assert "sim:5" in text
    assert "the recording has no end" in text.lower()


def test_info_names_a_gap(tmp_path: Path) -> None:
    thin = write(tmp_path / "thin.mcap", without=2)

    text = log_command("info", thin).stdout

    assert "gap: odometry (never drop): 1 of sim missing, number 2" in text


def test_cat_prints_the_messages_of_the_topics_named_and_no_more_than_asked(path: Path) -> None:
    lines = cat(path, "odometry", "-n", "3")

    assert [line["message"]["seq"] for line in lines] == [0, 1, 2]
    assert {line["topic"] for line in lines} == {"odometry"}
    assert lines[0]["envelope"]["source"] == "sim"


def test_cat_prints_the_values_of_an_array_where_asked(path: Path) -> None:
    brief = log_command("cat", path, "sensory/scan", "-n", "1").stdout
    full = log_command("cat", path, "sensory/scan", "-n", "1", "--full").stdout

    assert brief.startswith("--- sensory/scan at 0.000 s\nstamp_ns: 1000000000\n")
    assert "range_m: <f4 4, 0.0 to 3.0" in brief
    assert "[0.0, 1.0, 2.0, 3.0]" in full


def test_cat_begins_at_the_offset(path: Path) -> None:
    lines = cat(path, "odometry", "--start-offset", "3")

    assert [line["message"]["seq"] for line in lines] == [3, 4]


def test_diff_ends_with_0_for_the_same_and_1_with_words_for_a_difference(
    path: Path, tmp_path: Path
) -> None:
    same = write(tmp_path / "same.mcap")
    other = write(tmp_path / "other.mcap", speed_m_s=2.0)

    log_command("diff", path, same, code=0)
    log_command("diff", path, other, "sensory/scan", code=0)
    text = log_command("diff", path, other, code=1).stdout
    facts = log_facts("diff", path, other, code=1)

    first = "odometry number 0 of sim (stamp 1.000 s): speed_m_s is 1.0 in log.mcap"
    assert f"First difference: {first}" in text
    assert facts["same"] is False


def test_recover_prints_what_it_saved_and_what_is_lost(path: Path, tmp_path: Path) -> None:
    whole = path.read_bytes()
    cut = tmp_path / "cut.mcap"
    saved = tmp_path / "saved.mcap"
    cut.write_bytes(whole[:-1500])

    recovery = log_facts("recover", cut, saved)
    text = log_command("recover", cut, tmp_path / "again.mcap").stdout

    assert recovery["messages"] == 2 * COUNT
    assert log_facts("info", saved)["messages"] == 2 * COUNT
    assert "messages saved from" in text


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["info", "absent.mcap"], "no log absent.mcap"),
        (["cat", "LOG", "odometer"], "did you mean 'odometry'"),
        (["replay", "LOG", "--into", "cerebellum"], "no module 'cerebellum'"),
        (
            ["replay", "LOG", "--into", "action"],
            "nothing that module action published: there are sensory, sim",
        ),
        (["record", "-x", "."], "no topic is left"),
        (["record", "-e", "("], "not a regular expression"),
        (["recover", "LOG", "LOG"], "exists already"),
    ],
)
def test_what_the_user_can_mend_is_one_sentence(
    path: Path, arguments: list[str], sentence: str
) -> None:
    given = [path if argument == "LOG" else argument for argument in arguments]

    with pytest.raises(UsageError) as caught:
        log_command(*given)

    printed = str(caught.value)
    assert sentence in printed
    assert "\n" not in printed


@pytest.fixture
def endpoint() -> Iterator[str]:
    with routed() as address:
        yield address


@pytest.fixture
def somebody(endpoint: str) -> Iterator[threading.Event]:
    """Is set once the first process of AGENT is ready."""
    here = threading.Event()
    observer = ZenohBus(endpoint, AGENT)
    observer.watch(lambda member, alive: here.set())
    yield here
    observer.close()


def played(player: subprocess.Popen[str]) -> dict[str, int]:
    """How many messages a player reports that it has played, by topic, when it ends."""
    assert player.stdout is not None
    counts: dict[str, int] = json.loads(player.stdout.read())["messages"]
    return counts


def replay(endpoint: str, path: Path, *options: str) -> list[str]:
    """The command that plays `path` onto AGENT's topics, a thousand times as fast."""
    return [*REPLAY, str(path), "-r", "1000", "--connect", endpoint, "--agent", AGENT, *options]


def test_what_is_played_onto_zenoh_and_recorded_again_is_the_same(
    endpoint: str, somebody: threading.Event, path: Path, tmp_path: Path
) -> None:
    again = tmp_path / "again.mcap"
    recorder = Recorder(ZenohBus(endpoint, AGENT), again, topics_to_record(), {})
    recorder.open()
    assert somebody.wait(TIMEOUT_S)

    command = replay(endpoint, path, "--json")
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as player:
        deadline_s = time.monotonic() + TIMEOUT_S
        while recorder.received.total() < 2 * COUNT and time.monotonic() < deadline_s:
            recorder.pump(0.1)
        assert played(player) == PLAYED

    assert recorder.close().never_drop_whole
    assert diff(path, again).same


def test_the_space_bar_continues_a_replay_that_began_paused(
    endpoint: str, somebody: threading.Event, path: Path
) -> None:
    terminal, other = pty.openpty()

    command = replay(endpoint, path, "--start-paused", "--json")
    with subprocess.Popen(command, stdin=other, stdout=subprocess.PIPE, text=True) as player:
        assert somebody.wait(TIMEOUT_S)
        assert player.poll() is None
        os.write(terminal, b" ")
        assert played(player) == PLAYED

    os.close(terminal)
    os.close(other)


def test_a_signal_makes_a_recorder_write_a_snapshot(endpoint: str, tmp_path: Path) -> None:
    output = tmp_path / "snapshot.mcap"
    command = [*REPLAY[:-1], "record", "-o", str(output), "--snapshot-s", "60", "--json"]
    with (
        contextlib.closing(ZenohBus(endpoint, AGENT)) as bus,
        subprocess.Popen(
            [*command, "--connect", endpoint, "--agent", AGENT],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as recorder,
    ):
        await_members(bus, Member("recorder", "recorder"))
        assert not output.exists()

        recorder.send_signal(signal.SIGUSR1)
        assert recorder.stderr is not None
        assert any(f"wrote {output}" in line for line in recorder.stderr)

        recorder.send_signal(signal.SIGTERM)
        written, _ = recorder.communicate(timeout=TIMEOUT_S)

    assert recorder.returncode == 0
    assert json.loads(written)["paths"] == [str(output)]
    assert info(output).finished


def test_a_recorder_that_begins_paused_needs_a_terminal(endpoint: str, tmp_path: Path) -> None:
    output = tmp_path / "paused.mcap"
    result = subprocess.run(
        [*REPLAY[:-1], "record", "-o", str(output), "--start-paused", "--connect", endpoint],
        check=False,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
    )

    assert result.returncode == 2
    assert "--start-paused needs a terminal" in result.stderr
    assert not output.exists()
