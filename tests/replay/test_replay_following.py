"""Replaying a module that follows the graph: the log's own deltas give it the graph it had."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.errors import LogError
from cogmap.graph.graph import Graph
from cogmap.recording.recorder import Recorder
from cogmap.recording.replaying.outcome import Report
from cogmap.recording.replaying.replay import replay_into
from cogmap.recording.selection import to_record
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.graph import Delta, Phase, Snapshot
from cogmap.schemas.nodes import Node
from cogmap.schemas.sensing import MotorCommand


def build(name: str, sections: dict[str, Any], instance: str) -> Module:
    """A module whose every output depends on the whole graph that it follows."""
    graph = Graph()

    def command() -> MotorCommand:
        digest = graph.digest()
        content = int(digest[:4], 16) % 1000
        return MotorCommand(left_wheel_rad_s=content, right_wheel_rad_s=graph.version)

    return Module(name, instance).following(
        graph, lambda delta: command(), [topics.MOTOR_COMMAND], on_load=command
    )


class Session:
    """A workspace, modules that follow it, and a recorder, on the in-memory bus."""

    def __init__(self) -> None:
        self.network = MemoryNetwork()
        self._shells: list[Shell] = []
        self._recorder: Recorder | None = None
        self.restart_workspace()

    def record(self, path: Path) -> None:
        about = {"config": json.dumps({})}
        self._recorder = Recorder(MemoryBus(self.network), path, to_record(), about)
        self._recorder.open()

    def restart_workspace(self) -> None:
        """Start the workspace, or start it anew, with nothing in its graph."""
        if self._shells:
            self._settle()
            self._workspace.close()
            self._shells.remove(self._workspace)
        self.graph = Graph()
        module = Module("workspace", emits={topics.DELTA})
        module.serve(topics.SNAPSHOT_REQUEST, topics.SNAPSHOT, self._snapshot)
        self._workspace = self.enter(module)

    def enter(self, module: Module) -> Shell:
        shell = Shell(module, MemoryBus(self.network), health=False)
        shell.open()
        self._shells.append(shell)
        return shell

    def follow(self, instance: str) -> Shell:
        return self.enter(build("follower", {}, instance))

    def commit(self, number: int, activation: float = 0.5) -> None:
        for _ in range(number):
            version = self.graph.version + 1
            node = Node(id=f"building-{version}", kind="thing", activation=activation)
            delta = Delta(version=version, cycle=1, phase=Phase.OBJECTS, operations=[node])
            self.graph.apply(delta)
            self._workspace.publish(self._workspace.module.stamp(delta))
            self._settle()

    def end(self) -> None:
        self._settle()
        assert self._recorder is not None
        self._recorder.close()

    def _settle(self) -> None:
        for shell in self._shells:
            while shell.spin_once():
                pass

    def _snapshot(self, request: object) -> Snapshot:
        return self.graph.snapshot()


def replay(path: Path) -> Report:
    return replay_into(path, ["follower"], build)


def test_followers_replay_alike_whenever_they_joined(path: Path) -> None:
    session = Session()
    session.record(path)
    session.follow("follower-1")
    session.commit(5)
    session.follow("follower-2")
    session.commit(5)
    session.follow("follower-3")
    session.commit(5)
    session.end()

    report = replay(path)

    assert report.same, report.first
    assert [outcome.same for outcome in report.outcomes] == [15, 11, 6]


def test_a_follower_of_a_workspace_that_began_anew_replays_alike(path: Path) -> None:
    session = Session()
    session.record(path)
    session.follow("follower-1")
    session.commit(5)
    session.restart_workspace()
    session.commit(8, activation=0.9)
    session.follow("follower-2")
    session.commit(2)
    session.end()

    report = replay(path)

    assert report.same, report.first
    assert [outcome.same for outcome in report.outcomes] == [16, 3]


def test_a_log_without_the_deltas_of_a_loaded_graph_is_refused(path: Path) -> None:
    session = Session()
    session.commit(5)
    session.record(path)
    session.follow("follower-1")
    session.commit(5)
    session.end()

    with pytest.raises(LogError, match="at version 5, and the log does not hold every delta"):
        replay(path)


def test_a_log_without_the_first_deltas_of_a_follower_is_refused(path: Path) -> None:
    session = Session()
    session.follow("follower-1")
    session.commit(5)
    session.record(path)
    session.commit(5)
    session.end()

    with pytest.raises(LogError, match="the log lacks the deltas 1 to 5: record from the start"):
        replay(path)
