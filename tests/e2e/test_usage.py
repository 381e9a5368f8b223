"""What the user can mend is one sentence that names it and the remedy, and exit code 2, whatever
the command.
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import pytest
import zenoh

from cogmap.bus.discovery import discover
from cogmap.bus.session import free_endpoint, open_client
from tests.support.system.networks import routed
from tests.support.system.processes import wait_until

TIMEOUT_S = 30.0
NO_ROUTER = "tcp/127.0.0.1:1"
FREE = "tcp/127.0.0.1:0"
SYN_SENT = "02"
"""A connection that is asked for, in /proc/net/tcp (the kernel's `TCP_SYN_SENT`)."""

REFERENCE = Path(__file__).parents[1] / "replay" / "reference.mcap"


def start(
    *arguments: str, output: int | IO[str] = subprocess.PIPE, **environment: str
) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "cogmap.cli.main", *arguments]
    env = os.environ | environment
    return subprocess.Popen(command, stdout=output, stderr=subprocess.PIPE, text=True, env=env)


def sentence_of(process: subprocess.Popen[str]) -> str:
    """What a command that ends with code 2 prints, in one line and nothing else."""
    output, errors = process.communicate(timeout=TIMEOUT_S)

    assert process.returncode == 2, output + errors
    assert output == ""
    assert errors.count("\n") == 1, errors
    assert errors.startswith("cogmap: ")
    return errors


@pytest.fixture(scope="module")
def endpoint() -> Iterator[str]:
    with routed() as address:
        yield address


@pytest.mark.parametrize(
    ("arguments", "named", "remedy"),
    [
        (
            ["module", "workspace", "--set", "workspace.deca=0.1"],
            "unknown key 'deca'",
            "did you mean 'decay'?",
        ),
        (
            ["module", "workspace", "--set", "workspac.decay=0.1"],
            "[workspac]",
            "did you mean 'workspace'?",
        ),
        (
            ["module", "workspace", "--set", "workspace.decay=lots"],
            "`workspace.decay`",
            "Expected `float`, got `str`",
        ),
        (
            ["module", "workspace", "--set", "workspace.decay=2"],
            "`workspace.decay`",
            "Expected `float` <= 1",
        ),
        (["module", "action", "--agent", "a/b"], "--agent 'a/b'", "letters, digits, '.', '-'"),
        (["module", "action", "--instance", "a/b"], "--instance 'a/b'", "letters, digits, '.'"),
        (["module", "action", "--state", "/proc/x"], "/proc/x/action", "folder with --state"),
        (["module", "workspace", "--set", "decay"], "--set decay", "write it as module.key=value"),
        (
            ["module", "workspace", "--config", "nowhere.toml"],
            "nowhere.toml",
            "name one that exists",
        ),
        (["module", "workspace", "--config", "/"], "cannot read / as TOML", "Is a directory"),
        (["module", "memory-of-tomorrow"], "'memory-of-tomorrow'", "there are sim, player"),
        (
            ["module", "workspace", "--connect", "localhost"],
            "'localhost'",
            "write it as tcp/HOST:PORT",
        ),
        (
            ["module", "workspace", "--state", "/dev/null/x", "--connect", NO_ROUTER],
            "/dev/null/x",
            "with --state",
        ),
        (["router", "--connect", "tcp/127.0.0.1:99999"], "99999", "a port of at most 65535"),
        (["run", "--out", "/dev/null/x", "--connect", FREE], "/dev/null/x", "another with --out"),
        (["run", "--town", "blocks", "--laps", "2"], "--laps", "leave it out"),
        (
            ["run", "--set", "procedural.schemes=nowhere.toml", "--connect", FREE],
            "nowhere.toml",
            "name one that exists",
        ),
        (["run", "--memory", "/etc/passwd", "--connect", FREE], "/etc/passwd", "move it away"),
        (["topic", "list", "--agent", "a/b"], "'a/b'", "use letters, digits"),
        (["module", "sim", "--agent", "a/b"], "'a/b'", "use letters, digits"),
        (["topic", "echo", "clok"], "'clok'", "did you mean 'clock'?"),
        (
            ["log", "info", "nowhere.mcap"],
            "nowhere.mcap",
            "name a file that `cogmap log record` wrote",
        ),
        (
            ["log", "record", "-o", "/dev/null/x.mcap", "--connect", "ROUTER"],
            "/dev/null/x.mcap",
            "in a folder that can be written to",
        ),
        (["router", "--connect", "ROUTER"], "ROUTER", "choose another port with --connect"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_what_is_wrong_is_named_with_the_remedy(
    endpoint: str, arguments: list[str], named: str, remedy: str
) -> None:
    given = [argument.replace("ROUTER", endpoint) for argument in arguments]

    sentence = sentence_of(start(*given))

    assert named.replace("ROUTER", endpoint) in sentence
    assert remedy in sentence


def test_whoever_finds_no_router_within_five_seconds_names_it(tmp_path: Path) -> None:
    log = tmp_path / "log.mcap"
    commands = (
        ["module", "workspace"],
        ["module", "codelets"],
        ["log", "record", "-o", str(log)],
        ["topic", "hz", "clock"],
        ["graph"],
    )
    expected = f"cogmap: no router at {NO_ROUTER} within 5 s: start one with `cogmap run`"

    processes = [start(*command, "--connect", NO_ROUTER) for command in commands]

    for process in processes:
        assert sentence_of(process).startswith(expected)
    assert not log.exists()


@pytest.fixture
def busy_port() -> Iterator[int]:
    """A port where something listens that has no room for another connection, so that whoever
    connects to it waits.
    """
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen(0)
        with socket.create_connection(listener.getsockname()):
            yield listener.getsockname()[1]


@pytest.mark.parametrize(
    "command",
    [
        ["topic", "list", "--connect", "BUSY"],
        ["topic", "echo", "clock", "--connect", "BUSY"],
        ["graph", "--connect", "BUSY"],
        ["module", "action", "--connect", "BUSY"],
        ["run", "--out", "RUN", "--router", "BUSY"],
    ],
    ids=lambda command: command[0],
)
def test_ctrl_c_ends_whoever_waits_for_a_router_before_it_gives_up(
    command: list[str], busy_port: int, tmp_path: Path
) -> None:
    values = {"BUSY": f"tcp/127.0.0.1:{busy_port}", "RUN": str(tmp_path / "run")}
    process = start(*(values.get(argument, argument) for argument in command))
    wait_until(lambda: is_awaited(busy_port), "it waits for a router")
    process.send_signal(signal.SIGINT)

    assert process.wait(TIMEOUT_S) == 130
    assert "no router" not in process.communicate()[1]


def is_awaited(port: int) -> bool:
    """Whether a connection to `port` is asked for and not answered yet.

    Python can lose a Ctrl-C that comes earlier, while a process imports its modules.
    """
    connections = Path("/proc/net/tcp").read_text().splitlines()[1:]
    states = {(fields[2].split(":")[1], fields[3]) for fields in map(str.split, connections)}
    return (f"{port:04X}", SYN_SENT) in states


def test_a_full_disk_and_an_ascii_terminal_are_a_sentence() -> None:
    with Path("/dev/full").open("w") as full:
        onto_full_disk = start("config", output=full)
        _, errors = onto_full_disk.communicate(timeout=TIMEOUT_S)
    assert onto_full_disk.returncode == 2
    assert errors == (
        "cogmap: cannot write the output (No space left on device): make room there, or write "
        "elsewhere\n"
    )

    ascii_only = start("log", "summary", str(REFERENCE), PYTHONIOENCODING="ascii")
    _, errors = ascii_only.communicate(timeout=TIMEOUT_S)
    assert ascii_only.returncode == 2
    assert errors == (
        "cogmap: the output is encoded as ascii, which has no '\\xb2': set PYTHONIOENCODING=utf-8\n"
    )


@pytest.mark.parametrize("arguments", [("config",), ("log", "cat", str(REFERENCE))])
def test_a_reader_that_has_seen_enough_gets_no_error(arguments: tuple[str, ...]) -> None:
    process = start(*arguments)
    assert process.stdout is not None
    process.stdout.close()
    assert process.stderr is not None

    assert process.stderr.read() == ""
    assert process.wait(TIMEOUT_S) == 0


def wait_for_processes(session: zenoh.Session, names: set[str]) -> None:
    """Return once processes of all `names` are on the bus."""
    deadline_s = time.monotonic() + TIMEOUT_S
    seen: set[str] = set()
    while not names <= seen and time.monotonic() < deadline_s:
        system = discover(session, "agent")
        seen = {process.name for process in system.processes}
    assert names <= seen


def test_a_router_that_ends_is_named_by_whoever_watches_a_topic() -> None:
    endpoint = free_endpoint()
    router = start("router", "--connect", endpoint)
    session = open_client(endpoint, TIMEOUT_S)
    echo = start("topic", "echo", "clock", "--connect", endpoint)
    hz = start("topic", "hz", "clock", "--connect", endpoint)
    try:
        wait_for_processes(session, {"cli-topic-echo", "cli-topic-hz"})
    finally:
        session.close()  # type: ignore[no-untyped-call]
        router.terminate()
        router.communicate(timeout=TIMEOUT_S)

    for process in (echo, hz):
        _, errors = process.communicate(timeout=TIMEOUT_S)
        assert process.returncode == 2
        assert errors.startswith(f"cogmap: no router at {endpoint} for 5 s: start one with")
