"""`cogmap run` as users run it: real processes, a real router, a short way."""

from __future__ import annotations

import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from cogmap.bus.session import check_free, free_endpoint
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from schemas import topics
from schemas.sensing import MotorCommand

COGMAP = [sys.executable, "-m", "cli.main"]
POOLS = ("sem.mp-", "sem.loky-", "joblib_")
TIMEOUT_S = 60.0


def processes_at(endpoint: str, words: str = "") -> list[int]:
    """Every process with `endpoint`, and `words`, in its command line."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            command = (entry / "cmdline").read_bytes().decode(errors="replace")
            state = (entry / "stat").read_text().rpartition(")")[2].split()[0]
        except (OSError, IndexError):
            continue
        if entry.name.isdigit() and endpoint in command and words in command and state != "Z":
            found.append(int(entry.name))
    return found


def shared_memory() -> set[Path]:
    """Files in shared memory, but for those of pools of processes, which no module uses."""
    return {path for path in Path("/dev/shm").iterdir() if not path.name.startswith(POOLS)}


def wait_until(condition: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < deadline_s, "it never happened"
        select.select([], [], [], 0.02)


class Run:
    """A `cogmap run` in a new folder, without a terminal."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        self.folder, self.endpoint = folder, free_endpoint()
        command = [*COGMAP, "run", "--out", str(folder), "--connect", self.endpoint, *arguments]
        self._output = folder.with_suffix(".txt").open("w+")
        self.process = subprocess.Popen(command, stdout=self._output, stderr=subprocess.STDOUT)

    def output(self) -> str:
        return Path(self._output.name).read_text()

    def end(self) -> int:
        return self.process.wait(TIMEOUT_S)

    def wait_for(self, sentence: str) -> None:
        def said() -> bool:
            assert self.process.poll() is None, self.output()
            return sentence in self.output()

        wait_until(said)

    def pid_of(self, instance: str) -> int | None:
        """The process of a module's instance, or of the router or the recorder; None where it does
        not run.
        """
        words = {"router": "\0router\0", "recorder": "\0log\0record\0"}.get(
            instance, f"\0--instance\0{instance}\0"
        )
        return next(iter(processes_at(self.endpoint, words)), None)

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.terminate()
            self.end()
        self._output.close()


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Run]]:
    runs: list[Run] = []

    def start(*arguments: str) -> Run:
        runs.append(Run(tmp_path / f"run-{len(runs)}", *arguments))
        return runs[-1]

    yield start
    for run in runs:
        run.close()


def test_a_short_drive_ends_by_itself_and_leaves_a_log_a_map_and_a_summary(
    start: Callable[..., Run],
) -> None:
    run = start("--lockstep", "--laps", "0.05", "--codelets", "2")
    assert run.end() == 0, run.output()
    summary = json.loads((run.folder / "summary.json").read_text())
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
    run.wait_for("path integration alone")
    run.process.send_signal(signal.SIGINT)
    assert run.end() == 130, run.output()
    assert json.loads((run.folder / "summary.json").read_text())["ended_by"] == "interrupted"
    assert (run.folder / "log.mcap").read_bytes().endswith(b"\x89MCAP0\r\n")
    assert "Traceback" not in run.output() + "".join(
        log.read_text() for log in run.folder.glob("*.log")
    )
    assert processes_at(run.endpoint) == []


def test_nothing_is_left_of_a_launcher_that_is_killed(start: Callable[..., Run]) -> None:
    run = start()
    run.wait_for("path integration alone")
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
    """Gives the list of the commands that move the wheels of the robot at an endpoint, which grows."""
    ended = threading.Event()
    shells = []
    threads = []

    def listen(endpoint: str) -> list[MotorCommand]:
        heard: list[MotorCommand] = []
        keep = Module("listener").on(
            topics.MOTOR_COMMAND, lambda command: command.halted_by or heard.append(command)
        )
        shells.append(Shell(keep, ZenohBus(endpoint, "agent")))
        shells[-1].open()
        threads.append(threading.Thread(target=work, args=shells[-1:]))
        threads[-1].start()
        return heard

    def work(shell: Shell) -> None:
        while not ended.is_set():
            shell.spin_once(0.05)

    yield listen
    ended.set()
    for thread in threads:
        thread.join()
    for shell in shells:
        shell.close()


def test_whatever_is_killed_is_started_again_and_the_robot_is_moved_on(
    start: Callable[..., Run], commands: Callable[[str], list[MotorCommand]]
) -> None:
    before = shared_memory()
    run = start("--laps", "3", "--time-limit", "100")
    run.wait_for("path integration alone")
    heard = commands(run.endpoint)
    for together in KILLED_TOGETHER:
        pids = {instance: run.pid_of(instance) for instance in together}
        for pid in pids.values():
            os.kill(pid, signal.SIGKILL)
        wait_until(
            lambda pids=pids: all(run.pid_of(name) not in (pid, None) for name, pid in pids.items())
        )
        enough = len(heard) + 5
        wait_until(lambda enough=enough: len(heard) >= enough)
    run.process.send_signal(signal.SIGINT)
    assert run.end() == 130, run.output()
    summary = json.loads((run.folder / "summary.json").read_text())
    assert summary["restarts"] == {
        instance: 1 for together in KILLED_TOGETHER for instance in together
    }
    assert (run.folder / "log-2.mcap").read_bytes().endswith(b"\x89MCAP0\r\n")
    assert processes_at(run.endpoint) == []
    assert shared_memory() <= before
    check_free(run.endpoint)


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
