"""A stranger on the bus, who puts whatever it likes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import zenoh

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.discovery import use_key
from cogmap.bus.interface import Member
from cogmap.bus.session import CONNECT_TIMEOUT_S, open_client, ready_key
from cogmap.schemas.base import Message
from cogmap.schemas.topics import Topic

Identity = tuple[str, int, int, int]
ANSWER_S = 1.0
BLOCK = zenoh.CongestionControl.BLOCK


class Forger:
    """A session of its own, which is no member of the system, at the router of `endpoint`, for
    which it waits up to `timeout_s`.
    """

    def __init__(self, endpoint: str, agent: str, timeout_s: float = CONNECT_TIMEOUT_S) -> None:
        self.session = open_client(endpoint, timeout_s)
        self._agent = agent
        self._put: set[Identity] = set()
        self._tokens: list[zenoh.LivelinessToken] = []
        self._last_ns = 0

    def put(self, topic: Topic, message: Message, incarnation: int) -> None:
        """Put a message as it is, in an envelope that fits it."""
        now_ns = max(self._last_ns + 1, time.time_ns())
        self._last_ns = now_ns
        envelope = Envelope(message.source, message.seq, incarnation, now_ns, now_ns)
        self._put.add(_identity(envelope))
        key = topic.key(self._agent)
        self.session.put(
            key, encode(message), attachment=encode(envelope), congestion_control=BLOCK
        )

    def ask(self, request: Topic, message: Message) -> None:
        """Ask for an answer, and wait for none."""
        key = request.key(self._agent)
        self.session.get(key, payload=encode(message), timeout=ANSWER_S)

    @contextmanager
    def answering(
        self, request: Topic, message: Message, envelope: Envelope
    ) -> Iterator[Callable[[], int]]:
        """Answer whoever asks for `request` meanwhile. Yields a function that returns how often."""
        asked = 0
        attachment = encode(envelope)
        payload = encode(message)

        def respond(query: zenoh.Query) -> None:
            nonlocal asked
            asked += 1
            with query:
                query.reply(query.key_expr, payload, attachment=attachment)

        answers = self.session.declare_queryable(request.key(self._agent), respond)
        try:
            yield lambda: asked
        finally:
            answers.undeclare()  # type: ignore[no-untyped-call]

    def has_put(self, envelope: Envelope) -> bool:
        """Return whether it is an envelope of this forger's."""
        return _identity(envelope) in self._put

    def announce(self, member: Member, topic: Topic | None = None) -> None:
        """Declare the tokens of a member that does not exist, and that it publishes `topic`."""
        liveliness = self.session.liveliness()
        self._tokens.append(liveliness.declare_token(ready_key(self._agent, member)))
        if topic is not None:
            zid = str(self.session.zid())
            key = use_key(self._agent, zid, "publisher", topic.name)
            self._tokens.append(liveliness.declare_token(key))

    def withdraw(self) -> None:
        """Take back all tokens."""
        while self._tokens:
            self._tokens.pop().undeclare()  # type: ignore[no-untyped-call]

    def close(self) -> None:
        """Leave."""
        self.withdraw()
        self.session.close()  # type: ignore[no-untyped-call]


def _identity(envelope: Envelope) -> Identity:
    return envelope.source, envelope.incarnation, envelope.seq, envelope.sent_ns
