"""Processes that are started, die, and must end: real ones."""

from __future__ import annotations

import itertools
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from cogmap.cli.launch.supervisor import Program, Supervisor
from cogmap.errors import ProcessFailedError

TIMEOUT_S = 20.0


def python(instance: str, code: str) -> Program:
    return Program(instance, lambda starts: [sys.executable, "-c", code])


def wait_until(condition: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < deadline_s, "it never happened"
        select.select([], [], [], 0.01)


def is_running(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


@pytest.fixture
def supervisor(tmp_path: Path) -> Iterator[Supervisor]:
    supervisor = Supervisor(tmp_path)
    yield supervisor
    supervisor.end(list(supervisor.children), grace_s=0.0)


def said(folder: Path, instance: str) -> list[str]:
    return (folder / f"{instance}.log").read_text().splitlines()


def test_one_that_is_not_needed_may_fail(supervisor: Supervisor) -> None:
    command = [sys.executable, "-c", "import sys; sys.exit(2)"]
    supervisor.start(Program("window", lambda starts: command, is_needed=False))

    def is_given_up() -> bool:
        supervisor.check()
        return not supervisor.children

    wait_until(is_given_up)


def test_a_child_that_is_killed_is_started_again(supervisor: Supervisor, tmp_path: Path) -> None:
    supervisor.start(python("mind", "print('here', flush=True); import sys; sys.stdin.read()"))
    wait_until(lambda: said(tmp_path, "mind") == ["here"])
    first = supervisor.children["mind"].pid
    os.kill(first, signal.SIGKILL)

    def back() -> bool:
        supervisor.check()
        return said(tmp_path, "mind") == ["here", "here"]

    wait_until(back)
    assert supervisor.restarts == {"mind": 1}
    assert supervisor.children["mind"].pid != first


def test_each_restart_waits_longer_than_the_one_before(
    supervisor: Supervisor, tmp_path: Path
) -> None:
    supervisor.start(
        python("mind", "import time; print(time.monotonic(), flush=True); raise SystemExit(1)")
    )

    with pytest.raises(ProcessFailedError):
        wait_until(lambda: bool(supervisor.check()))

    times_s = [float(line) for line in said(tmp_path, "mind")]
    pauses_s = [later - earlier for earlier, later in itertools.pairwise(times_s)]
    assert pauses_s[2] > pauses_s[0] + 0.3


def test_a_child_that_ends_with_code_2_is_the_users_to_mend(supervisor: Supervisor) -> None:
    code = "import sys; print('cogmap: no such file: name one', file=sys.stderr); sys.exit(2)"
    supervisor.start(python("sim", code))

    with pytest.raises(ProcessFailedError, match=r"^sim has ended: no such file: name one$"):
        wait_until(lambda: bool(supervisor.check()))


def test_a_child_that_dies_again_and_again_fails_with_its_last_words(
    supervisor: Supervisor, tmp_path: Path
) -> None:
    supervisor.start(python("mind", "raise OSError(28, 'No space left on device')"))
    words = r"mind died 4 times .*mind.log are: OSError: \[Errno 28\] No space left on device$"

    with pytest.raises(ProcessFailedError, match=words):
        wait_until(lambda: bool(supervisor.check()))
    assert supervisor.restarts == {"mind": 3}


def test_a_child_that_does_not_listen_is_killed(supervisor: Supervisor, tmp_path: Path) -> None:
    ignore = "import signal, sys; signal.signal(signal.SIGTERM, signal.SIG_IGN)"
    supervisor.start(python("deaf", f"{ignore}; print('deaf', flush=True); sys.stdin.read()"))
    wait_until(lambda: said(tmp_path, "deaf") == ["deaf"])
    pid = supervisor.children["deaf"].pid
    supervisor.end(["deaf"], grace_s=0.1)

    assert supervisor.killed == ["deaf"]
    assert not is_running(pid)


def test_a_stopped_child_is_ended_all_the_same(supervisor: Supervisor, tmp_path: Path) -> None:
    supervisor.start(python("mind", "print('here', flush=True); import sys; sys.stdin.read()"))
    wait_until(lambda: said(tmp_path, "mind") == ["here"])
    pid = supervisor.children["mind"].pid

    os.kill(pid, signal.SIGSTOP)
    supervisor.end(["mind"], grace_s=0.1)

    assert not is_running(pid)


def held(instance: str) -> Program:
    """Prints `here` once it has read a line."""
    code = "import sys; sys.stdin.readline(); print('here', flush=True); sys.stdin.read()"
    command = [sys.executable, "-c", code]
    return Program(instance, lambda starts: command, is_held=True)


def test_a_child_that_died_while_held_is_held_again(supervisor: Supervisor, tmp_path: Path) -> None:
    supervisor.start(held("mind"))
    os.kill(supervisor.children["mind"].pid, signal.SIGKILL)

    def is_back() -> bool:
        supervisor.check()
        return supervisor.restarts["mind"] == 1

    wait_until(is_back)
    assert said(tmp_path, "mind") == []

    supervisor.release()

    wait_until(lambda: said(tmp_path, "mind") == ["here"])


def test_a_child_that_was_released_is_not_held_again(
    supervisor: Supervisor, tmp_path: Path
) -> None:
    supervisor.start(held("mind"))
    supervisor.release()
    wait_until(lambda: said(tmp_path, "mind") == ["here"])

    os.kill(supervisor.children["mind"].pid, signal.SIGKILL)

    def is_back() -> bool:
        supervisor.check()
        return said(tmp_path, "mind") == ["here", "here"]

    wait_until(is_back)


LAUNCHER = """
import pathlib, sys
from cogmap.cli.launch.command_line import cogmap_command
from cogmap.cli.launch.supervisor import Supervisor, Program
supervisor = Supervisor(pathlib.Path(sys.argv[1]))
for name, port in (("one", sys.argv[2]), ("two", sys.argv[3])):
    command = cogmap_command("router", "--tied", "--connect", f"tcp/127.0.0.1:{port}")
    supervisor.start(Program(name, lambda starts, command=command: command))
print(*[child.pid for child in supervisor.children.values()], flush=True)
sys.stdin.read()
"""


def free_ports() -> list[str]:
    ports = []
    with socket.socket() as one, socket.socket() as two:
        for each in (one, two):
            each.bind(("127.0.0.1", 0))
            _, port = each.getsockname()
            ports.append(str(port))
    return ports


def is_up(folder: Path, instance: str) -> bool:
    return any("listens" in line for line in said(folder, instance))


def test_no_child_outlives_a_launcher_that_is_killed(tmp_path: Path) -> None:
    command = [sys.executable, "-c", LAUNCHER, str(tmp_path), *free_ports()]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as launcher:
        assert launcher.stdout is not None
        one, two = [int(word) for word in launcher.stdout.readline().split()]
        wait_until(lambda: is_up(tmp_path, "one") and is_up(tmp_path, "two"))
        assert is_running(one)
        assert is_running(two)

        launcher.kill()
        launcher.wait()
        wait_until(lambda: not is_running(one) and not is_running(two))
