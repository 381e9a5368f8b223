"""The Zenoh bus: one session as a client of a router."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from typing import TYPE_CHECKING, Any, Protocol

import zenoh
from zenoh import ext

from cogmap.bus.access.subjects import SUBJECTS
from cogmap.bus.codec import Envelope, encode
from cogmap.bus.depth import cached_messages
from cogmap.bus.discovery import Role, announce_use, identify, tokens
from cogmap.bus.incarnations import (
    UNNAMED,
    Gate,
    every_incarnation,
    incarnation_key,
    read_incarnation,
)
from cogmap.bus.interface import Answer, Arrival, Incarnation, Job, Member, Past
from cogmap.bus.questions import Questions
from cogmap.bus.samples import encoding, envelope_of
from cogmap.bus.session import check_name, is_name, open_client, past_key, ready_key
from cogmap.errors import NoAnswerError
from cogmap.schemas.topics import Delivery, Scope, Topic

if TYPE_CHECKING:
    from cogmap.bus.access.keys import Keys

log = logging.getLogger("cogmap")
# Zenoh delivers on a thread of its own, which at Python's default would wait 5 ms for a module that
# computes.
SWITCH_S = 5e-5
# Each query asks again for all that has not come, whether the one before is answered or not: every
# half second, they took so much of a link which halts at times that nothing else came through.
RECOVERY_PERIOD = timedelta(seconds=2.0)
# Zenoh answers from a cache on the thread that receives, with the cache locked: if it waited there
# for a slow link, so would all that is published and received. The outbox has what is dropped.
CACHE_REPLIES = ext.RepliesConfig(congestion_control=zenoh.CongestionControl.DROP)
# Whoever fetches messages holds up later ones: they come first, a piece at a time.
PAST_PRIORITY = zenoh.Priority.INTERACTIVE_LOW
NONE_KEPT = b"none of them are kept"
_LARGE_BYTES = 8 * 2**20
# An image travels in batches, through the router and two threads in each process. On two cores it
# takes twice as long while the thread that has published it computes on.
BATCHED_BYTES = 2**17
TRANSIT_S = 0.002


class _Closable(Protocol):
    def undeclare(self) -> None: ...


class ZenohBus:
    """Connects to the router at `endpoint` as `agent`. `is_asked_to_end` can end the wait for the
    router, see `open_client`. With `keys` it is their subject, and may do what that may: the router
    would deny the rest in silence.

    Raises NoRouterError if none answers in time, AccessError if its keys are wrong or do not allow
    what is asked for, and UsageError for a name that cannot be part of a key.
    """

    def __init__(
        self,
        endpoint: str,
        agent: str,
        is_asked_to_end: Callable[[], bool] | None = None,
        keys: Keys | None = None,
    ) -> None:
        check_name("--agent", agent)
        sys.setswitchinterval(SWITCH_S)
        self._agent = agent
        self._subject = None if keys is None else SUBJECTS.get(keys.name)
        self._session = open_client(endpoint, is_asked_to_end=is_asked_to_end, keys=keys)
        self._publishers: dict[Topic, Any] = {}
        self._declared: list[_Closable] = []
        self._is_named = False
        # Answers of many messages, which wait for a slow link: Zenoh's thread receives meanwhile.
        self._aside = ThreadPoolExecutor(1)
        self._module = UNNAMED
        self._claimed: dict[str, tuple[int, _Closable]] = {}
        self._gate = Gate()
        self._watched: dict[str, set[str]] = {}
        self._questions = Questions(self._session, agent, self.incarnations)

    @property
    def session(self) -> zenoh.Session:
        """Return the session itself, for observers."""
        return self._session

    def declare(self, topic: Topic) -> None:
        if topic in self._publishers:
            return
        if self._subject is not None:
            self._subject.check_publishes(topic)
        key = topic.key(self._agent)
        if topic.delivery is Delivery.NEVER_DROP:
            self._publishers[topic] = self._caching_publisher(key, topic)
        else:
            self._publishers[topic] = self._session.declare_publisher(
                key,
                encoding=encoding(topic),
                congestion_control=zenoh.CongestionControl.DROP,
                priority=_priority(topic),
                express=True,
            )
        self._announce_use(Role.PUBLISHES, topic)

    def _announce_use(self, role: Role, topic: Topic) -> None:
        self._declared.append(announce_use(self._session, self._agent, role, topic))

    def _caching_publisher(self, key: str, topic: Topic) -> ext.AdvancedPublisher:
        """Declare a publisher from whose cache subscribers recover what a congested link dropped.

        Blocking on such a link would stall every subscriber.
        """
        return ext.declare_advanced_publisher(
            self._session,
            key,
            encoding=encoding(topic),
            congestion_control=zenoh.CongestionControl.DROP,
            cache=ext.CacheConfig(cached_messages(topic), replies_config=CACHE_REPLIES),
            sample_miss_detection=ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=None),
            publisher_detection=True,
            priority=_priority(topic),
            express=True,
        )

    def publish(self, topic: Topic, payload: bytes, envelope: Envelope) -> None:
        claimed = self._claimed.get(envelope.source)
        if claimed is None or claimed[0] != envelope.incarnation:
            self.claim(Incarnation(self._module, envelope.source, envelope.incarnation))

        self._publishers[topic].put(payload, attachment=encode(envelope))
        if len(payload) > BATCHED_BYTES:
            time.sleep(TRANSIT_S)

    def claim(self, incarnation: Incarnation) -> None:
        if self._module == UNNAMED:
            self._module = incarnation.module
        before = self._claimed.get(incarnation.source)
        if before is not None:
            before[1].undeclare()

        key = incarnation_key(self._agent, incarnation)
        token = self._session.liveliness().declare_token(key)
        self._claimed[incarnation.source] = (incarnation.number, token)

    def incarnations(self) -> list[Incarnation]:
        read = map(read_incarnation, self._tokens(every_incarnation(self._agent)))
        return sorted({incarnation for incarnation in read if incarnation is not None})

    def members(self) -> list[Member]:
        return [_member(key) for key in sorted(self._tokens(self._every_ready))]

    def conflicts(self) -> list[str]:
        return [*self._gate.conflicts(), *self._questions.notes()]

    def _watch_incarnations(self) -> None:
        """Learn which are there, before the first message comes."""
        expression = every_incarnation(self._agent)
        if expression in self._watched:
            return

        def changed(key: str, alive: bool) -> None:
            incarnation = read_incarnation(key)
            if incarnation is not None:
                self._gate.note(incarnation, alive)

        self._watch_tokens(expression, changed)

    def _watch_tokens(self, expression: str, on_change: Callable[[str, bool], None]) -> None:
        """Tell each key of a token that comes or leaves, and that it did so."""
        known = self._watched.setdefault(expression, set())

        def changed(sample: zenoh.Sample) -> None:
            key = str(sample.key_expr)
            alive = sample.kind == zenoh.SampleKind.PUT
            if alive:
                known.add(key)
            else:
                known.discard(key)
            on_change(key, alive)

        self._declared.append(
            self._session.liveliness().declare_subscriber(expression, changed, history=True)
        )

    def _tokens(self, expression: str) -> set[str]:
        """Return the keys of the tokens that are there.

        A query of a session that watches tokens misses one of them now and then (Zenoh 1.10): what
        it was told counts too.
        """
        known = self._watched.get(expression, set())
        return {*tokens(self._session, expression), *known.copy()}

    def subscribe(
        self,
        topic: Topic,
        deliver: Callable[[Arrival], None],
        on_gap: Callable[[str, int], None],
        history: int = 0,
    ) -> None:
        def receive(sample: zenoh.Sample) -> None:
            now_ns = time.time_ns()
            arrival = Arrival(topic, bytes(sample.payload), envelope_of(sample), now_ns)
            self._gate.put(arrival, deliver)

        if self._subject is not None:
            self._subject.check_subscribes(topic)
        self._watch_incarnations()
        self._announce_use(Role.SUBSCRIBES, topic)
        key = topic.key(self._agent)
        if topic.delivery is not Delivery.NEVER_DROP:
            self._declared.append(self._session.declare_subscriber(key, receive))
            return

        # No heartbeats: they hand a late subscriber the whole cache, and tell nothing after a lost
        # link.
        recovery = ext.RecoveryConfig(periodic_queries=RECOVERY_PERIOD, heartbeat=None)  # type: ignore[arg-type]
        past = ext.HistoryConfig(max_samples=history) if history else None
        subscriber = ext.declare_advanced_subscriber(
            self._session, key, receive, history=past, recovery=recovery
        )
        misses = subscriber.sample_miss_listener(lambda miss: on_gap(topic.name, miss.nb))
        self._declared += [misses, subscriber]

    def serve(
        self,
        request: Topic,
        reply: Topic,
        handler: Callable[[bytes], Answer],
        enqueue: Callable[[Job], None],
    ) -> None:
        def respond(query: zenoh.Query) -> None:
            with query:
                try:
                    answer = handler(b"" if query.payload is None else bytes(query.payload))
                except Exception as error:  # whoever asked gets it: an empty reply would hide it
                    query.reply_err(str(error).encode())
                    return
                query.reply(
                    query.key_expr,
                    answer.payload,
                    encoding=encoding(reply),
                    attachment=None if answer.envelope is None else encode(answer.envelope),
                )

        if self._subject is not None:
            self._subject.check_answers(request)
        self._announce_use(Role.ANSWERS, request)
        key = request.key(self._agent)
        self._declared.append(
            self._session.declare_queryable(key, lambda query: enqueue(lambda: respond(query)))
        )

    def query(self, request: Topic, payload: bytes, timeout_s: float) -> Answer:
        if self._subject is not None:
            self._subject.check_asks(request)
        return self._questions.ask(request, payload, timeout_s)

    def serve_past(self, topic: Topic, source: str, past: Past) -> None:
        def respond(query: zenoh.Query) -> None:
            with query:
                try:
                    first = int(query.parameters.get("first") or "")
                    last = int(query.parameters.get("last") or "")
                except ValueError:
                    query.reply_err(b"which messages? Add first=NUMBER;last=NUMBER")
                    return
                found = past(topic, first, last)
                if not found:
                    query.reply_err(NONE_KEPT)
                for sent in found:
                    query.reply(
                        query.key_expr,
                        sent.payload,
                        encoding=encoding(topic),
                        attachment=sent.envelope,
                    )

        key = past_key(self._agent, topic, source)
        self._declared.append(
            self._session.declare_queryable(key, lambda query: self._aside.submit(respond, query))
        )

    def fetch_past(
        self, topic: Topic, source: str, first: int, last: int, timeout_s: float
    ) -> list[Arrival]:
        if not is_name(source):
            raise NoAnswerError(f"{source!r} is no name of a source")
        replies = self._session.get(
            f"{past_key(self._agent, topic, source)}?first={first};last={last}",
            priority=PAST_PRIORITY,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=timeout_s,
        )
        found = []
        reason = b"it is not there"
        for reply in replies:
            if reply.ok is not None:
                now_ns = time.time_ns()
                payload = bytes(reply.ok.payload)
                found.append(Arrival(topic, payload, envelope_of(reply.ok), now_ns))
            elif reply.err is not None:
                reason = bytes(reply.err.payload)
        if found or reason == NONE_KEPT:
            return found
        why = reason.decode(errors="replace")
        raise NoAnswerError(f"{source} does not answer for {topic.name}: {why}")

    def announce(self, member: Member) -> None:
        self.identify(member)
        token = self._session.liveliness().declare_token(ready_key(self._agent, member))
        self._declared.append(token)

    def identify(self, member: Member) -> None:
        """Name this session to observers; nobody waits for it to be ready. The first name holds.

        Raises UsageError for a name that cannot be part of a key.
        """
        if self._is_named:
            return
        check_name("--instance", member.instance)
        if self._subject is not None:
            self._subject.check_is(member.module, member.instance)
        self._is_named = True
        self._module = member.module
        self._declared.append(identify(self._session, self._agent, member))

    def watch(self, on_change: Callable[[Member, bool], None]) -> None:
        self._watch_tokens(self._every_ready, lambda key, alive: on_change(_member(key), alive))

    @property
    def _every_ready(self) -> str:
        return ready_key(self._agent, Member("*", "*"))

    def close(self) -> None:
        self._gate.close()
        while self._declared:
            self._declared.pop().undeclare()
        while self._publishers:
            _, publisher = self._publishers.popitem()
            publisher.undeclare()
        self._aside.shutdown(cancel_futures=True)
        while self._claimed:
            _, (_, token) = self._claimed.popitem()
            token.undeclare()
        self._session.close()  # type: ignore[no-untyped-call]


def _member(key: str) -> Member:
    """Return the member that the key of a token names."""
    *_, module, instance = key.split("/")
    return Member(module, instance)


def _priority(topic: Topic) -> zenoh.Priority:
    """Return a priority: images, health and the truth give way to what the cycle waits for."""
    is_large = topic.max_bytes > _LARGE_BYTES
    is_health = topic.scope is Scope.PROCESS
    can_be_replaced = topic.delivery is Delivery.LATEST_WINS
    if topic.scope is Scope.TRUTH or (can_be_replaced and (is_large or is_health)):
        return zenoh.Priority.DATA_LOW
    return zenoh.Priority.DATA_HIGH
