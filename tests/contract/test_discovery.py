"""Who publishes and subscribes what, as the router reports it."""

from __future__ import annotations

import json
from collections.abc import Callable

import pytest

from cli.graph import to_dot, to_json, to_tree
from cogmap.bus.discovery import Process, Role, System, discover, read
from cogmap.bus.interface import Answer, Member
from cogmap.bus.session import open_client
from cogmap.runtime.shell import Shell
from schemas import topics
from schemas.topics import Scope
from services import registry
from tests.support.system.networks import TIMEOUT_S, OverZenoh, Peer, meet

TRUTH = [topic for topic in topics.ALL if topic.scope is Scope.TRUTH]


def discovered(network: OverZenoh) -> System:
    session = open_client(network.endpoint)
    system = discover(session, network.agent)
    session.close()
    return system


def names(system: System, role: Role, topic: topics.Topic) -> list[str]:
    processes = system.doing(role, topic)
    return [process.name for process in processes]


def start_three(over_zenoh: OverZenoh) -> None:
    """A simulator, a workspace and a worker, each with its topics, as the router knows them."""
    sim = over_zenoh.join()
    sim.declare(topics.ODOMETRY)
    sim.declare(topics.VIEW)
    sim.announce(Member("sim", "sim"))

    workspace = over_zenoh.join()
    Peer(workspace, topics.ODOMETRY)
    workspace.serve(topics.SNAPSHOT_REQUEST, topics.SNAPSHOT, Answer, lambda job: job())
    workspace.announce(Member("workspace", "workspace"))

    worker = over_zenoh.join()
    Peer(worker, topics.ODOMETRY)
    worker.announce(Member("codelets", "codelets-2"))
    meet(over_zenoh.join(), sim, workspace, worker)


def test_every_process_is_found_by_name_with_all_that_it_does(over_zenoh: OverZenoh) -> None:
    start_three(over_zenoh)

    system = discovered(over_zenoh)

    assert names(system, Role.PUBLISHES, topics.ODOMETRY) == ["sim"]
    assert names(system, Role.PUBLISHES, topics.VIEW) == ["sim"]
    assert names(system, Role.SUBSCRIBES, topics.ODOMETRY) == ["codelets-2", "workspace"]
    assert names(system, Role.SUBSCRIBES, topics.VIEW) == []
    assert names(system, Role.ANSWERS, topics.SNAPSHOT_REQUEST) == ["workspace"]
    assert system.topics() == [topics.ODOMETRY, topics.VIEW, topics.SNAPSHOT_REQUEST]
    assert system.foreign_keys() == []


def test_no_module_subscribes_to_the_truth(over_zenoh: OverZenoh) -> None:
    # A follower that joins waits for a workspace that is there and, as here, does not run.
    workspace_last = sorted(registry.MODULES, key="workspace".__eq__)
    buses = [over_zenoh.join() for _ in workspace_last]
    for name, bus in zip(workspace_last, buses, strict=True):
        module = registry.build(name, {"sim": {"egl": False}})
        Shell(module, bus).open()
    meet(over_zenoh.join(), *buses)

    system = discovered(over_zenoh)

    found = {process.member.module for process in system.processes if process.member}
    assert found >= set(registry.MODULES)
    assert names(system, Role.PUBLISHES, topics.TRUE_POSE) == ["sim"]
    for topic in TRUTH:
        assert names(system, Role.SUBSCRIBES, topic) == []


TOKENS = [
    "cogmap/agent/@session/aa/sim/sim",
    "cogmap/agent/@session/bb/recorder/recorder",
]


def fact(router: str, role: str, key: str, *zids: str) -> tuple[str, bytes]:
    """What a router's admin space answers of the clients `zids`."""
    sessions = {"routers": [], "peers": [], "clients": zids}
    return f"@/{router}/router/{role}/{key}", json.dumps(sessions).encode()


FACTS = [
    ("@/r1/router", b'{"zid": "r1"}'),
    ("@/r1/router/linkstate/north", b"graph {}"),
    ("@/r1/router/metrics", b"\x1f\x8b"),
    fact("r1", "publisher", "cogmap/agent/odometry", "aa"),
    fact("r2", "publisher", "cogmap/agent/odometry", "cc"),
    fact("r1", "subscriber", "cogmap/agent/truth/**", "bb", "own"),
    fact("r1", "subscriber", "cogmap/other/odometry", "dd"),
    fact("r1", "publisher", "cogmap/agent/odometry_v2", "aa"),
]


@pytest.fixture
def system() -> System:
    return read("agent", TOKENS, FACTS, "own")


def test_the_facts_of_several_routers_are_merged_and_unnamed_keep_their_id(
    system: System,
) -> None:
    unnamed, _ = system.doing(Role.PUBLISHES, topics.ODOMETRY)

    assert names(system, Role.PUBLISHES, topics.ODOMETRY) == ["?cc", "sim"]
    assert unnamed == Process("cc")


def test_a_wildcard_counts_for_each_topic_and_the_asker_for_none(system: System) -> None:
    for topic in (topics.TRUE_POSE, topics.TRUE_TOWN):
        assert names(system, Role.SUBSCRIBES, topic) == ["recorder"]
    assert names(system, Role.SUBSCRIBES, topics.ODOMETRY) == []


def test_keys_that_are_no_topics_are_named(system: System) -> None:
    assert system.foreign_keys() == ["cogmap/agent/odometry_v2"]


@pytest.mark.parametrize("show", [to_tree, to_json, to_dot])
def test_the_graph_shows_every_process_and_what_it_does(
    system: System, show: Callable[[System], str]
) -> None:
    shown = show(system)

    assert all(name in shown for name in ("sim", "recorder", "?cc", "odometry", "truth/pose"))


def test_an_empty_graph_is_a_sentence() -> None:
    empty = read("agent", [], [])

    assert to_tree(empty) == "no process of 'agent' is on the bus"


def test_a_process_that_left_is_not_found(over_zenoh: OverZenoh) -> None:
    watcher = over_zenoh.join()
    leaver = over_zenoh.join()
    leaver.declare(topics.ODOMETRY)
    meet(watcher, leaver)
    gone = Peer(watcher)
    watcher.watch(lambda member, alive: gone.inbox.call(lambda: None) if not alive else None)
    leaver.close()
    assert gone.inbox.take(TIMEOUT_S) is not None

    assert names(discovered(over_zenoh), Role.PUBLISHES, topics.ODOMETRY) == []
