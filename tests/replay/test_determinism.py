"""The whole system in one process, in lockstep: what it says depends on its seed alone."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from cogmap.bus.codec import decode, encode
from schemas import topics
from schemas.codelets import Proposal
from schemas.graph import Delta
from schemas.topics import Delivery, Scope
from tests.support.reference import Said, drive, graph

FRAMES = 8
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def first() -> Said:
    """A drive with one worker."""
    return drive(FRAMES)


def _deltas(said: Said) -> list[Delta]:
    messages = [decode(topics.DELTA, payload) for payload in said[topics.DELTA.name]]
    return [message for message in messages if isinstance(message, Delta)]


def _check_that_all_is_the_same(left: Said, right: Said, but: frozenset[str] = frozenset()) -> None:
    assert left.keys() == right.keys()
    assert [name for name in left if name not in but and left[name] != right[name]] == []


def test_a_drive_says_something_on_every_topic_of_the_model_and_of_the_truth(first: Said) -> None:
    spoken = {topic.name for topic in topics.ALL if topic.delivery is not Delivery.ON_REQUEST}
    processes = {topic.name for topic in topics.ALL if topic.scope is Scope.PROCESS}
    # No loop closes on so short a path, and nobody offers anything.
    assert set(first) == spoken - processes - {topics.REPLAY.name, topics.OFFER.name}
    assert len(first[topics.MOTOR_COMMAND.name]) == FRAMES


def test_a_drive_recognises_objects_and_moves(first: Said) -> None:
    learned = graph(_deltas(first))
    assert [name for name in learned.nodes if name.startswith("object:")]
    assert learned.agent is not None
    assert learned.agent.x_m > 0.1


def test_two_lockstep_drives_of_one_seed_give_the_same_bytes_on_every_topic(first: Said) -> None:
    _check_that_all_is_the_same(first, drive(FRAMES))


def test_another_process_with_other_hashes_of_strings_says_the_same(first: Said) -> None:
    script = (
        "import sys; from tests.support import reference; "
        "sys.stdout.buffer.write(b''.join(reference.drive(3)['motor/command']))"
    )
    environment = os.environ | {"PYTHONHASHSEED": "4711", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, check=True
    )
    assert done.stdout == b"".join(first[topics.MOTOR_COMMAND.name][:3])


def test_another_seed_gives_another_drive(first: Said) -> None:
    other = drive(2, seed=2)
    for topic in (topics.STEREO, topics.ODOMETRY, topics.TRUE_TOWN):
        assert other[topic.name][0] != first[topic.name][0]


def test_three_workers_give_the_bytes_of_one_on_every_topic_but_proposals(first: Said) -> None:
    three = drive(FRAMES, workers=3)
    _check_that_all_is_the_same(first, three, frozenset({topics.PROPOSAL.name}))
    workers = {proposal.source for proposal in _proposals(three)}
    assert workers == {"codelets-1", "codelets-2", "codelets-3"}
    assert graph(_deltas(three)).digest() == graph(_deltas(first)).digest()


def test_proposals_of_three_workers_differ_in_source_and_number_alone(
    first: Said,
) -> None:
    three = drive(3, workers=3)
    ours = {_without_source(proposal) for proposal in _proposals(three)}
    assert ours <= {_without_source(proposal) for proposal in _proposals(first)}


def _proposals(said: Said) -> list[Proposal]:
    decoded = [decode(topics.PROPOSAL, payload) for payload in said[topics.PROPOSAL.name]]
    return [proposal for proposal in decoded if isinstance(proposal, Proposal)]


def _without_source(proposal: Proposal) -> bytes:
    return encode(msgspec.structs.replace(proposal, source="", seq=0))
