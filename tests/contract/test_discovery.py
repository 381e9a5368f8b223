"""Who publishes and subscribes what, as the processes announce it."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from cogmap.bus.discovery import Process, Role, System, discover, read, use_key
from cogmap.bus.interface import Answer, Member
from cogmap.bus.session import open_client
from cogmap.cli.graph import to_dot, to_json, to_tree
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.topics import Scope
from cogmap.services import registry
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
    assert system.unknown_topics() == []


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
    assert names(system, Role.PUBLISHES, topics.TRUE_POSE) == ["player", "sim"]
    for topic in TRUTH:
        assert names(system, Role.SUBSCRIBES, topic) == []


NAMED = ["cogmap/agent/@session/aa/sim/sim", "cogmap/agent/@session/bb/recorder/recorder"]
USED = [
    "cogmap/agent/@use/aa/publisher/odometry",
    "cogmap/agent/@use/cc/publisher/odometry",
    "cogmap/agent/@use/bb/subscriber/truth/pose",
    "cogmap/agent/@use/own/subscriber/truth/pose",
    "cogmap/agent/@use/aa/publisher/odometry_v2",
    "cogmap/agent/@use/aa/listener/odometry",
]
READY = ["cogmap/agent/@ready/sim/sim", "cogmap/agent/@ready/action/rust"]


@pytest.fixture
def system() -> System:
    return read("agent", NAMED, USED, READY, "own")


def test_processes_that_are_unnamed_keep_their_id(system: System) -> None:
    unnamed, _ = system.doing(Role.PUBLISHES, topics.ODOMETRY)

    assert names(system, Role.PUBLISHES, topics.ODOMETRY) == ["?cc", "sim"]
    assert unnamed == Process("cc")


def test_whoever_is_ready_is_found_without_a_name_for_its_session(system: System) -> None:
    found = [process.name for process in system.processes]

    assert found == ["?cc", "recorder", "rust", "sim"]


def test_whoever_asks_is_not_counted(system: System) -> None:
    assert names(system, Role.SUBSCRIBES, topics.TRUE_POSE) == ["recorder"]


def test_topics_of_another_version_are_named_and_its_roles_ignored(system: System) -> None:
    assert system.unknown_topics() == ["odometry_v2"]
    assert len(system.uses) == 4


def test_more_processes_than_a_channel_holds_by_default_are_found(over_zenoh: OverZenoh) -> None:
    publisher = over_zenoh.join()
    tokens = []
    for number in range(300):
        key = use_key(over_zenoh.agent, f"z{number}", Role.PUBLISHES.value, topics.ODOMETRY.name)
        tokens.append(publisher.session.liveliness().declare_token(key))
    meet(over_zenoh.join(), publisher)

    found = names(discovered(over_zenoh), Role.PUBLISHES, topics.ODOMETRY)

    assert len(found) == len(tokens)


@pytest.mark.parametrize("show", [to_tree, to_json, to_dot])
def test_the_graph_shows_every_process_and_what_it_does(
    system: System, show: Callable[[System], str]
) -> None:
    shown = show(system)

    assert all(name in shown for name in ("sim", "recorder", "?cc", "odometry", "truth/pose"))


def test_an_empty_graph_is_a_sentence() -> None:
    empty = read("agent")

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
