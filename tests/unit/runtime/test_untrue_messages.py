"""Whatever is published that makes sense and is not true, the agent drives on, and it is named."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from msgspec import UNSET
from msgspec.structs import replace

from cogmap.bus.codec import decode, encode
from cogmap.graph.graph import Graph
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta
from cogmap.schemas.topics import Scope, Topic
from tests.support.world.liar import Deceived

FAR = 2**60
NUMBERS = ("stamp_ns", "cycle", "version", "base_version", "frame")
# What no module of this agent receives: observers do.
UNHEARD = {topics.TRUE_POSE, topics.TRUE_TOWN, topics.STORED, topics.MOTOR_PROGRAM, topics.LEASES}
# Half an hour.
AHEAD = {"stamp_ns": 1800 * 10**9}


@pytest.fixture
def agent() -> Iterator[Deceived]:
    agent = Deceived()
    assert agent.drive(8) == 0
    yield agent
    agent.close()


def _stated(message: Message) -> list[str]:
    """The numbers that a message states."""
    return [name for name in NUMBERS if hasattr(message, name)]


def _told(agent: Deceived) -> list[Topic]:
    """The topics on which one may deceive a module."""
    return [topic for topic in agent.said if topic.scope is Scope.MODEL and topic not in UNHEARD]


def test_a_number_that_is_far_ahead_changes_nothing_and_is_named(agent: Deceived) -> None:
    for topic in _told(agent):
        for name in _stated(agent.last(topic)):
            agent.publish(replace(agent.last(topic), **{name: FAR}), in_its_name=False)
            assert agent.drive(1) == 0, f"{topic.name} {name}"

    refused = {name for shell in agent.shells.values() for name in shell.intake.rejected}
    assert refused == {topic.name for topic in _told(agent)}
    notes = "".join(note for shell in agent.shells.values() for note in shell.notes)
    assert "cannot be true" in notes


def _ahead(message: Message, name: str) -> Message:
    """A message whose number `name` is ahead, by no more than a process lets through."""
    number = getattr(message, name)
    return replace(message, **{name: number + AHEAD.get(name, 1000)})


def test_under_another_name_a_number_that_is_ahead_stops_no_drive(agent: Deceived) -> None:
    replaced = {topics.PERCEPTS}
    for topic in [*_told(agent), topics.LEASES]:
        for name in _stated(agent.last(topic)):
            agent.publish(_ahead(agent.last(topic), name), in_its_name=False)
            repeats = agent.drive(1)
            assert 0 <= repeats <= (topic in replaced), f"{topic.name} {name}"


def test_in_the_place_of_a_true_message_one_costs_a_repeated_view(agent: Deceived) -> None:
    for topic in [*_told(agent), topics.LEASES]:
        name = _stated(agent.last(topic))[-1]
        agent.publish(_ahead(agent.last(topic), name), in_its_name=True)
        assert agent.drive(2) in {0, 1, 2}, topic.name


def test_a_view_of_a_later_time_with_all_that_was_sensed_costs_one_repeated_view(
    agent: Deceived,
) -> None:
    for _ in range(3):
        for topic in (topics.CLOCK, topics.SELF_MOTION, topics.SCAN, topics.PERCEPTS):
            message = agent.last(topic)
            ahead = replace(message, stamp_ns=message.stamp_ns + AHEAD["stamp_ns"])
            agent.publish(ahead, in_its_name=False)
        assert agent.drive(2) in {0, 1, 2}


def test_a_delta_in_the_workspaces_name_is_a_fork_that_is_said_and_mended(agent: Deceived) -> None:
    last = agent.last(topics.DELTA)
    assert isinstance(last, Delta)
    forged = replace(last, version=last.version + 1, operations=[], lineage=UNSET)
    agent.publish(forged, in_its_name=True)
    assert agent.drive(3) in {0, 1}

    snapshot = agent.shells["workspace"].module.served[topics.SNAPSHOT_REQUEST][1]
    written = Graph()
    written.load(decode(topics.SNAPSHOT, encode(snapshot(None))))  # type: ignore[arg-type]
    for name, graph in agent.graphs().items():
        assert "fork" in "".join(agent.shells[name].notes)
        assert graph.digest() == written.digest()
