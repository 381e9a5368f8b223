"""Processes that a fork server starts: real ones."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from cogmap.bus.session import free_endpoint
from cogmap.cli.launch.command_line import cogmap_command, environment
from cogmap.cli.launch.forking.client import Forked, ForkServer
from cogmap.cli.launch.supervisor import Program, Supervisor
from tests.support.system.processes import wait_until

TIMEOUT_S = 30.0

Fork = Callable[..., Forked]


@pytest.fixture
def server() -> Iterator[ForkServer]:
    with ForkServer() as server:
        yield server


@pytest.fixture
def fork(server: ForkServer, tmp_path: Path) -> Fork:
    """Forks a process that prints to the file `log`."""

    def fork(*arguments: str) -> Forked:
        with (tmp_path / "log").open("ab") as log:
            return server.fork(arguments, log.fileno())

    return fork


def router(endpoint: str) -> list[str]:
    return ["router", "--tied", "--connect", endpoint]


def listens(log: Path, times: int = 1) -> bool:
    return log.exists() and log.read_text().count("router listens") == times


def is_running(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


def test_a_forked_process_has_its_own_log_and_exit_code(fork: Fork, tmp_path: Path) -> None:
    code = fork("module", "nothing").wait(TIMEOUT_S)

    assert code == 2
    assert (tmp_path / "log").read_text().startswith("cogmap: no module 'nothing'")


def test_a_forked_process_shows_the_command_line_it_stands_for(fork: Fork, tmp_path: Path) -> None:
    arguments = router(free_endpoint())
    forked = fork(*arguments)
    wait_until(lambda: listens(tmp_path / "log"), "the router is up")
    shown = Path(f"/proc/{forked.pid}/cmdline").read_text().rstrip("\0 ")

    assert shown.split("\0") == cogmap_command(*arguments)
    assert os.getsid(forked.pid) == forked.pid


def test_the_signal_that_ended_a_forked_process_is_its_code(fork: Fork, tmp_path: Path) -> None:
    killed = fork(*router(free_endpoint()))
    asked = fork(*router(free_endpoint()))
    wait_until(lambda: listens(tmp_path / "log", times=2), "both are up")

    killed.kill()
    asked.terminate()

    assert killed.wait(TIMEOUT_S) == -signal.SIGKILL
    assert asked.wait(TIMEOUT_S) == 0


def test_a_tied_process_ends_with_its_standard_input(fork: Fork, tmp_path: Path) -> None:
    forked = fork(*router(free_endpoint()))
    wait_until(lambda: listens(tmp_path / "log"), "the router is up")

    forked.stdin.close()

    assert forked.wait(TIMEOUT_S) == 0


def test_what_a_fork_server_had_forked_ends_with_it(fork: Fork, server: ForkServer) -> None:
    pid = fork(*router(free_endpoint())).pid

    server.close()

    wait_until(lambda: not is_running(pid), "it ends")


def test_what_a_fork_server_had_started_runs_on_where_it_is_killed(
    server: ForkServer, tmp_path: Path
) -> None:
    command = cogmap_command(*router(free_endpoint()))
    log = tmp_path / "router.log"
    supervisor = Supervisor(tmp_path, server)
    supervisor.start(Program("router", lambda starts: command))
    wait_until(lambda: listens(log), "the router is up")
    first = supervisor.children["router"].pid
    killed = server.pid

    os.kill(killed, signal.SIGKILL)

    def has_another() -> bool:
        supervisor.check()
        return server.pid != killed

    wait_until(has_another, "there is another fork server")
    assert is_running(first)
    assert supervisor.restarts == {}

    os.kill(first, signal.SIGKILL)

    def is_back() -> bool:
        supervisor.check()
        return listens(log, times=2)

    wait_until(is_back, "another router is up")
    assert server.is_alive
    assert supervisor.restarts == {"router": 1}
    supervisor.end(["router"], TIMEOUT_S)
    assert supervisor.killed == []


def test_a_process_is_asked_to_end_though_its_fork_server_was_killed(
    fork: Fork, server: ForkServer, tmp_path: Path
) -> None:
    forked = fork(*router(free_endpoint()))
    wait_until(lambda: listens(tmp_path / "log"), "the router is up")
    pid = forked.pid
    killed = server.pid
    os.kill(killed, signal.SIGKILL)

    def is_noticed() -> bool:
        assert forked.poll() is None
        return server.pid != killed

    wait_until(is_noticed, "the server's end is noticed")
    forked.terminate()

    forked.wait(TIMEOUT_S)
    assert not is_running(pid)


def test_a_fork_server_that_can_start_nothing_is_not_started_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "msgspec.py").write_text("raise ImportError('nothing works here')\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    command = cogmap_command("version")
    with ForkServer() as server:
        with (tmp_path / "log").open("ab") as log:
            lost = server.fork(command, log.fileno())

        assert lost.wait(TIMEOUT_S) == -signal.SIGKILL
        assert lost.pid == 0
        assert not server.is_alive


@pytest.fixture
def broken_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The reason for which no process can import OpenCV; a part of the modules needs it."""
    reason = "no pictures on this machine"
    (tmp_path / "cv2.py").write_text(f"raise ImportError({reason!r})\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return reason


def test_a_module_that_cannot_be_imported_names_the_reason(
    broken_library: str, fork: Fork, tmp_path: Path
) -> None:
    code = fork("module", "sensory").wait(TIMEOUT_S)

    assert code == 1
    last_line = (tmp_path / "log").read_text().splitlines()[-1]
    assert last_line == f"ImportError: {broken_library}"


def test_what_one_module_cannot_import_keeps_no_other_from_its_start(
    broken_library: str, fork: Fork, tmp_path: Path
) -> None:
    fork("module", "sensory").wait(TIMEOUT_S)
    endpoint = free_endpoint()
    fork(*router(endpoint))

    fork("module", "motor", "--tied", "--connect", endpoint)

    wait_until(lambda: "motor is ready" in (tmp_path / "log").read_text(), "it is ready")


def test_a_failed_import_fails_again_after_all_was_prepared(broken_library: str) -> None:
    script = (
        "from cogmap.cli.launch.forking.server import preparation\n"
        "from services import registry\n"
        "for _ in preparation(): pass\n"
        "import cogmap.services.motor.module\n"
        "registry.build('sensory', {})\n"
    )
    command = [sys.executable, "-c", script]
    run = subprocess.run(command, env=environment(), capture_output=True, text=True, check=False)

    assert run.stderr.splitlines()[-1] == f"ImportError: {broken_library}"


def test_a_held_module_joins_only_after_a_line(fork: Fork, tmp_path: Path) -> None:
    endpoint = free_endpoint()
    fork(*router(endpoint))
    options = ("--tied", "--connect", endpoint)

    def are_ready(*names: str) -> bool:
        log = (tmp_path / "log").read_text()
        ready = {name for name in ("action", "motor") if f"{name} is ready" in log}
        return ready == set(names)

    held = fork("module", "action", "--held", *options)
    fork("module", "motor", *options)
    wait_until(lambda: are_ready("motor"), "only the other is ready")

    os.write(held.stdin.fileno(), b"\n")

    wait_until(lambda: are_ready("action", "motor"), "both are ready")


def test_a_held_module_ends_with_its_standard_input(fork: Fork) -> None:
    held = fork("module", "action", "--held", "--tied", "--connect", free_endpoint())

    held.stdin.close()

    assert held.wait(TIMEOUT_S) == 0


def test_nothing_that_is_imported_before_a_fork_starts_a_thread() -> None:
    script = (
        "import os\n"
        "from cogmap.cli.launch.forking.server import preparation\n"
        "for _ in preparation(): pass\n"
        "print(len(os.listdir('/proc/self/task')))\n"
    )
    command = [sys.executable, "-c", script]
    run = subprocess.run(command, env=environment(), capture_output=True, text=True, check=True)

    assert run.stdout == "1\n"
