"""`cogmap run` as users run it: real processes, a real router, a short route."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from cogmap.bus.session import check_free, free_endpoint
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from schemas import topics
from schemas.sensing import MotorCommand
from tests.support.runs import COGMAP, DRIVING, Run, processes_at, shared_memory, wait_until

LOG_LIMIT_BYTES = 4_000_000


def test_a_short_drive_ends_and_leaves_a_log_a_map_and_a_summary(
    start: Callable[..., Run],
) -> None:
    run = start("--lockstep", "--laps", "0.05", "--codelets", "2")
    assert run.end() == 0, run.output()
    summary = run.summary()
    assert summary["completed"] and summary["ended_by"] == "route complete"
    assert summary["gaps_total"] == 0 and summary["restarts"] == {} and summary["killed"] == []
    assert summary["distance_m"] > 5.0 and summary["estimates"] == summary["commands"] > 5
    assert (run.folder / "map.png").read_bytes().startswith(b"\x89PNG")
    assert (run.folder / "log.mcap").read_bytes().endswith(b"\x89MCAP0\r\n")
    assert "[sim]" in (run.folder / "config.toml").read_text()
    assert not (run.folder / "state").exists()
    assert processes_at(run.endpoint) == []


def test_the_log_alone_gives_the_summary_and_the_map_of_its_run(start: Callable[..., Run]) -> None:
    run = start("--lockstep", "--laps", "0.05")
    assert run.end() == 0, run.output()
    log = str(run.folder / "log.mcap")
    result = subprocess.run(
        [*COGMAP, "log", "summary", log, "--json"], capture_output=True, check=True
    )
    of_run = json.loads((run.folder / "summary.json").read_text())
    of_log = json.loads(result.stdout)
    of_process = {"superseded", "busy", "memory_mb", "rejected"}
    timed = {name for name in of_log if name.startswith("cycle_")} | {"bus_share"}
    same = set(of_log) - of_process - timed
    assert {name: of_log[name] for name in same} == {name: of_run[name] for name in same}

    drawn = run.folder / "again.png"
    subprocess.run([*COGMAP, "log", "map", log, "-o", str(drawn)], check=True)
    assert drawn.read_bytes() == (run.folder / "map.png").read_bytes()


def test_the_summary_comes_as_json_too(start: Callable[..., Run]) -> None:
    run = start("--lockstep", "--laps", "0.02", "--no-record", "--json")
    assert run.end() == 0, run.output()
    assert json.loads(run.output().splitlines()[-1])["completed"]


def test_ctrl_c_ends_a_drive_cleanly(start: Callable[..., Run]) -> None:
    run = start()
    run.wait_for(DRIVING)
    run.process.send_signal(signal.SIGINT)
    assert run.end() == 130, run.output()
    assert run.summary()["ended_by"] == "interrupted"
    assert (run.folder / "log.mcap").read_bytes().endswith(b"\x89MCAP0\r\n")
    assert "Traceback" not in run.output() + "".join(
        log.read_text() for log in run.folder.glob("*.log")
    )
    assert processes_at(run.endpoint) == []


def test_nothing_is_left_of_a_launcher_that_is_killed(start: Callable[..., Run]) -> None:
    run = start()
    run.wait_for(DRIVING)
    assert len(processes_at(run.endpoint)) > 7
    run.process.kill()
    run.end()
    wait_until(lambda: processes_at(run.endpoint) == [])
    assert (run.folder / "log.mcap").read_bytes().endswith(b"\x89MCAP0\r\n")


KILLED_TOGETHER = (
    ("sensory", "epam", "codelets-1", "global_workspace", "action"),
    ("workspace",),
    ("sim",),
    ("recorder", "router"),
)


@pytest.fixture
def commands() -> Iterator[Callable[[str], list[MotorCommand]]]:
    """Gives the list, which grows, of the commands at an endpoint that move the robot's wheels."""
    ended = threading.Event()
    shells = []
    threads = []

    def listen(endpoint: str) -> list[MotorCommand]:
        moving: list[MotorCommand] = []
        keep = Module("listener").on(
            topics.MOTOR_COMMAND, lambda command: command.halted_by or moving.append(command)
        )
        shells.append(Shell(keep, ZenohBus(endpoint, "agent")))
        shells[-1].open()
        threads.append(threading.Thread(target=work, args=shells[-1:]))
        threads[-1].start()
        return moving

    def work(shell: Shell) -> None:
        while not ended.is_set():
            shell.spin_once(0.05)

    yield listen
    ended.set()
    for thread in threads:
        thread.join()
    for shell in shells:
        shell.close()


def test_whatever_is_killed_is_restarted_and_the_robot_drives_again(
    start: Callable[..., Run], commands: Callable[[str], list[MotorCommand]]
) -> None:
    before = shared_memory()
    run = start("--laps", "3", "--time-limit", "100")
    run.wait_for(DRIVING)
    moving = commands(run.endpoint)
    for together in KILLED_TOGETHER:
        run.kill(*together)
        enough = len(moving) + 5
        wait_until(lambda enough=enough: len(moving) >= enough)
    run.process.send_signal(signal.SIGINT)
    assert run.end() == 130, run.output()
    summary = run.summary()
    assert summary["restarts"] == {
        instance: 1 for together in KILLED_TOGETHER for instance in together
    }
    assert (run.folder / "log-2.mcap").read_bytes().endswith(b"\x89MCAP0\r\n")
    assert processes_at(run.endpoint) == []
    assert shared_memory() <= before
    check_free(run.endpoint)


def test_a_router_and_a_module_of_ones_own_take_part(
    start: Callable[..., Run], router: str, tmp_path: Path
) -> None:
    theirs = ["--lockstep", "--laps", "0.02", "--router", router, "--without", "global_workspace"]
    run = start(*theirs)
    run.wait_for("waiting for global_workspace")
    assert run.pid_of("router") is None
    config = str(run.folder / "config.toml")
    ours = [*COGMAP, "module", "global_workspace", "--connect", router, "--config", config]
    with subprocess.Popen(ours) as module:
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
        yield endpoint
        process.terminate()


def test_a_full_disk_ends_a_drive_at_once_with_the_reason(start: Callable[..., Run]) -> None:
    run = start("--laps", "3", file_limit_bytes=LOG_LIMIT_BYTES)
    assert run.end() == 1, run.output()
    summary = run.summary()
    assert summary["ended_by"] == "module failed"
    assert summary["reason"].startswith("recorder has ended: cannot write ")
    assert "Traceback" not in run.output()
    assert processes_at(run.endpoint) == []


def test_a_port_in_use_is_one_sentence_and_code_2(
    start: Callable[..., Run], tmp_path: Path
) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        run = start("--connect", endpoint)
        assert run.end() == 2
    assert run.output().startswith(f"cogmap: cannot listen at {endpoint}")
    assert len(run.output().splitlines()) == 1
    assert not run.folder.exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--set", "sim.sed=2"], "unknown key 'sed' in [sim]: did you mean 'seed'?"),
        (["--set", "action.cruise_m_s=fast"], "[action] Expected `float`, got `str`"),
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
