"""Publishes what a module returns, with what led to it."""

from __future__ import annotations

import logging
import time
from collections import Counter
from dataclasses import dataclass

from msgspec.structs import replace

from cogmap.bus.codec import UNKNOWN, Cause, Envelope, encode
from cogmap.bus.interface import Bus
from cogmap.errors import StorageError
from cogmap.runtime.delivery.intake import number_of
from cogmap.runtime.module import Module
from cogmap.runtime.state.journal import Journal
from cogmap.runtime.state.outbox import Outbox
from cogmap.runtime.state.published import PublishedCounts
from cogmap.runtime.state.store import Store
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.memory import Stored
from cogmap.schemas.process import Health
from cogmap.schemas.topics import Delivery, Topic

log = logging.getLogger("cogmap")
# If more wait for an output, health takes them: so they stay few in a module that is silent.
MAX_CAUSES = 1000
# Stamps whose traces are kept, the newest.
MAX_TRACES = 32


@dataclass(frozen=True, slots=True)
class Computation:
    """How long a handler took. Its outputs belong to the trace of their stamp if it `answers` a
    message.
    """

    start_ns: int
    compute_ns: int = 0
    answers: bool = False

    @property
    def end_ns(self) -> int:
        """Return when it ended."""
        return self.start_ns + self.compute_ns


class Publisher:
    """Sends messages of `module` on `bus`, to the files that keep them first; `emitted` counts them
    by topic.
    """

    def __init__(
        self,
        module: Module,
        bus: Bus,
        journal: Journal | None = None,
        counts: PublishedCounts | None = None,
        store: Store | None = None,
        *,
        outbox: Outbox | None = None,
    ) -> None:
        self.incarnation = time.time_ns()
        self.emitted: Counter[str] = Counter()
        self._module = module
        self._bus = bus
        self._journal = journal
        self._counts = counts
        self._store = store
        self._outbox = outbox
        self._keeps = outbox is not None
        self._causes: list[Cause] = []
        self._traces: dict[int, Envelope] = {}

    def declare(self, health: bool) -> None:
        """Prepare to publish all that the module may, and its health."""
        for topic in topics.ALL:
            if topic not in self._module.emits:
                continue
            self._bus.declare(topic)
            if self._outbox is not None and topic.delivery is Delivery.NEVER_DROP:
                self._bus.serve_past(topic, self._module.instance, self._outbox.read)
        if health:
            self._bus.declare(topics.HEALTH)

    def trace(self, stamp_ns: int, envelope: Envelope) -> None:
        """Let outputs of that stamp continue the trace of `envelope`, until another one comes."""
        traces = self._traces
        traces.pop(stamp_ns, None)
        traces[stamp_ns] = envelope
        if len(traces) > MAX_TRACES:
            oldest = next(iter(traces))
            del traces[oldest]

    def add_cause(self, cause: Cause) -> None:
        """Name `cause` in the next output."""
        if self._module.emits:
            self._causes.append(cause)

    def send(self, message: Message, computation: Computation) -> None:
        """Publish a numbered message. Raises StorageError if the state cannot be written."""
        topic = topics.of(message)
        payload = encode(message)
        if self._journal is not None and topic is self._module.journal:
            self._journal.append(message, payload)
        if self._store is not None and isinstance(message, Stored):
            self._store.save(message)

        envelope = self._envelope(topic, message, computation.end_ns)
        envelope.causes = self._take_causes()
        trace = self._traces.get(message.stamp_ns)
        if trace is not None and computation.answers and not topic.sensed:
            envelope.continue_trace(trace, self._module.name, computation.compute_ns)

        self._keep(topic, envelope, payload)
        self._bus.publish(topic, payload, envelope)
        self.emitted[topic.name] += 1

    def _keep(self, topic: Topic, envelope: Envelope, payload: bytes) -> None:
        """Keep a message for those who will have missed it. A full disk ends that, and no more."""
        number = number_of(envelope)
        if self._outbox is None or number is None or not self._keeps:
            return
        try:
            self._outbox.append(topic, number, encode(envelope), payload)
        except StorageError as error:
            log.warning("%s; messages that others miss are lost from now on", error)
            self._keeps = False

    def close(self) -> None:
        """Close the file of what was published."""
        if self._outbox is not None:
            self._outbox.close()

    def compact_journal(self) -> None:
        """Shorten a journal that has become long. Never call it between the messages of one reply:
        what the module restores would be ahead of them.
        """
        journal = self._journal
        compact = self._module.compact
        if journal is None or compact is None:
            return
        if journal.is_long:
            journal.compact(compact())

    def send_restored(self, store: Store) -> None:
        """Publish what a store holds as its own, so that a log has what the module began with."""
        topic = topics.RESTORED
        restored = replace(store.restored(), source=f"{self._module.instance}.store")
        now_ns = time.time_ns()
        envelope = Envelope(restored.source, 0, self.incarnation, now_ns, now_ns)

        self._bus.declare(topic)
        self._bus.publish(topic, encode(restored), envelope)

    def send_health(self, health: Health) -> None:
        """Publish `health`, with the causes that wait for an output if they have become many."""
        topic = topics.HEALTH
        payload = encode(health)
        envelope = self._envelope(topic, health, health.stamp_ns)

        has_many = len(self._causes) > MAX_CAUSES
        if has_many:
            envelope.causes = self._take_causes()
        self._bus.publish(topic, payload, envelope)

    def answer_envelope(self) -> Envelope:
        """Return the envelope of an answer to a query, which has no number."""
        now_ns = time.time_ns()
        return Envelope(self._module.instance, 0, self.incarnation, now_ns, now_ns)

    def _envelope(self, topic: Topic, message: Message, born_ns: int) -> Envelope:
        earlier = UNKNOWN
        if self._counts is not None and topic.delivery is Delivery.NEVER_DROP:
            earlier = self._counts.earlier(topic)
            self._counts.add(topic)

        return Envelope(
            source=message.source,
            seq=message.seq,
            incarnation=self.incarnation,
            sent_ns=time.time_ns(),
            born_ns=born_ns,
            earlier=earlier,
        )

    def _take_causes(self) -> list[Cause]:
        causes = self._causes
        self._causes = []
        return causes
