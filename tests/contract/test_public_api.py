"""`import cogmap` is all of the library that a module of one's own or a notebook needs."""

from __future__ import annotations

import ast
import inspect
import os
import subprocess
import sys
from pathlib import Path

import pytest

import cogmap
from cogmap import api
from cogmap.bus.interface import Member
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.nodes import Node
from cogmap.schemas.sensing import MotorCommand, Odometry
from cogmap.testing import odometry
from tests.support.includes import ROOT
from tests.support.reference import REFERENCE
from tests.support.system.networks import OverZenoh, Peer, await_members, publish

OURS = {"benchmarks", "cogmap", "tests"}
PUBLIC = {"cogmap", "cogmap.services.registry"}
MESSAGES = "cogmap.schemas"
ODOMETRY = cogmap.topics.ODOMETRY
MOTOR_COMMAND = cogmap.topics.MOTOR_COMMAND


def imported(path: Path) -> set[str]:
    """The modules of ours, without those of messages, that a file imports."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        match node:
            case ast.Import():
                names.update(alias.name for alias in node.names)
            case ast.ImportFrom(module="cogmap.services" as package):
                names.update(f"{package}.{alias.name}" for alias in node.names)
            case ast.ImportFrom(module=str(module)):
                names.add(module)

    ours = {name for name in names if name.partition(".")[0] in OURS}
    return {name for name in ours if not name.startswith(MESSAGES)}


def test_the_public_names_are_those_of_the_api() -> None:
    listed = dir(cogmap)

    assert set(api.__all__) <= set(listed)
    for name in api.__all__:
        assert getattr(cogmap, name) is getattr(api, name)


@pytest.mark.parametrize("name", api.__all__)
def test_a_public_name_is_documented(name: str) -> None:
    assert inspect.getdoc(getattr(cogmap, name))


def test_a_name_that_is_not_public_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'cogmap' has no attribute 'Shell'"):
        _ = cogmap.Shell


def test_importing_the_package_imports_nothing_heavy() -> None:
    program = "import cogmap, sys; print(*sys.modules)"
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )

    loaded = set(run.stdout.split())
    assert "cogmap" in loaded
    assert not {"numpy", "zenoh", "mcap", "cogmap.api"} & loaded


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.py")), ids=lambda p: p.name)
def test_an_example_imports_only_what_is_public(path: Path) -> None:
    assert imported(path) <= PUBLIC


def stop(message: Message) -> MotorCommand:
    return MotorCommand(left_wheel_rad_s=0.0, right_wheel_rad_s=0.0, stamp_ns=message.stamp_ns)


def test_modules_run_in_one_process() -> None:
    def begin() -> list[Odometry]:
        return [odometry(0), odometry(0, speed_m_s=2.0)]

    commands: list[MotorCommand] = []
    sim = cogmap.Module("sim").on_start(begin, {"action": 1}, [ODOMETRY])
    action = cogmap.Module("action").on(ODOMETRY, stop, [MOTOR_COMMAND])
    observer = cogmap.Module("observer").on(MOTOR_COMMAND, commands.append)

    with cogmap.InProcessRunner([sim, action, observer]) as runner:
        runner.run()

    assert [command.seq for command in commands] == [0, 1]


def test_a_notebook_follows_the_graph_of_a_running_system(over_zenoh: OverZenoh) -> None:
    workspace = over_zenoh.join()
    workspace.declare(cogmap.topics.DELTA)
    peer = Peer(over_zenoh.join(), MOTOR_COMMAND)
    graph = cogmap.Graph()
    node = Node(id="object:house", kind="thing")
    delta = Delta(version=1, cycle=1, phase=Phase.OBJECTS, operations=[node], source="workspace")

    module = cogmap.Module("notebook").following(graph, stop, [MOTOR_COMMAND])
    with cogmap.Client(module, over_zenoh.endpoint, over_zenoh.agent):
        await_members(workspace, Member("notebook", "notebook"))
        publish(workspace, delta)
        peer.wait_for(1)

    assert graph.version == 1
    assert list(graph.nodes) == ["object:house"]


def test_a_notebook_joins_where_the_environment_says(
    over_zenoh: OverZenoh, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COGMAP_CONNECT", over_zenoh.endpoint)
    monkeypatch.setenv("COGMAP_AGENT", over_zenoh.agent)
    peer = over_zenoh.join()

    with cogmap.Client(cogmap.Module("notebook")):
        await_members(peer, Member("notebook", "notebook"))


def test_an_agent_of_the_environment_that_cannot_be_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("COGMAP_AGENT", "a/b")

    with pytest.raises(cogmap.UsageError, match=r"\$COGMAP_AGENT 'a/b': use letters"):
        cogmap.Client(cogmap.Module("notebook"))


def test_a_module_runs_where_the_environment_says(over_zenoh: OverZenoh) -> None:
    program = "from cogmap import Module, run_module; run_module(Module('lodger'))"
    places = {"COGMAP_CONNECT": over_zenoh.endpoint, "COGMAP_AGENT": over_zenoh.agent}
    peer = over_zenoh.join()
    process = subprocess.Popen([sys.executable, "-c", program], env=os.environ | places)
    try:
        await_members(peer, Member("lodger", "lodger"))
    finally:
        process.terminate()
        process.wait()


def test_a_log_is_read_with_its_graph() -> None:
    log = cogmap.open_log(REFERENCE)

    commands = list(log.messages("motor/command"))
    graph = log.graph_at(log.duration_s)

    assert isinstance(commands[0].message, MotorCommand)
    assert graph.version > 0
