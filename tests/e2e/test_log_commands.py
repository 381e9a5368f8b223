"""The log commands as users run them."""

from __future__ import annotations

import json
import os
import pty
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from cli.main import cogmap
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.errors import UsageError
from cogmap.recording.diff import diff
from cogmap.recording.recorder import Recorder
from cogmap.recording.storage.format import topics_to_record
from schemas.array import Array
from schemas.base import Message
from tests.support.logs import SECOND_NS, odometry, scan, write_log
from tests.support.networks import routed

COUNT = 5
TIMEOUT_S = 30.0
REPLAY = [sys.executable, "-m", "cli.main", "log", "replay"]
PLAYED = {"odometry": COUNT, "sensory/scan": COUNT}


def write(path: Path, speed_m_s: float = 1.0, without: int | None = None) -> Path:
    """Odometry and scans, a second apart, without those of one number."""
    values = Array.of(np.arange(4, dtype=np.float32))
    rows: list[tuple[int, Message]] = []
    for seq in range(COUNT):
        at_ns = SECOND_NS * (seq + 1)
        if seq != without:
            rows.append((at_ns, odometry(seq, stamp_ns=at_ns, speed_m_s=speed_m_s)))
            rows.append((at_ns, scan(seq, stamp_ns=at_ns, values=values)))
    return write_log(path, rows, incarnation=5)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return write(tmp_path / "log.mcap")


@pytest.fixture
def run() -> Callable[..., Result]:
    def invoke(*arguments: str | Path) -> Result:
        result = CliRunner().invoke(cogmap, ["log", *map(str, arguments)], standalone_mode=False)
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result

    return invoke


def test_info_counts_the_messages_of_each_topic_by_source(
    run: Callable[..., Result], path: Path
) -> None:
    found = json.loads(run("info", path, "--json").stdout)
    assert (found["agent"], found["messages"], found["duration_s"]) == ("a", 2 * COUNT, 4.0)
    assert found["gaps"] == []
    rows = {topic["topic"]: topic for topic in found["topics"]}
    wheels = rows["odometry"]
    assert (wheels["count"], wheels["rate_hz"]) == (COUNT, 1.25)
    assert wheels["sources"] == {"sim": COUNT}
    text = run("info", path).stdout
    assert "sim:5" in text
    assert "its recorder did not end it" in text.lower()


def test_info_names_a_gap(run: Callable[..., Result], tmp_path: Path) -> None:
    thin = write(tmp_path / "thin.mcap", without=2)
    assert "gap: odometry (never drop): 1 of sim missing, number 2" in run("info", thin).stdout


def test_cat_prints_the_messages_of_the_topics_named_and_no_more_than_asked(
    run: Callable[..., Result], path: Path
) -> None:
    printed = run("cat", path, "odometry", "-n", "3", "--json").stdout
    lines = [json.loads(line) for line in printed.splitlines()]
    assert [line["message"]["seq"] for line in lines] == [0, 1, 2]
    assert {line["topic"] for line in lines} == {"odometry"}
    assert lines[0]["envelope"]["source"] == "sim"
    text = run("cat", path, "sensory/scan", "-n", "1").stdout
    assert text.startswith("--- sensory/scan at 0.000 s\nstamp_ns: 1000000000\n")
    assert "range_m: <f4 4, 0.0 to 3.0" in text
    assert "[0.0, 1.0, 2.0, 3.0]" in run("cat", path, "sensory/scan", "-n", "1", "--full").stdout


def test_cat_begins_at_the_offset(run: Callable[..., Result], path: Path) -> None:
    lines = run("cat", path, "odometry", "--json", "--start-offset", "3").stdout.splitlines()
    assert [json.loads(line)["message"]["seq"] for line in lines] == [3, 4]


def test_diff_ends_with_0_for_the_same_and_1_with_words_for_a_difference(
    run: Callable[..., Result], path: Path, tmp_path: Path
) -> None:
    same = write(tmp_path / "same.mcap")
    other = write(tmp_path / "other.mcap", speed_m_s=2.0)
    assert run("diff", path, same).exit_code == 0
    result = run("diff", path, other)
    assert result.exit_code == 1
    first = "odometry number 0 of sim (stamp 1.000 s): speed_m_s is 1.0 in log.mcap"
    assert f"First difference: {first}" in result.stdout
    assert run("diff", path, other, "sensory/scan").exit_code == 0
    assert json.loads(run("diff", path, other, "--json").stdout)["same"] is False


def test_recover_prints_what_it_saved_and_what_is_lost(
    run: Callable[..., Result], path: Path, tmp_path: Path
) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(path.read_bytes()[:-1500])
    result = run("recover", cut, tmp_path / "saved.mcap", "--json")
    assert json.loads(result.stdout)["messages"] == 2 * COUNT
    found = json.loads(run("info", tmp_path / "saved.mcap", "--json").stdout)
    assert found["messages"] == 2 * COUNT
    assert "messages saved from" in run("recover", cut, tmp_path / "again.mcap").stdout


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["info", "absent.mcap"], "no log absent.mcap"),
        (["cat", "LOG", "odometer"], "did you mean odometry"),
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
    run: Callable[..., Result], path: Path, arguments: list[str], sentence: str
) -> None:
    with pytest.raises(UsageError) as caught:
        run(*(path if argument == "LOG" else argument for argument in arguments))
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.fixture
def endpoint() -> Iterator[str]:
    with routed() as address:
        yield address


def test_what_is_played_onto_zenoh_and_recorded_again_is_the_same(
    endpoint: str, path: Path, tmp_path: Path
) -> None:
    again = tmp_path / "again.mcap"
    recorder = Recorder(ZenohBus(endpoint, "played"), again, topics_to_record(), {})
    recorder.open()
    observer = ZenohBus(endpoint, "played")
    here = threading.Event()
    observer.watch(lambda member, alive: here.set())
    assert here.wait(TIMEOUT_S)
    observer.close()
    command = [*REPLAY, str(path), "-r", "1000", "--json"]
    with subprocess.Popen(
        [*command, "--connect", endpoint, "--agent", "played"], stdout=subprocess.PIPE, text=True
    ) as player:
        deadline_s = time.monotonic() + TIMEOUT_S
        while sum(recorder.received.values()) < 2 * COUNT and time.monotonic() < deadline_s:
            recorder.pump(0.1)
        assert player.stdout is not None
        assert json.loads(player.stdout.read())["messages"] == PLAYED
    assert recorder.close().never_drop_whole
    assert diff(path, again).same


def test_the_space_bar_continues_a_replay_that_began_paused(endpoint: str, path: Path) -> None:
    observer = ZenohBus(endpoint, "paused")
    here = threading.Event()
    observer.watch(lambda member, alive: here.set())
    terminal, other = pty.openpty()
    command = [*REPLAY, str(path), "-r", "1000", "--start-paused", "--json"]
    with subprocess.Popen(
        [*command, "--connect", endpoint, "--agent", "paused"],
        stdin=other,
        stdout=subprocess.PIPE,
        text=True,
    ) as player:
        assert here.wait(TIMEOUT_S)
        assert player.poll() is None
        os.write(terminal, b" ")
        assert player.stdout is not None
        assert json.loads(player.stdout.read())["messages"] == PLAYED
    observer.close()
    os.close(terminal)
    os.close(other)
