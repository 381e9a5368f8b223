"""The shell around a module: takes messages off a bus, lets the module think, sends what it says."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable
from typing import Any

from cogmap.bus.codec import Cause, Envelope, decode, encode
from cogmap.bus.interface import CACHED_MESSAGES, Answer, Arrival, Bus, Member
from cogmap.errors import MessageError
from cogmap.graph.replica import Fetched
from cogmap.runtime.follower import Follower
from cogmap.runtime.health import Meter
from cogmap.runtime.inbox import Inbox
from cogmap.runtime.intake import Intake
from cogmap.runtime.journal import Journal
from cogmap.runtime.module import Module, Reply
from cogmap.runtime.timers import Due, Timers
from schemas import topics
from schemas.base import Message
from schemas.graph import Delta
from schemas.process import Presence

log = logging.getLogger("cogmap")
HEALTH_PERIOD_NS = 1_000_000_000
RETRY_PERIOD_NS = 500_000_000
MAX_CAUSES = 1000
MAX_TRACES = 32
START = "@start"
TIMER = "@timer"


class Shell:
    """Runs `module` on `bus`. `open()` it, then `spin_once()` it from one thread; `close()` ends it."""

    def __init__(
        self, module: Module, bus: Bus, journal: Journal | None = None, health: bool = True
    ) -> None:
        self.module, self.bus, self.inbox, self.intake = module, bus, Inbox(), Intake()
        self.meter = Meter(module)
        self._journal = journal
        self._health = health
        self._incarnation = time.time_ns()
        self._causes: list[Cause] = []
        self._traces: dict[int, Envelope] = {}
        self._present: set[Member] = set()
        self._started = module.start is None
        self._follower: Follower | None = None
        if module.graph is not None:
            self._follower = Follower(module.graph, bus, self._on_load)
        self._timers = Timers(self._jobs())

    def _jobs(self) -> list[tuple[int, Due]]:
        jobs = [(timer.period_ns, self._on_timer(timer.handler)) for timer in self.module.timers]
        if self._health:
            jobs.append((HEALTH_PERIOD_NS, self._say_health))
        if self._follower is not None:
            jobs.append((RETRY_PERIOD_NS, self._retry))
        return jobs

    def open(self) -> None:
        """Take up the journal, join the bus, and tell everybody: all that is sent from now on
        arrives here.
        """
        missed: frozenset[topics.Topic] = frozenset()
        if self._journal is not None and self.module.restore is not None:
            self.module.restore(self._journal.messages())
            missed = frozenset() if self._journal.is_empty else self.module.backfill
        for topic in sorted(self.module.emits, key=lambda topic: topic.name):
            self.bus.declare(topic)
        if self._health:
            self.bus.declare(topics.HEALTH)
        for topic in self.module.handlers:
            if topic is not topics.PRESENCE:
                history = CACHED_MESSAGES if topic in missed else 0
                self.bus.subscribe(topic, self.inbox.put, self.intake.count_lost, history)
        for request, (reply, handler) in self.module.served.items():
            self.bus.serve(request, reply, self._server(request, handler), self.inbox.call)
        if self._follower is not None:
            self._follower.join()
        self.bus.announce(Member(self.module.name, self.module.instance))
        if self.module.requires or topics.PRESENCE in self.module.handlers:
            self.bus.watch(
                lambda member, alive: self.inbox.call(lambda: self._on_presence(member, alive))
            )

    def spin_once(self, timeout_s: float | None = 0.0) -> bool:
        """Do what is due: a timer, or the oldest arrival within `timeout_s`. False if there was
        nothing.
        """
        due_s = self._timers.run_due()
        wait_s = (
            due_s if timeout_s is None else timeout_s if due_s is None else min(timeout_s, due_s)
        )
        item = self.inbox.take(wait_s)
        if isinstance(item, Arrival):
            self._receive(item)
        elif item is not None:
            item()
        return item is not None

    def publish(self, messages: Iterable[Message]) -> None:
        """Send what the module says of its own accord, numbered."""
        self._send(messages, None, 0, time.time_ns())

    def close(self) -> None:
        """Leave the bus."""
        self.bus.close()
        if self._journal is not None:
            self._journal.close()

    def _receive(self, arrival: Arrival) -> None:
        started_ns = time.time_ns()
        message = self.intake.accept(arrival)
        if message is None or arrival.envelope is None:
            return
        if self._follower is not None and isinstance(message, Delta):
            is_held = self._follower.follow(message, arrival.envelope.incarnation)
            if not is_held:
                return
        self._remember(message.stamp_ns, arrival.envelope)
        cause = (arrival.topic.name, arrival.envelope.source, arrival.envelope.seq)
        self._invoke(lambda: self.module.feed(message), cause, arrival.envelope, started_ns)

    def _remember(self, stamp_ns: int, envelope: Envelope) -> None:
        """What is said with that stamp follows `envelope`, also where it is said while another
        message is taken in.
        """
        self._traces.pop(stamp_ns, None)
        self._traces[stamp_ns] = envelope
        if len(self._traces) > MAX_TRACES:
            del self._traces[next(iter(self._traces))]

    def _invoke(
        self, think: Callable[[], list[Message]], cause: Cause, of: Envelope | None, started_ns: int
    ) -> None:
        """Let the module think; a message that it cannot make sense of changes nothing but a count."""
        thinking_ns = time.time_ns()
        try:
            messages = think()
        except MessageError as error:
            self.intake.reject(cause[0], str(error))
            return
        except Exception as error:
            self.meter.faults += 1
            self.intake.reject(cause[0], f"{cause[0]}: {type(error).__name__}: {error}")
            log.debug("fault in %s", self.module.instance, exc_info=True)
            return
        done_ns = time.time_ns()
        if self.module.emits:
            self._causes.append(cause)
        if messages:
            self._send(messages, of, done_ns - thinking_ns, thinking_ns)
        self.meter.count(done_ns - thinking_ns, time.time_ns() - started_ns)

    def _send(
        self, messages: Iterable[Message], of: Envelope | None, compute_ns: int, thinking_ns: int
    ) -> None:
        """Send `messages`, with what led to them; the journal has them first."""
        for message in messages:
            topic = topics.of(message)
            payload = encode(message)
            if topic is self.module.journal and self._journal is not None:
                self._journal.append(message, payload)
            now_ns = time.time_ns()
            envelope = Envelope(
                message.source, message.seq, self._incarnation, now_ns, thinking_ns + compute_ns
            )
            cause = None if of is None or topic.sensed else self._traces.get(message.stamp_ns)
            if cause is not None:
                envelope.follow(cause, self.module.name, compute_ns)
            envelope.causes = self._causes
            self._causes = []
            self.bus.publish(topic, payload, envelope)
            self.meter.emitted[topic.name] += 1
        if self._journal is not None and self._journal.is_long and self.module.compact is not None:
            self._journal.compact(self.module.compact())

    def _on_timer(self, handler: Callable[[int], Reply]) -> Callable[[int], None]:
        def due(now_ns: int) -> None:
            cause = (TIMER, self.module.instance, now_ns)
            self._invoke(lambda: self.module.stamp(handler(now_ns)), cause, None, time.time_ns())

        return due

    def _server(
        self, request: topics.Topic, handler: Callable[[Any], Message]
    ) -> Callable[[bytes], Answer]:
        def answer(payload: bytes) -> Answer:
            try:
                reply = handler(decode(request, payload))
            except MessageError as error:
                self.intake.reject(request.name, str(error))
                raise
            now_ns = time.time_ns()
            source = self.module.instance
            return Answer(encode(reply), Envelope(source, 0, self._incarnation, now_ns, now_ns))

        return answer

    def _retry(self, now_ns: int) -> None:
        if self._follower is not None:
            self._follower.retry()

    def _on_load(self, fetched: Fetched) -> None:
        """Record that a snapshot replaced the graph, as what led to all that is published next."""
        cause = (topics.SNAPSHOT.name, fetched.source, fetched.snapshot.version)
        self._invoke(self.module.loaded, cause, None, time.time_ns())

    def _on_presence(self, member: Member, alive: bool) -> None:
        (self._present.add if alive else self._present.discard)(member)
        if topics.PRESENCE in self.module.handlers:
            presence = Presence(
                module=member.module,
                instance=member.instance,
                alive=alive,
                observer=self.module.instance,
            )
            self.publish(self.module.stamp(presence))
            cause = (topics.PRESENCE.name, presence.source, presence.seq)
            self._invoke(lambda: self.module.feed(presence), cause, None, time.time_ns())
        if not self._started and not self.missing:
            self._started = True
            start = self.module.start
            if start is not None:
                cause = (START, self.module.instance, 0)
                self._invoke(lambda: self.module.stamp(start()), cause, None, time.time_ns())

    @property
    def missing(self) -> dict[str, int]:
        """The modules that it waits for, and how many instances of each are not ready yet."""
        ready = [member.module for member in self._present]
        lacking = {
            name: number - ready.count(name) for name, number in self.module.requires.items()
        }
        return {name: number for name, number in lacking.items() if number > 0}

    @property
    def notes(self) -> list[str]:
        """What its health reports in words."""
        notes = [] if self._follower is None else self._follower.notes()
        if self.meter.faults:
            notes.append(f"{self.meter.faults} faults: run with --verbose to see them")
        return notes

    def _say_health(self, now_ns: int) -> None:
        health = self.meter.report(self.intake, self.inbox, not self.missing, self.notes)
        health.source = self.module.instance
        health.seq = self.meter.reports - 1
        sent_ns = time.time_ns()
        health.stamp_ns = sent_ns
        envelope = Envelope(health.source, health.seq, self._incarnation, sent_ns, sent_ns)
        if (
            len(self._causes) > MAX_CAUSES
        ):  # whoever says little else would remember all that it ever took in
            envelope.causes = self._causes
            self._causes = []
        self.bus.publish(topics.HEALTH, encode(health), envelope)
