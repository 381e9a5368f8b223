"""`cogmap topic`, `node`, `graph` and `doctor` on a running system, as users run them."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest

from cogmap import Client, Module, topics
from cogmap.schemas.base import Message
from cogmap.schemas.examples import example_messages
from cogmap.schemas.sensing import MotorCommand, Odometry
from cogmap.services import registry
from tests.support.system.networks import routed

TIMEOUT_S = 30.0
PERIOD_NS = 20_000_000
TEXT_FOR_A_NUMBER = '{"left_wheel_rad_s": "x", "right_wheel_rad_s": 1}'
ODOMETRY = '{"speed_m_s": 1, "turn_rate_rad_s": 0, "dt_s": 0.02}'
EXAMPLES = {topics.of(message): message for message in example_messages()}


class Robot:
    """Publishes odometry and self-motion 50 times a second, and keeps the commands it receives."""

    def __init__(self) -> None:
        self.commands: list[MotorCommand] = []
        self.got_command = threading.Event()

    def module(self) -> Module:
        """The robot as the module `sim`."""
        module = Module("sim")
        module.every(PERIOD_NS, self._odometry, emits=[topics.ODOMETRY])
        module.every(PERIOD_NS, self._self_motion, emits=[topics.SELF_MOTION])
        return module.on(topics.MOTOR_COMMAND, self._on_command)

    def _odometry(self, now_ns: int) -> Odometry:
        return Odometry(speed_m_s=1.5, turn_rate_rad_s=0.0, dt_s=0.02, stamp_ns=now_ns)

    def _self_motion(self, now_ns: int) -> Message:
        return EXAMPLES[topics.SELF_MOTION]

    def _on_command(self, command: MotorCommand) -> None:
        self.commands.append(command)
        self.got_command.set()


@pytest.fixture(scope="module")
def endpoint() -> Iterator[str]:
    with routed() as address:
        yield address


@pytest.fixture(scope="module")
def robot(endpoint: str) -> Iterator[Robot]:
    robot = Robot()
    with Client(robot.module(), endpoint):
        yield robot


def start(endpoint: str, *arguments: str) -> subprocess.Popen[str]:
    """A command, whose router is at `endpoint`."""
    return subprocess.Popen(
        [sys.executable, "-m", "cogmap.cli.main", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"COGMAP_CONNECT": endpoint},
    )


def printed(endpoint: str, *arguments: str, code: int = 0) -> tuple[str, str]:
    """What a command prints, to its output and its errors."""
    process = start(endpoint, *arguments)
    output, errors = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == code, errors
    return output, errors


def await_line(process: subprocess.Popen[str], words: str) -> None:
    """Read what a process prints until a line has `words` in it."""
    assert process.stdout is not None
    line = process.stdout.readline()
    while line and words not in line:
        line = process.stdout.readline()
    assert words in line, "it has ended"


def test_list_names_the_topics_in_use(robot: Robot, endpoint: str) -> None:
    output, _ = printed(endpoint, "topic", "list", "-t")

    assert output.splitlines() == [
        "odometry [Odometry]",
        "sensory/motion [SelfMotion]",
        "motor/command [MotorCommand]",
        "health [Health]",
    ]


def test_info_names_the_processes(robot: Robot, endpoint: str) -> None:
    output, _ = printed(endpoint, "topic", "info", "-v", "odometry")

    publisher = "Process name: sim\nModule: sim\nEndpoint type: PUBLISHER"
    assert "Type: Odometry" in output
    assert f"Publisher count: 1\n\n{publisher}" in output
    assert "Subscription count: 0" in output


def test_echo_prints_so_many_messages_and_ends(robot: Robot, endpoint: str) -> None:
    output, _ = printed(endpoint, "topic", "echo", "odometry", "-n", "3", "--json")

    messages = [json.loads(line) for line in output.splitlines()]
    first = messages[0]["seq"]
    assert [message["seq"] for message in messages] == [first, first + 1, first + 2]
    assert [message["speed_m_s"] for message in messages] == [1.5, 1.5, 1.5]


def test_echo_prints_what_is_asked_for_or_says_that_nothing_came(
    robot: Robot, endpoint: str
) -> None:
    words = ("topic", "echo", "odometry", "--once", "--flow-style", "--field", "speed_m_s")
    output, _ = printed(endpoint, *words, "--filter", "speed_m_s > 1 and source == sim")
    _, errors = printed(endpoint, *words, "--filter", "speed_m_s > 2", "--timeout", "0.5", code=1)

    assert output == "1.5\n---\n"
    assert "no message of odometry to print in 0.5 s" in errors


@pytest.mark.parametrize(
    ("command", "metric"),
    [("hz", "average rate: "), ("bw", "/s from "), ("delay", "average delay: ")],
)
def test_ctrl_c_ends_with_the_metrics(
    robot: Robot, endpoint: str, command: str, metric: str
) -> None:
    process = start(endpoint, "topic", command, "sensory/motion")
    await_line(process, metric)

    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=TIMEOUT_S)

    assert (process.returncode, errors) == (0, "")
    assert metric in output


def test_pub_is_obeyed(robot: Robot, endpoint: str) -> None:
    robot.got_command.clear()
    written = '{"left_wheel_rad_s": 1.5, "right_wheel_rad_s": 2}'

    printed(endpoint, "topic", "pub", "-t", "2", "-r", "20", "motor/command", written)

    assert robot.got_command.wait(TIMEOUT_S)
    (command, *_) = robot.commands
    assert (command.left_wheel_rad_s, command.right_wheel_rad_s) == (1.5, 2.0)
    assert command.source.startswith("cli-")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("pub", "-1", "motor/command", TEXT_FOR_A_NUMBER), "got `str` - at"),
        (("pub", "-1", "odometry", ODOMETRY), "sim publishes odometry already"),
        (("echo", "odometri"), "did you mean 'odometry'?"),
        (("echo", "odometry", "--field", "speed"), "no 'speed'"),
        (("echo", "workspace/snapshot"), "answered on request"),
        (("hz", "odometry", "-w", "many"), "Invalid value for '-w'"),
    ],
)
def test_what_the_user_can_mend_is_a_sentence_and_exit_code_2(
    robot: Robot, endpoint: str, arguments: tuple[str, ...], sentence: str
) -> None:
    output, errors = printed(endpoint, "topic", *arguments, code=2)

    assert output == ""
    assert sentence in errors
    assert "Traceback" not in errors


def test_no_router_is_a_sentence_and_exit_code_2() -> None:
    _, errors = printed("tcp/127.0.0.1:1", "topic", "list", code=2)

    assert errors.startswith("cogmap: no router at tcp/127.0.0.1:1 within 5 s: start one")
    assert errors.count("\n") == 1


def test_graph_shows_the_process_and_its_topics(robot: Robot, endpoint: str) -> None:
    output, _ = printed(endpoint, "graph", "--json")

    (sim,) = json.loads(output)
    assert sim["process"] == "sim"
    assert sim["subscribes"] == ["motor/command"]
    assert sim["publishes"] == ["odometry", "sensory/motion", "health"]


def test_node_info_shows_what_a_process_does_and_how_it_fares(robot: Robot, endpoint: str) -> None:
    names, _ = printed(endpoint, "node", "list")
    output, _ = printed(endpoint, "node", "info", "sim", "--json")

    facts = json.loads(output)
    assert names == "sim\n"
    assert facts["subscribes"] == {"motor/command": "MotorCommand"}
    assert facts["health"]["ready"]


def test_doctor_names_what_is_missing_and_what_is_off_its_rate(robot: Robot, endpoint: str) -> None:
    output, _ = printed(endpoint, "doctor", "--json", code=1)

    findings = json.loads(output)
    about = {finding["about"] for finding in findings}
    words = " ".join(f"{finding['about']}: {finding['wrong']}" for finding in findings)
    assert {*registry.MODULES} - {"sim", "player"} <= about
    assert "odometry: " in words  # on a busy machine it is part of what is said of that
    assert "sensory/motion: " in words
    assert "sim" not in about
