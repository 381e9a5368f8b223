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
from cogmap.bus.codec import Envelope, decode_envelope, encode
from cogmap.bus.depth import cached_messages
from cogmap.bus.discovery import Role, announce_use, identify, tokens
from cogmap.bus.incarnations import (
    HOLD_S,
    UNNAMED,
    Gate,
    every_incarnation,
    incarnation_key,
    read_incarnation,
)
from cogmap.bus.interface import Answer, Arrival, Incarnation, Job, Member, Past
from cogmap.bus.session import check_name, is_name, open_client, past_key, ready_key
from cogmap.errors import MessageError, NoAnswerError
from cogmap.schemas.topics import Delivery, Scope, Topic

if TYPE_CHECKING:
    from cogmap.bus.access.keys import Keys

log = logging.getLogger("cogmap")
# Zenoh delivers on a thread of its own, which at Python's default would wait 5 ms for a module that
# computes.
SWITCH_S = 5e-5
RECOVERY_PERIOD = timedelta(seconds=0.5)
# Answers are sent with the priority of their query. One of its own: where an answer fills its queue
# and one of the periodic queries above, which have the default, comes in between, Zenoh 1.10 sends
# neither and closes the link after 5 s.
ANSWER_PRIORITY = zenoh.Priority.BACKGROUND
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
POLL_S = 0.05
# After an answer, whoever else answers is heard for so long: the router says when all have.
OTHERS_S = 0.1
OTHERS_POLL_S = 0.001


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
        self._watches_incarnations = False
        self._doubted = 0
        self._last_doubt = ""

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
        keys = tokens(self._session, every_incarnation(self._agent))
        read = (read_incarnation(key) for key in keys)
        return sorted({incarnation for incarnation in read if incarnation is not None})

    def members(self) -> list[Member]:
        return [_member(key) for key in tokens(self._session, self._every_ready)]

    def conflicts(self) -> list[str]:
        conflicts = self._gate.conflicts()
        if self._doubted:
            conflicts.append(f"{self._doubted} answers did not count, the last: {self._last_doubt}")
        return conflicts

    def _watch_incarnations(self) -> None:
        """Learn which are there, before the first message comes."""
        if self._watches_incarnations:
            return

        def changed(sample: zenoh.Sample) -> None:
            incarnation = read_incarnation(str(sample.key_expr))
            if incarnation is not None:
                self._gate.note(incarnation, sample.kind == zenoh.SampleKind.PUT)

        self._watches_incarnations = True
        self._declared.append(
            self._session.liveliness().declare_subscriber(
                every_incarnation(self._agent), changed, history=True
            )
        )

    def subscribe(
        self,
        topic: Topic,
        deliver: Callable[[Arrival], None],
        on_gap: Callable[[str, int], None],
        history: int = 0,
    ) -> None:
        def receive(sample: zenoh.Sample) -> None:
            now_ns = time.time_ns()
            arrival = Arrival(topic, bytes(sample.payload), _envelope(sample), now_ns)
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
        replies = self._session.get(
            request.key(self._agent),
            payload=payload,
            encoding=encoding(request),
            priority=ANSWER_PRIORITY,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=timeout_s,
        )
        reason = (
            f"nobody answers {request.name} within {timeout_s:g} s: "
            f"is the module that does running?"
        )
        unknown = []
        for reply in replies:
            if reply.ok is not None:
                answer = Answer(bytes(reply.ok.payload), _envelope(reply.ok))
                if self._first_known([answer]) is None:
                    unknown.append(answer)
                    continue
                self._check_others(request, answer, [*unknown, *_others(replies)])
                return answer
            if reply.err is not None:
                said = bytes(reply.err.payload).decode(errors="replace")
                reason = f"{request.name}: {said}"
        if not unknown:
            raise NoAnswerError(reason)

        # While the tokens that this session watches are on their way, none may be listed.
        until_s = time.monotonic() + HOLD_S
        while time.monotonic() < until_s:
            known = self._first_known(unknown)
            if known is not None:
                self._check_others(request, known, unknown)
                return known
            time.sleep(POLL_S)
        raise NoAnswerError(f"{request.name} was answered by somebody who is not on the bus")

    def _check_others(self, request: Topic, answer: Answer, others: list[Answer]) -> None:
        """Say who else answers that is not on the bus. Raises NoAnswerError if somebody in the same
        name answers something else: nobody can tell which answer is true.
        """
        for other in others:
            source = "nobody" if other.envelope is None else other.envelope.source
            if self._first_known([other]) is None:
                self._doubt(f"{request.name}: {source} is not on the bus")
            elif _voice(other) == _voice(answer) and other.payload != answer.payload:
                conflict = f"{request.name}: {source} gives unlike answers, somebody in its name"
                self._doubt(conflict)
                raise NoAnswerError(conflict)

    def _doubt(self, reason: str) -> None:
        self._doubted += 1
        self._last_doubt = reason
        log.warning("an answer does not count: %s", reason)

    def _first_known(self, answers: list[Answer]) -> Answer | None:
        """Return the first answer of an incarnation that is on the bus, None if none is."""
        present = {(each.source, each.number) for each in self.incarnations()}
        for answer in answers:
            if _voice(answer) in present:
                return answer
        return None

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
                found.append(Arrival(topic, payload, _envelope(reply.ok), now_ns))
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
        def changed(sample: zenoh.Sample) -> None:
            on_change(_member(str(sample.key_expr)), sample.kind == zenoh.SampleKind.PUT)

        self._declared.append(
            self._session.liveliness().declare_subscriber(self._every_ready, changed, history=True)
        )

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


def _voice(answer: Answer) -> tuple[str, int] | None:
    """Return as who an answer is given: every module may answer for its settings."""
    envelope = answer.envelope
    return None if envelope is None else (envelope.source, envelope.incarnation)


def _others(replies: zenoh.handlers.Handler[zenoh.Reply]) -> list[Answer]:
    """Return what else is answered soon."""
    found = []
    until_s = time.monotonic() + OTHERS_S
    while time.monotonic() < until_s:
        try:
            reply = replies.try_recv()
        except zenoh.ZError:
            break  # all have answered
        if reply is None:
            time.sleep(OTHERS_POLL_S)
        elif reply.ok is not None:
            found.append(Answer(bytes(reply.ok.payload), _envelope(reply.ok)))
    return found


def encoding(topic: Topic) -> zenoh.Encoding:
    """Return what a sample of `topic` holds, for storages and viewers:
    `application/msgpack;Odometry`.
    """
    return zenoh.Encoding(f"application/msgpack;{topic.type.__name__}")


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


def _envelope(sample: zenoh.Sample) -> Envelope | None:
    """Decode the envelope in a sample's attachment; None if there is none that can be decoded."""
    if sample.attachment is None:
        return None
    try:
        return decode_envelope(bytes(sample.attachment))
    except MessageError:
        return None
