"""Publishes messages of a user beside the processes of a running system."""

from __future__ import annotations

import os
import time

import msgspec

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.discovery import Process, Role, System
from cogmap.bus.interface import Arrival, Bus
from cogmap.cli.topic.observing import CLI
from cogmap.errors import UsageError
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.intake import Intake
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.topics import Topic
from cogmap.services import registry

FIRST_TICK_S = 1.0
"""A clock ticks twenty times a second; one that is halted does not tick at all."""


class Publisher:
    """Publishes messages on one topic, each with the next number."""

    def __init__(self, bus: Bus, topic: Topic) -> None:
        self.number = 0
        self._bus = bus
        self._topic = topic
        # Two commands at once are two sources.
        self._source = f"{CLI}-{os.getpid()}"
        self._incarnation = time.time_ns()
        bus.declare(topic)

    def publish(self, message: Message) -> None:
        """Publish one more."""
        numbered = msgspec.structs.replace(message, source=self._source, seq=self.number)
        now_ns = time.time_ns()
        envelope = Envelope(self._source, self.number, self._incarnation, now_ns, now_ns)
        self._bus.publish(self._topic, encode(numbered), envelope)
        self.number += 1


class Stamps:
    """Stamps messages with the time of the clock, if a process of `system` publishes it."""

    def __init__(self, bus: Bus, system: System) -> None:
        self._inbox = Inbox()
        self._intake = Intake()
        self._newest_ns = 0
        self._timeout_s = FIRST_TICK_S if system.doing(Role.PUBLISHES, topics.CLOCK) else 0.0
        bus.subscribe(topics.CLOCK, self._inbox.put, self._intake.count_lost)

    def stamped(self, message: Message) -> Message:
        """Return `message` as of now; one that has a stamp keeps it.

        Waits FIRST_TICK_S for the clock, once; without one the stamp stays 0.
        """
        if message.stamp_ns:
            return message

        self._read()
        return msgspec.structs.replace(message, stamp_ns=self._newest_ns)

    def _read(self) -> None:
        arrival = self._inbox.take(self._timeout_s)
        self._timeout_s = 0.0
        while isinstance(arrival, Arrival):
            message = self._intake.accept(arrival)
            if message is not None:
                self._newest_ns = message.stamp_ns
            arrival = self._inbox.take(0.0)


def check_unpublished(system: System, topic: Topic) -> None:
    """Raise UsageError if a process of `system` publishes `topic` already, and not several may.

    Whoever subscribes it would obey two publishers in turn.
    """
    publishing = system.doing(Role.PUBLISHES, topic)
    if topic.shared or not publishing:
        return

    names = ", ".join(process.name for process in publishing)
    raise UsageError(
        f"{names} publishes {topic.name} already, and its next message takes the place of yours: "
        f"{_remedy(publishing)}"
    )


def _remedy(publishing: list[Process]) -> str:
    """Say how to leave a topic to the user."""
    modules = {process.member.module for process in publishing if process.member is not None}
    if len(modules) == 1 and modules <= set(registry.MODULES):
        (module,) = modules
        return f"leave it out with `cogmap run --without {module}`, and add --as {module} here"
    return "end it first"
