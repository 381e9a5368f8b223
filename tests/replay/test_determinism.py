"""The whole system in one process, in lockstep: what it publishes depends on its seed alone."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from cogmap.bus.codec import decode, encode
from cogmap.graph.graph import Graph
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta
from cogmap.schemas.topics import Delivery, Topic
from cogmap.testing import of_type
from tests.support.reference import COMPARED, Published, drive, graph

FRAMES = 8
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def first() -> Published:
    """A drive with one worker."""
    return drive(FRAMES)


def _messages(published: Published, topic: Topic) -> list[Message]:
    payloads = published[topic.name]
    return [decode(topic, payload) for payload in payloads]


def _graph(published: Published) -> Graph:
    """What the deltas of a drive make."""
    messages = _messages(published, topics.DELTA)
    deltas = of_type(Delta, messages)
    return graph(deltas)


def _check_that_all_is_the_same(
    left: Published, right: Published, but: frozenset[str] = frozenset()
) -> None:
    assert left.keys() == right.keys()
    compared = left.keys() - but
    differing = [name for name in compared if left[name] != right[name]]
    assert differing == []


def test_a_drive_publishes_on_every_topic_of_the_model_and_of_the_truth(first: Published) -> None:
    expected = {topic.name for topic in COMPARED if topic.delivery is not Delivery.ON_REQUEST}
    # No loop closes on so short a path, no map was learned before or is stored so soon, no street
    # is closed, nobody carries the robot, nothing is a recording, and there is no energy unless it
    # is switched on.
    expected -= {topics.REPLAY.name, topics.ENERGY.name, topics.STREET_CLOSURE.name}
    expected -= {topics.RESET.name}
    expected -= {topics.STORED.name, topics.RESTORED.name, topics.PLAYBACK.name}

    assert set(first) == expected
    assert len(first[topics.MOTOR_COMMAND.name]) == FRAMES


def test_a_drive_recognises_objects_and_moves(first: Published) -> None:
    learned = _graph(first)

    assert [name for name in learned.nodes if name.startswith("object:")]
    assert learned.agent is not None
    assert learned.agent.x_m > 0.1


def test_two_lockstep_drives_of_one_seed_give_the_same_bytes_on_every_topic(
    first: Published,
) -> None:
    second = drive(FRAMES)

    _check_that_all_is_the_same(first, second)


def test_another_process_with_other_hashes_of_strings_gives_the_same(first: Published) -> None:
    script = (
        "import sys; from tests.support import reference; "
        "sys.stdout.buffer.write(b''.join(reference.drive(3)['motor/command']))"
    )
    environment = os.environ | {"PYTHONHASHSEED": "4711", "PYTHONPATH": str(ROOT)}

    done = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, check=True
    )

    commands = first[topics.MOTOR_COMMAND.name]
    assert done.stdout == b"".join(commands[:3])


def test_another_seed_gives_another_drive(first: Published) -> None:
    other = drive(2, seed=2)

    for name in ("camera/stereo", "odometry", "truth/town"):
        assert other[name][0] != first[name][0]


def test_three_workers_give_the_bytes_of_one_on_every_topic_but_proposals(
    first: Published,
) -> None:
    three = drive(FRAMES, workers=3)

    _check_that_all_is_the_same(first, three, frozenset({topics.PROPOSAL.name}))
    workers = {proposal.source for proposal in _messages(three, topics.PROPOSAL)}
    assert workers == {"codelets-1", "codelets-2", "codelets-3"}
    assert _graph(three).digest() == _graph(first).digest()


def test_proposals_of_three_workers_differ_in_source_and_number_alone(first: Published) -> None:
    three = drive(3, workers=3)

    proposals = _proposals_without_source(three)
    assert proposals
    assert proposals <= _proposals_without_source(first)


def _proposals_without_source(published: Published) -> set[bytes]:
    """The bytes of the proposals of a drive, as if one worker had made them all as its first."""
    contents = set()
    for proposal in _messages(published, topics.PROPOSAL):
        content = msgspec.structs.replace(proposal, source="", seq=0)
        contents.add(encode(content))
    return contents
