"""Somebody who speaks in the others' names, poses as a worker or starts one too many: said, and the
agent goes on.
"""

from __future__ import annotations

from collections.abc import Iterator

import msgspec
import pytest
import zenoh

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.interface import Member
from cogmap.bus.session import open_client, ready_key
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Proposal
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.topics import Topic
from cogmap.testing import percepts, self_motion
from tests.support.system.live import Feeder, Witness
from tests.support.system.processes import AGENT, System, wait_until

Agent = tuple[System, Feeder, Witness]
FAR = 2**61
BLOCK = zenoh.CongestionControl.BLOCK


class Liar:
    """A stranger on the bus who holds no incarnation, and publishes under any name."""

    def __init__(self, system: System) -> None:
        self.session = open_client(system.endpoint)
        bus = system.bus()
        self.numbers = {each.source: each.number for each in bus.incarnations()}
        bus.close()

    def lie(self, source: str, message: Message, incarnation: int, seq: int) -> None:
        topic = topics.of(message)
        told = msgspec.structs.replace(message, source=source, seq=seq)
        envelope = Envelope(source, seq, incarnation, 1, 1)
        key = topic.key(AGENT)
        self.session.put(key, encode(told), attachment=encode(envelope), congestion_control=BLOCK)

    def close(self) -> None:
        self.session.close()  # type: ignore[no-untyped-call]


@pytest.fixture
def liar(agent: Agent) -> Iterator[Liar]:
    system, _, _ = agent
    stranger = Liar(system)
    yield stranger
    stranger.close()


def goes_on(agent: Agent) -> None:
    """Let the agent drive, and find the same graph everywhere."""
    _, feeder, witness = agent
    witness.await_cycles(5)
    feeder.pause()
    witness.await_same_graph()


def test_lies_in_the_names_of_all_are_refused_and_silence_nobody(agent: Agent, liar: Liar) -> None:
    _, _, witness = agent
    delta = Delta(version=1, cycle=1, phase=Phase.END, operations=[])
    told = {"workspace": [delta], "feeder": [self_motion(1), percepts(1)]}
    for source, messages in told.items():
        for message in messages:
            liar.lie(source, message, incarnation=FAR, seq=0)
            liar.lie(source, message, incarnation=liar.numbers[source], seq=FAR)

    def are_counted() -> bool:
        health = witness.health.get("workspace")
        seen = {} if health is None else health.rejected
        of_feeder = [seen.get(topic.name, 0) for topic in (topics.SELF_MOTION, topics.PERCEPTS)]
        of_workspace = witness.shell.intake.rejected[topics.DELTA.name]
        return [*of_feeder, of_workspace] == [2, 2, 2]

    goes_on(agent)
    wait_until(are_counted, "each lie is counted")
    assert not witness.health["workspace"].gaps
    assert not witness.shell.intake.gaps


def _rejected(witness: Witness, topic: Topic) -> int:
    """How many messages of a topic the workspace has rejected."""
    health = witness.health.get("workspace")
    return 0 if health is None else health.rejected.get(topic.name, 0)


def test_a_strangers_answers_to_all_tasks_are_refused(agent: Agent, liar: Liar) -> None:
    _, _, witness = agent
    cycle = witness.deltas[-1].cycle
    for ahead in range(100):
        for codelet in ("localization", "road_place"):
            task = f"{cycle + ahead}/{codelet}"
            answer = Proposal(task_id=task, codelet=codelet, base_version=0)
            liar.lie("codelets-1", answer, incarnation=FAR, seq=ahead)

    goes_on(agent)
    wait_until(
        lambda: _rejected(witness, topics.PROPOSAL) >= 200,
        "the answers are counted",
    )


def test_a_worker_that_is_only_a_token_is_said_and_does_no_harm(agent: Agent, liar: Liar) -> None:
    _, _, witness = agent
    token = liar.session.liveliness().declare_token(ready_key(AGENT, Member("codelets", "ghost")))

    def is_named() -> bool:
        health = witness.health.get("workspace")
        return health is not None and any("codelets/ghost" in note for note in health.notes)

    wait_until(is_named, "the workspace names the ghost")
    goes_on(agent)

    token.undeclare()
    wait_until(lambda: not is_named(), "the ghost is gone")


def test_a_second_workspace_ends_with_a_sentence_and_the_first_continues(agent: Agent) -> None:
    system, _, _ = agent

    system.start("second", "module", "workspace", "--instance", "second", "--agent", AGENT)
    second = system.processes["second"]
    wait_until(lambda: second.exit_code is not None, "the second ends")

    assert second.exit_code == 2
    assert "workspace, started at 20" in second.lines()[-1]
    assert "a second workspace would contradict it" in second.lines()[-1]
    goes_on(agent)
