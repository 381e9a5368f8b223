"""`cogmap run` as users run it: real processes, a real router, a short route."""

from __future__ import annotations

import itertools
import json
import signal
import socket
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from cogmap.bus.session import check_free, free_endpoint, open_client
from cogmap.runtime.client import Client
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.sensing import MotorCommand
from tests.support.system.processes import shared_memory
from tests.support.system.runs import COGMAP, DRIVING, TIMEOUT_S, Run, processes_at, wait_until

LOG_LIMIT_BYTES = 4_000_000
MCAP_END = b"\x89MCAP0\r\n"


def is_finished(log: Path) -> bool:
    """Whether its recorder ended it."""
    return log.read_bytes().endswith(MCAP_END)


def test_a_short_drive_ends_and_leaves_a_log_a_map_and_a_summary(
    start: Callable[..., Run],
) -> None:
    run = start("--lockstep", "--laps", "0.05", "--codelets", "2")
    assert run.end() == 0, run.output()

    summary = run.summary()
    assert summary["completed"]
    assert summary["ended_by"] == "route complete"
    assert summary["gaps_total"] == 0
    assert summary["restarts"] == {}
    assert summary["killed"] == []
    assert summary["distance_m"] > 5.0
    assert summary["estimates"] == summary["commands"]
    assert summary["commands"] > 5

    assert (run.folder / "map.png").read_bytes().startswith(b"\x89PNG")
    assert is_finished(run.folder / "log.mcap")
    assert "[sim]" in (run.folder / "config.toml").read_text()
    assert not (run.folder / "state").exists()
    assert processes_at(run.endpoint) == []


def same_in_log(summary: dict[str, Any]) -> set[str]:
    """The facts in a log's summary that are also its run's: all but those of time and processes."""
    of_process = {"superseded", "busy", "memory_mb", "rejected"}
    of_time = {name for name in summary if name.startswith("cycle_")}
    of_time.add("bus_share")
    same = set(summary) - of_process - of_time
    assert same
    return same


def test_the_log_alone_gives_the_summary_and_the_map_of_its_run(start: Callable[..., Run]) -> None:
    run = start("--lockstep", "--laps", "0.05")
    assert run.end() == 0, run.output()
    log = str(run.folder / "log.mcap")
    drawn = run.folder / "again.png"

    summarised = subprocess.run(
        [*COGMAP, "log", "summary", log, "--json"], capture_output=True, check=True
    )
    subprocess.run([*COGMAP, "log", "map", log, "-o", str(drawn)], check=True)

    of_log = json.loads(summarised.stdout)
    of_run = run.summary()
    for name in same_in_log(of_log):
        assert of_log[name] == of_run[name], name
    assert drawn.read_bytes() == (run.folder / "map.png").read_bytes()


def test_the_summary_comes_as_json_too(start: Callable[..., Run]) -> None:
    run = start("--lockstep", "--laps", "0.02", "--no-record", "--json")
    assert run.end() == 0, run.output()

    last = run.output().splitlines()[-1]
    assert json.loads(last)["completed"]


def test_a_drive_by_the_papers_rules_names_them_and_what_overrides_them(
    start: Callable[..., Run],
) -> None:
    drive = ("--lockstep", "--laps", "0.02", "--no-record", "--json")
    run = start(*drive, "--rules", "paper", "--set", "codelets.correct=heading")
    assert run.end() == 0, run.output()

    used = {"localization": "paper", "closes_by": "sighting", "planning": "gradient"}
    summary = run.summary()
    assert {rule: summary[f"rules_{rule}"] for rule in used} == used
    assert summary["rules_correct"] == "heading"
    assert "rules: localization paper, closes_by sighting, correct heading" in run.output()


def test_ctrl_c_ends_a_drive_cleanly(start: Callable[..., Run]) -> None:
    run = start()
    run.wait_for(DRIVING)

    run.process.send_signal(signal.SIGINT)

    assert run.end() == 130, run.output()
    assert run.summary()["ended_by"] == "interrupted"
    assert "interrupted by Ctrl-C" in run.output()
    assert is_finished(run.folder / "log.mcap")
    outputs = [run.output()]
    outputs += [log.read_text() for log in run.folder.glob("*.log")]
    assert not any("Traceback" in output for output in outputs)
    assert processes_at(run.endpoint) == []


def test_nothing_is_left_of_a_launcher_that_is_killed(start: Callable[..., Run]) -> None:
    run = start()
    run.wait_for(DRIVING)
    assert len(processes_at(run.endpoint)) > 7

    run.process.kill()
    run.end()
    wait_until(lambda: processes_at(run.endpoint) == [], "all processes end")

    assert is_finished(run.folder / "log.mcap")


KILLED_TOGETHER = (
    ("sensory", "epam", "codelets-1", "global_workspace", "procedural", "action", "motor"),
    ("workspace",),
    ("sim",),
    ("recorder", "router"),
)


class Drive:
    """Counts the commands that move the robot's wheels."""

    def __init__(self) -> None:
        self.moving = 0
        self.module = Module("listener").on(topics.MOTOR_COMMAND, self._on_command)

    def await_more(self, commands: int) -> None:
        """Wait until so many more have come."""
        enough = self.moving + commands
        wait_until(lambda: self.moving >= enough, f"{commands} commands more move the robot")

    def _on_command(self, command: MotorCommand) -> None:
        if not command.halted_by:
            self.moving += 1


def test_whatever_is_killed_is_restarted_and_the_robot_drives_again(
    start: Callable[..., Run],
) -> None:
    before = shared_memory()
    drive = Drive()
    run = start("--laps", "3", "--time-limit", "100")
    run.wait_for(DRIVING)

    with Client(drive.module, run.endpoint):
        for together in KILLED_TOGETHER:
            run.kill(*together)
            drive.await_more(5)
        run.process.send_signal(signal.SIGINT)
        assert run.end() == 130, run.output()

    killed = itertools.chain.from_iterable(KILLED_TOGETHER)
    assert run.summary()["restarts"] == dict.fromkeys(killed, 1)
    assert is_finished(run.folder / "log-2.mcap")
    assert processes_at(run.endpoint) == []
    assert shared_memory() <= before
    check_free(run.endpoint)


def test_a_router_and_a_module_of_ones_own_take_part(
    start: Callable[..., Run], router: str
) -> None:
    beside = ("--router", router, "--without", "global_workspace")
    run = start("--lockstep", "--laps", "0.02", *beside)
    run.wait_for("waiting for global_workspace")
    assert run.pid_of("router") is None

    options = ("--connect", router, "--config", str(run.folder / "config.toml"))
    with subprocess.Popen([*COGMAP, "module", "global_workspace", *options]) as module:
        try:
            assert run.end() == 0, run.output()
            assert module.poll() is None
        finally:
            module.terminate()
    assert len(processes_at(router)) == 1


@pytest.fixture
def router() -> Iterator[str]:
    """The endpoint of a router that somebody else started."""
    endpoint = free_endpoint()
    with subprocess.Popen([*COGMAP, "router", "--connect", endpoint]) as process:
        try:
            open_client(endpoint, TIMEOUT_S).close()
            yield endpoint
        finally:
            process.terminate()


def test_a_full_disk_ends_a_drive_at_once_with_the_reason(start: Callable[..., Run]) -> None:
    run = start("--laps", "3", file_limit_bytes=LOG_LIMIT_BYTES)

    assert run.end() == 1, run.output()

    summary = run.summary()
    assert summary["ended_by"] == "module failed"
    assert summary["reason"].startswith("recorder has ended: cannot write ")
    assert "Traceback" not in run.output()
    assert processes_at(run.endpoint) == []


def test_a_port_in_use_is_one_sentence_and_code_2(start: Callable[..., Run]) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        endpoint = f"tcp/127.0.0.1:{port}"
        run = start("--connect", endpoint)
        assert run.end() == 2

    assert run.output().startswith(f"cogmap: cannot listen at {endpoint}")
    assert len(run.output().splitlines()) == 1
    assert not run.folder.exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--set", "sim.sed=2"], "unknown key 'sed' in [sim]: did you mean 'seed'?"),
        (["--set", "motor.cruise_m_s=fast"], "[motor] Expected `float`, got `str`"),
        (["--config", "nowhere.toml"], "no configuration file nowhere.toml"),
    ],
)
def test_a_wrong_configuration_is_one_sentence_and_code_2(
    start: Callable[..., Run], arguments: list[str], words: str
) -> None:
    run = start(*arguments)

    assert run.end() == 2
    assert words in run.output()
    assert len(run.output().splitlines()) == 1
