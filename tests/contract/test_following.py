"""What a module that follows the graph may rely on, over either bus."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from cogmap.bus.interface import Member
from cogmap.graph.graph import Graph
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta, DropNode, Link, Operation, Phase, SnapshotRequest
from cogmap.schemas.nodes import Node
from cogmap.schemas.sensing import MotorCommand
from cogmap.testing import odometry
from tests.support.system.networks import (
    TIMEOUT_S,
    Network,
    Peer,
    await_members,
    meet,
    next_health,
    publish,
    spin_until,
    working,
)


class Workspace:
    """Stands in for the workspace: the one that writes the graph, on a thread of its own."""

    def __init__(
        self,
        network: Network,
        graph: Graph | None = None,
        answers: bool = True,
        instance: str = "workspace",
    ) -> None:
        self.graph = Graph() if graph is None else graph
        self._observer = network.join()
        # In memory a query is answered on the thread of whoever asks.
        self._changing = threading.Lock()
        module = Module("workspace", instance, emits={topics.DELTA})
        if answers:
            module.serve(topics.SNAPSHOT_REQUEST, topics.SNAPSHOT, self._snapshot)
        self.shell = Shell(module, network.join(), health=False)

    def commit(self, number: int = 1, lost: bool = False) -> None:
        """Commit `number` deltas; those that are `lost` are not published."""
        for _ in range(number):
            self.shell.inbox.call(lambda: self._commit(lost))

    def settle(self) -> None:
        """Wait until every commit so far is published: who joins then receives none of them."""
        settled = threading.Event()
        self.shell.inbox.call(settled.set)
        assert settled.wait(TIMEOUT_S), "the commits take too long"

    @contextmanager
    def running(self, *others: Shell) -> Iterator[None]:
        """Run it; it answers, and what it publishes reaches the others, from now on."""
        with working(self.shell):
            await_members(self._observer, Member("workspace", self.shell.module.instance))
            meet(self.shell.bus, *(other.bus for other in others))
            yield

    def _commit(self, lost: bool) -> None:
        version = self.graph.version + 1
        operations = changes(version)
        delta = Delta(version=version, cycle=version, phase=Phase.OBJECTS, operations=operations)
        with self._changing:
            self.graph.apply(delta)

        numbered = self.shell.module.stamp(delta)
        if not lost:
            self.shell.publish(numbered)

    def _snapshot(self, request: SnapshotRequest) -> Message:
        with self._changing:
            return self.graph.snapshot()


def changes(version: int) -> list[Operation]:
    """Another node at every version, and every third forgotten again."""
    node = Node(id=f"building-{version}", kind="thing", activation=0.5)
    link = Link(source=node.id, target="self", kind="near")
    if version % 3:
        return [node, link]

    forgotten = DropNode(id=f"building-{version - 2}")
    return [node, link, forgotten]


def stopped(stamp_ns: int) -> MotorCommand:
    return MotorCommand(left_wheel_rad_s=0.0, right_wheel_rad_s=0.0, stamp_ns=stamp_ns)


class Followed:
    """A module that follows the graph, and the shell around it."""

    def __init__(self, network: Network, health: bool = False) -> None:
        self.graph = Graph()
        self.versions: list[int] = []
        self.loads: list[int] = []
        module = Module("follower").following(
            self.graph, self._on_delta, [topics.MOTOR_COMMAND], self._on_load
        )
        self.shell = Shell(module, network.join(), health=health)

    def catch_up(self, workspace: Workspace, version: int) -> None:
        """Spin until both are at `version`."""
        spin_until(lambda: workspace.graph.version == version, self.shell)
        spin_until(lambda: self.graph.version == version, self.shell)

    def agrees_with(self, workspace: Workspace) -> bool:
        here = self.graph.digest()
        there = workspace.graph.digest()
        return here == there

    def _on_delta(self, delta: Delta) -> MotorCommand:
        assert self.graph.version >= delta.version
        self.versions.append(delta.version)
        return stopped(delta.version)

    def _on_load(self) -> None:
        version = self.graph.version
        self.loads.append(version)


@pytest.fixture
def follower(network: Network) -> Iterator[Followed]:
    follower = Followed(network)
    yield follower
    follower.shell.close()


def test_a_follower_has_the_graph_of_the_workspace(network: Network, follower: Followed) -> None:
    workspace = Workspace(network)
    follower.shell.open()

    with workspace.running(follower.shell):
        workspace.commit(20)
        follower.catch_up(workspace, 20)

    assert follower.agrees_with(workspace)
    assert follower.versions == list(range(1, 21))
    assert follower.loads == []


def test_a_follower_that_joins_late_begins_with_a_snapshot(
    network: Network, follower: Followed
) -> None:
    workspace = Workspace(network)

    with workspace.running():
        workspace.commit(10)
        workspace.settle()
        follower.shell.open()
        assert follower.graph.version == 10

        meet(workspace.shell.bus, follower.shell.bus)
        workspace.commit(5)
        follower.catch_up(workspace, 15)

    assert follower.agrees_with(workspace)
    assert follower.versions == list(range(11, 16))
    assert follower.loads == [10]


def test_a_follower_that_misses_deltas_is_mended(network: Network, follower: Followed) -> None:
    workspace = Workspace(network)
    follower.shell.open()

    with workspace.running(follower.shell):
        workspace.commit(3)
        workspace.commit(4, lost=True)
        workspace.commit(3)
        follower.catch_up(workspace, 10)

    assert follower.agrees_with(workspace)
    assert len(follower.loads) == 1
    assert dict(follower.shell.intake.gaps) == {"workspace/delta": 4}


def test_a_gap_without_an_answer_is_mended_once_there_is_one(
    network: Network, follower: Followed
) -> None:
    silent = Workspace(network, answers=False)
    follower.shell.open()

    with silent.running(follower.shell):
        silent.commit(2)
        silent.commit(1, lost=True)
        silent.commit(2)
        spin_until(lambda: follower.shell.intake.received["workspace/delta"] == 4, follower.shell)
        assert follower.graph.version == 2
        assert follower.versions == [1, 2]

        answering = Module("workspace", "answering").serve(
            topics.SNAPSHOT_REQUEST, topics.SNAPSHOT, lambda request: silent.graph.snapshot()
        )
        with working(Shell(answering, network.join(), health=False)):
            follower.catch_up(silent, 5)

    assert follower.agrees_with(silent)


def test_a_follower_that_restarts_has_the_graph_again(network: Network) -> None:
    workspace = Workspace(network)
    first = Followed(network)
    first.shell.open()

    with workspace.running(first.shell):
        workspace.commit(6)
        first.catch_up(workspace, 6)
        first.shell.close()
        workspace.commit(6)
        workspace.settle()

        second = Followed(network)
        second.shell.open()
        meet(workspace.shell.bus, second.shell.bus)
        workspace.commit(6)
        second.catch_up(workspace, 18)

    assert second.agrees_with(workspace)
    second.shell.close()


def graph_at(version: int) -> Graph:
    """A graph of so many commits that changed nothing."""
    graph = Graph()
    for number in range(1, version + 1):
        graph.apply(Delta(version=number, cycle=number, phase=Phase.END, operations=[]))
    return graph


@pytest.mark.parametrize("kept", [5, 8, 0], ids=["all kept", "one more kept", "nothing kept"])
def test_a_workspace_that_restarts_is_followed(
    network: Network, follower: Followed, kept: int
) -> None:
    before = Workspace(network)
    follower.shell.open()
    with before.running(follower.shell):
        before.commit(5)
        follower.catch_up(before, 5)

    after = Workspace(network, graph_at(kept))
    with after.running(follower.shell):
        after.commit(3)
        follower.catch_up(after, kept + 3)

    assert follower.agrees_with(after)
    assert len(follower.loads) == 1


def test_deltas_of_another_source_are_refused_and_named(
    network: Network, follower: Followed
) -> None:
    workspace = Workspace(network)
    follower.shell.open()
    stranger = network.join()
    stranger.declare(topics.DELTA)
    meet(stranger, follower.shell.bus)
    with workspace.running(follower.shell):
        workspace.commit(2)
        follower.catch_up(workspace, 2)

        forged = Delta(source="stranger", version=3, cycle=3, phase=Phase.OBJECTS, operations=[])
        publish(stranger, forged)
        spin_until(lambda: bool(follower.shell.intake.rejected), follower.shell)
        workspace.commit(2)
        follower.catch_up(workspace, 4)

    assert follower.agrees_with(workspace)
    assert follower.shell.intake.rejected == {"workspace/delta": 1}
    assert follower.shell.notes == ["1 deltas came of another source than workspace"]


def test_a_workspace_of_another_name_is_followed_once_the_first_is_gone(
    network: Network, follower: Followed
) -> None:
    first = Workspace(network)
    follower.shell.open()
    with first.running(follower.shell):
        first.commit(2)
        follower.catch_up(first, 2)

    second = Workspace(network, instance="workspace-2")
    with second.running(follower.shell):
        second.commit(3)
        follower.catch_up(second, 3)
        spin_until(lambda: follower.agrees_with(second), follower.shell)


def test_a_delta_is_applied_before_any_later_message_is_received(network: Network) -> None:
    graph = Graph()
    seen: list[int] = []
    module = Module("follower").following(graph)
    module.on(topics.ODOMETRY, lambda odometry: seen.append(graph.version))
    follower = Shell(module, network.join(), health=False)
    workspace = Workspace(network)
    sim = network.join()
    sim.declare(topics.ODOMETRY)
    follower.open()

    with workspace.running(follower):
        meet(sim, follower.bus)
        for version in range(1, 6):
            workspace.commit()
            spin_until(lambda: graph.version == version, follower)  # noqa: B023
            publish(sim, odometry(version - 1))
            spin_until(lambda: len(seen) == version, follower)  # noqa: B023

    assert seen == [1, 2, 3, 4, 5]
    follower.close()


def test_a_snapshot_is_named_among_the_causes(network: Network, follower: Followed) -> None:
    workspace = Workspace(network)
    peer = Peer(network.join(), topics.MOTOR_COMMAND)

    with workspace.running():
        workspace.commit(4)
        workspace.settle()
        follower.shell.open()
        meet(workspace.shell.bus, follower.shell.bus)
        meet(follower.shell.bus, peer.bus)
        workspace.commit(1)
        follower.catch_up(workspace, 5)

    (arrival,) = peer.take(1)
    assert arrival.envelope is not None
    assert arrival.envelope.causes == [
        ("workspace/snapshot", "workspace", 4),
        ("workspace/delta", "workspace", 4),
    ]


def test_health_reports_a_graph_that_is_behind(network: Network) -> None:
    follower = Followed(network, health=True)
    silent = Workspace(network, answers=False)
    peer = Peer(network.join(), topics.HEALTH)
    follower.shell.open()
    meet(follower.shell.bus, peer.bus)

    with silent.running(follower.shell):
        silent.commit(1)
        silent.commit(1, lost=True)
        silent.commit(1)
        spin_until(lambda: bool(follower.shell.notes), follower.shell)
        health = next_health(peer, follower.shell)

    assert health.notes == [
        "the graph stays at version 1: deltas are missing "
        "and no snapshot is to be had from the workspace"
    ]
    follower.shell.close()
