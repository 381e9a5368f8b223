"""A stranger's bytes on every topic while the modules run: counted and named, and nothing else
changes.
"""

from __future__ import annotations

import re
import time
from collections import Counter

import pytest
import zenoh

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.session import open_client
from cogmap.errors import NoAnswerError
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.topics import Delivery, Topic
from cogmap.services import registry
from tests.support.damage import damaged, golden
from tests.support.system.live import Feeder, Witness
from tests.support.system.networks import working
from tests.support.system.processes import AGENT, Process, System, wait_until

MODULES = ("sensory", "epam", "global_workspace", "procedural", "action", "motor")
CARRIED = tuple(
    topic
    for topic in topics.ALL
    if topic.delivery is not Delivery.ON_REQUEST and topic is not topics.PRESENCE
)
# Every field of a request has a default, so that an object of another type is one too.
NO_REQUESTS = damaged(topics.SNAPSHOT_REQUEST)
del NO_REQUESTS["wrong type"]
BLOCK = zenoh.CongestionControl.BLOCK
Rejections = dict[str, dict[str, int]]


class Stranger:
    """A foreign session that puts bytes on topics.

    Each message is from a source of its own, so that none replaces another.
    """

    def __init__(self, endpoint: str) -> None:
        self.session = open_client(endpoint)
        self.put: Counter[str] = Counter()

    def damage(self, topic: Topic) -> None:
        """Put everything on `topic` that is no message of it."""
        for payload in damaged(topic).values():
            source = f"stranger-{self.put[topic.name]}"
            envelope = Envelope(source, 0, 1, 1, 1)
            self._put(topic, payload, encode(envelope))
        self._put(topic, golden(topic), b"\xc1 no envelope")

    def _put(self, topic: Topic, payload: bytes, attachment: bytes) -> None:
        key = topic.key(AGENT)
        self.session.put(key, payload, attachment=attachment, congestion_control=BLOCK)
        self.put[topic.name] += 1


def auditor() -> Module:
    """Subscribes to every topic, also to those that no module handles."""
    module = Module("auditor")
    for topic in CARRIED:
        module.on(topic, _ignore)
    return module


def _ignore(message: Message) -> None:
    """Only what is rejected matters here."""


def handled(instance: str) -> list[str]:
    """The topics that an instance subscribes to."""
    name, _, _ = instance.partition("-")
    module = registry.build(name, {})
    heard = {*module.handlers, *([topics.HEALTH] if module.heartbeats else [])}
    return [topic.name for topic in CARRIED if topic in heard]


def logged(process: Process) -> Counter[str]:
    """How often a process logged that it rejected a message, by topic."""
    lines = "\n".join(process.lines())
    return Counter(re.findall(r"rejected ([\w/]+): ", lines))


def rejections(stranger: Stranger) -> Rejections:
    """What each instance must have rejected of what the stranger has put and asked."""
    expected: Rejections = {}
    for instance in (*MODULES, "workspace", "codelets-1", "codelets-2"):
        expected[instance] = {name: stranger.put[name] for name in handled(instance)}
    expected["workspace"][topics.SNAPSHOT_REQUEST.name] = len(NO_REQUESTS)
    return expected


def await_rejected(witness: Witness, expected: Rejections) -> None:
    """Wait until every instance reports that it has rejected just that."""

    def are_counted() -> bool:
        reported = {name: witness.health[name].rejected for name in expected}
        return reported == expected

    wait_until(lambda: expected.keys() <= witness.health.keys(), "all report their health")
    wait_until(are_counted, f"{expected} are counted")


def test_bytes_that_are_no_message_are_counted_and_logged_and_change_nothing(
    agent: tuple[System, Feeder, Witness],
) -> None:
    system, feeder, witness = agent
    system.modules(*MODULES)
    auditing = Shell(auditor(), system.bus())
    stranger = Stranger(system.endpoint)
    began_s = time.monotonic()

    with working(auditing):
        for topic in CARRIED:
            stranger.damage(topic)
        for payload in NO_REQUESTS.values():
            with pytest.raises(NoAnswerError):
                auditing.bus.query(topics.SNAPSHOT_REQUEST, payload, 10.0)

        expected = rejections(stranger)
        await_rejected(witness, expected)
        wait_until(lambda: auditing.intake.rejected == stranger.put, f"{stranger.put} are counted")
        lasted_s = time.monotonic() - began_s
        witness.await_cycles(5)
        feeder.pause()
        witness.await_same_graph()

    stranger.session.close()  # type: ignore[no-untyped-call]
    for instance, counts in expected.items():
        process = system.processes[instance]
        health = witness.health[instance]
        times = logged(process)
        assert process.is_alive
        # A worker may be slow here: that is said, too.
        assert not [note for note in health.notes if "their leases" not in note]
        assert not health.gaps
        assert set(times) == set(counts)
        assert max(times.values()) <= lasted_s + 1
