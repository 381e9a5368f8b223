"""The shell around a module: it receives messages, calls the module and publishes its replies."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any

from cogmap.bus.codec import Cause, decode, encode
from cogmap.bus.depth import cached_messages
from cogmap.bus.interface import Answer, Arrival, Bus, Job, Member
from cogmap.errors import MessageError
from cogmap.graph.replica import Fetched
from cogmap.runtime.delivery.flood import Flood
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.intake import Intake
from cogmap.runtime.delivery.plausibility import Plausibility
from cogmap.runtime.delivery.publisher import Computation, Publisher
from cogmap.runtime.delivery.recovery import Recovery
from cogmap.runtime.delivery.turns import Turns
from cogmap.runtime.follower import Follower
from cogmap.runtime.health import Meter
from cogmap.runtime.heartbeats import Change, Heartbeats
from cogmap.runtime.module import Module, Reply
from cogmap.runtime.roster import Roster
from cogmap.runtime.state.journal import Journal
from cogmap.runtime.state.outbox import Outbox
from cogmap.runtime.state.published import PublishedCounts
from cogmap.runtime.state.store import Store
from cogmap.runtime.succession import Place, take_place
from cogmap.runtime.timers import Due, Timers
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta
from cogmap.schemas.process import Health, Presence

log = logging.getLogger("cogmap")
# How often health is published, and a graph that is behind or empty asked for again.
HEALTH_PERIOD_NS = 1_000_000_000
RETRY_PERIOD_NS = 500_000_000
SILENCE_PERIOD_NS = 500_000_000
START = "@start"
TIMER = "@timer"
OUTSIDE = "@outside"


class Shell:
    """Runs `module` on `bus`: `open()` it, then `spin_once()` from one thread; `close()` ends it.

    `journal` and `counts` keep on disk what a restart must not lose, `outbox` what others may have
    missed, and `store` what the next run is to know. With `health` it publishes its health once a
    second, and sheds floods, of which that tells; a source with a long backlog takes turns with the
    others then.
    """

    def __init__(
        self,
        module: Module,
        bus: Bus,
        journal: Journal | None = None,
        health: bool = True,
        counts: PublishedCounts | None = None,
        *,
        store: Store | None = None,
        outbox: Outbox | None = None,
    ) -> None:
        self.module = module
        self.bus = bus
        self.inbox = Inbox(keeps_all=module.is_lockstep)
        self.flood = Flood()
        self._turns = Turns(self.inbox.put, self.inbox.call, self._receive_after_missed)
        self.intake = Intake(Plausibility())
        self.meter = Meter(module)
        self.publisher = Publisher(module, bus, journal, counts, store, outbox=outbox)
        self._recovery = Recovery(bus, self.intake)
        self._journal = journal
        self._store = store
        self._counts = counts
        self._health = health
        self._roster = Roster(module.requires)
        self._heartbeats: Heartbeats | None = None
        if health and module.heartbeats:
            self._heartbeats = Heartbeats(module.heartbeats, time.monotonic())
        self._started = module.start is None
        self._follower: Follower | None = None
        if module.graph is not None:
            self._follower = Follower(module.graph, bus, self._on_load)

        jobs = [(timer.period_ns, self._timer(timer.handler)) for timer in module.timers]
        if health:
            jobs.append((HEALTH_PERIOD_NS, self._publish_health))
        if self._follower is not None:
            follower = self._follower
            jobs.append((RETRY_PERIOD_NS, lambda now_ns: follower.retry()))
        if self._heartbeats is not None:
            jobs.append((SILENCE_PERIOD_NS, lambda now_ns: self._expire_heartbeats()))
        self._timers = Timers(jobs)

    def open(
        self, *, is_single: bool = False, is_asked_to_end: Callable[[], bool] = lambda: False
    ) -> None:
        """Restore the journal, join the bus, and announce the module.

        What others publish once they see it announced arrives here. Raises UsageError if the
        journal cannot be read, or if another process has its name and stays or, of a module that
        `is_single`, is of its module; and KeyboardInterrupt if it is asked to end while it waits
        for that one to leave.
        """
        place = Place(self.module, self.publisher.incarnation, is_single)
        take_place(self.bus, place, is_asked_to_end)
        backfill: frozenset[topics.Topic] = frozenset()
        if self._journal is not None and self.module.restore is not None:
            self.module.restore(self._journal.messages())
            if not self._journal.is_empty:
                backfill = self.module.backfill

        self.publisher.declare(self._health)
        put = self.flood.before(self._turns.put) if self._health else self.inbox.put
        for topic in self.module.handlers:
            if topic is not topics.PRESENCE:
                history = cached_messages(topic) if topic in backfill else 0
                self.bus.subscribe(topic, put, _leave_to_numbers, history)
        if self._heartbeats is not None and topics.HEALTH not in self.module.handlers:
            self.bus.subscribe(topics.HEALTH, put, _leave_to_numbers)
        for request, (reply, handler) in self.module.served.items():
            answer = self._server(request, handler)
            self.bus.serve(request, reply, answer, partial(self._enqueue, request))

        if self._store is not None:
            self.publisher.send_restored(self._store)
        if self._follower is not None:
            self._follower.join()
        if self._health:
            # Whoever gives it work waits for a report.
            self._publish_health(time.monotonic_ns())
        self.bus.announce(Member(self.module.name, self.module.instance))
        if self.module.requires or self._observes_presence:
            # Handled on the module's own thread.
            self.bus.watch(
                lambda member, alive: self.inbox.call(lambda: self._on_presence(member, alive))
            )

    def spin_once(self, timeout_s: float | None = 0.0) -> bool:
        """Run the timers that are due, and handle the oldest arrival, if one comes in `timeout_s`.

        `timeout_s` None waits until there is one or a timer is due. Returns whether there was an
        arrival or a job. Raises StorageError if the journal cannot be written.
        """
        due_s = self._timers.run_due()
        waits = [wait_s for wait_s in (timeout_s, due_s) if wait_s is not None]
        item = self.inbox.take(min(waits, default=None))
        if item is None:
            return False

        if isinstance(item, Arrival):
            self._turns.taken(item)
            self._receive_after_missed(item)
        else:
            item()
        return True

    def publish(self, messages: Iterable[Message]) -> None:
        """Publish numbered messages of the module's own accord."""
        computation = Computation(time.time_ns())
        for message in messages:
            self.publisher.send(message, computation)
        self.publisher.compact_journal()

    def call(self, handler: Callable[[], Reply]) -> None:
        """Have the module's own thread call `handler`, for what has come by another way than the
        bus, and publish what that returns. Any thread may call this.
        """
        cause = (OUTSIDE, self.module.instance, 0)
        self.inbox.call(lambda: self._invoke(lambda: self.module.stamp(handler()), cause))

    def close(self) -> None:
        """Leave the bus, and close the files."""
        self.bus.close()
        if self._journal is not None:
            self._journal.close()
        self.publisher.close()
        if self._counts is not None:
            self._counts.close()
        if self._store is not None:
            self._store.close()

    @property
    def missing(self) -> dict[str, int]:
        """Return the modules that it requires, and how many instances of each are not ready yet."""
        return self._roster.missing

    @property
    def notes(self) -> list[str]:
        """Return what its health reports in words."""
        notes = [] if self._follower is None else self._follower.notes()
        if self.meter.faults:
            notes.append(f"{self.meter.faults} faults: run with --verbose to see them")
        notes.extend(self.intake.notes())
        notes.extend(self.flood.notes())
        if self.module.notes is not None:
            notes.extend(self.module.notes())
        if self._heartbeats is not None:
            notes.extend(self._heartbeats.notes(time.monotonic()))
        notes.extend(self.bus.conflicts())
        return notes

    @property
    def _observes_presence(self) -> bool:
        return topics.PRESENCE in self.module.handlers

    def _receive_after_missed(self, arrival: Arrival) -> None:
        """Receive an arrival after those that are missing before it: not what was shed, and nothing
        for one that does not count.
        """
        if not arrival.refused:
            shed = self.flood.skipped(arrival)
            if shed is not None:
                self.intake.resume(arrival.topic, shed)
            for missed in self._recovery.before(arrival):
                self._receive(missed)
        self._receive(arrival)

    def _receive(self, arrival: Arrival) -> None:
        received_ns = time.time_ns()
        message = self.intake.accept(arrival)
        envelope = arrival.envelope
        if message is None or envelope is None:
            return
        if self._heartbeats is not None and isinstance(message, Health):
            member = Member(message.module, message.instance)
            self._feed_presence(self._heartbeats.beat(member, time.monotonic()))
            if topics.HEALTH not in self.module.handlers:
                return
        if isinstance(message, Delta) and not self._follows(message, envelope.incarnation):
            return

        self.publisher.trace(message.stamp_ns, envelope)
        cause = (arrival.topic.name, envelope.source, envelope.seq)
        self._invoke(lambda: self.module.answers(message), cause, True, received_ns)

    def _follows(self, delta: Delta, incarnation: int) -> bool:
        """Apply a delta to the graph that the module follows, if any. Returns whether it is to be
        handed to the module.
        """
        if self._follower is None:
            return True
        try:
            return self._follower.follow(delta, incarnation)
        except MessageError as error:
            self.intake.reject(topics.DELTA.name, str(error))
            return False

    def _invoke(
        self,
        handler: Callable[[], Iterable[Message]],
        cause: Cause,
        answers: bool = False,
        received_ns: int | None = None,
    ) -> None:
        """Call the module and publish what it returns, each message as soon as it is known.

        If it raises before the first, nothing but a count changes. `answers` is whether `cause` is
        a received message.
        """
        start_ns = time.time_ns()
        resumed_ns = start_ns
        compute_ns = 0
        is_accepted = False
        for message in self._guarded(handler, cause[0]):
            compute_ns += time.time_ns() - resumed_ns
            if not is_accepted:
                self.publisher.add_cause(cause)
            is_accepted = True
            if message is not None:
                computation = Computation(start_ns, compute_ns, answers)
                self.publisher.send(message, computation)
            resumed_ns = time.time_ns()

        if is_accepted:
            self.publisher.compact_journal()
            self.meter.add(compute_ns, time.time_ns() - (received_ns or start_ns))

    def _guarded(
        self, handler: Callable[[], Iterable[Message]], topic: str
    ) -> Iterator[Message | None]:
        """Yield what `handler` returns, then None. If it raises, count that and yield no more."""
        try:
            yield from handler()
        except MessageError as error:
            self.intake.reject(topic, str(error))
            return
        except Exception as error:
            self.meter.faults += 1
            self.intake.reject(topic, f"{topic}: {type(error).__name__}: {error}")
            log.debug("fault in %s", self.module.instance, exc_info=True)
            return

        yield None

    def _timer(self, handler: Callable[[int], Reply]) -> Due:
        def due(now_ns: int) -> None:
            def call() -> list[Message]:
                return self.module.stamp(handler(now_ns))

            cause = (TIMER, self.module.instance, now_ns)
            self._invoke(call, cause)

        return due

    def _enqueue(self, request: topics.Topic, job: Job) -> None:
        """Have the module's own thread answer a request."""

        def answer() -> None:
            began_s = time.monotonic()
            job()
            self.flood.answered(request, time.monotonic() - began_s)

        self.inbox.call(answer)

    def _server(
        self, request: topics.Topic, handler: Callable[[Any], Message]
    ) -> Callable[[bytes], Answer]:
        def answer(payload: bytes) -> Answer:
            try:
                if self._health and not self.flood.admits_request(request):
                    raise MessageError(f"{request.name}: too many ask for it at once")
                reply = handler(decode(request, payload))
            except MessageError as error:
                self.intake.reject(request.name, str(error))
                raise
            return Answer(encode(reply), self.publisher.answer_envelope())

        return answer

    def _on_load(self, fetched: Fetched) -> None:
        """Name the snapshot that replaced the graph as a cause of what is published next."""
        version = fetched.snapshot.version
        cause = (topics.SNAPSHOT.name, fetched.source, version)
        self._invoke(self.module.loaded, cause)

    def _on_presence(self, member: Member, alive: bool) -> None:
        self._roster.update(member, alive)
        if self._observes_presence:
            changes = [(member, alive)]
            if self._heartbeats is not None:
                changes = self._heartbeats.note(member, alive, time.monotonic())
            self._feed_presence(changes)
        if not self._started and not self.missing:
            self._started = True
            self._invoke(self._start, (START, self.module.instance, 0))

    def _expire_heartbeats(self) -> None:
        assert self._heartbeats is not None
        self._feed_presence(self._heartbeats.expire(time.monotonic()))

    def _feed_presence(self, changes: Iterable[Change]) -> None:
        """Publish what this module observed, for the log, and hand it to the module."""
        for member, alive in changes:
            self._feed_one(member, alive)

    def _feed_one(self, member: Member, alive: bool) -> None:
        observed = Presence(
            module=member.module,
            instance=member.instance,
            alive=alive,
            observer=self.module.instance,
        )
        (presence,) = self.module.stamp(observed)
        self.publish([presence])
        cause = (topics.PRESENCE.name, presence.source, presence.seq)
        self._invoke(lambda: self.module.feed(presence), cause)

    def _start(self) -> list[Message]:
        start = self.module.start
        return [] if start is None else self.module.stamp(start())

    def _publish_health(self, now_ns: int) -> None:
        health = self.meter.report(
            self.intake,
            self.inbox,
            self.publisher,
            queued=len(self.inbox) + len(self._turns),
            shed=self.flood.shed,
            ready=self._started,
            notes=self.notes,
        )
        self.publisher.send_health(health)


def _leave_to_numbers(topic: str, number: int) -> None:
    """Do nothing for messages that the bus gave up: they are fetched once the next one shows by its
    number which, and counted if that fails.
    """
