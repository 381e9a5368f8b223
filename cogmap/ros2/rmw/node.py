"""A node of ROS 2 on a Zenoh session."""

from __future__ import annotations

import itertools
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import zenoh
from zenoh import ext

from cogmap.errors import MessageError
from cogmap.ros2.rmw.attachment import Attachment, Gaps, decoded, gid_of
from cogmap.ros2.rmw.keys import USUAL, End, Node, Quality, Seen, Stream, every_end, seen
from cogmap.ros2.rmw.types import Types

HEARTBEAT_S = 0.5
"""How often a latched publisher says what its last message was, while it is new."""

Take = Callable[[], Any]
"""Return the oldest message that was not taken yet, None if there is none. Raises MessageError if
it is none of its type.
"""


class RosNode:
    """A node in `domain`: publishes and subscribes by a session, which it closes at its end.

    What arrives is decoded by who takes it; `gaps` counts what did not arrive, or was not taken
    before newer messages.
    """

    def __init__(
        self, session: zenoh.Session, domain: int, namespace: str, name: str, types: Types
    ) -> None:
        self.gaps = Gaps()
        self.types = types
        self._session = session
        self._numbers = itertools.count()
        zid = str(session.info.zid())
        self._node = Node(domain, zid, next(self._numbers), namespace, name)
        self._declared: list[Any] = [session.liveliness().declare_token(self._node.token)]

    def publisher(self, topic: str, kind: str, quality: Quality = USUAL) -> Publisher:
        """Announce a publisher of messages of a type, such as `std_msgs/msg/String`."""
        stream = Stream(topic, kind, self.types.hash_of(kind))
        token = self._announce(End.PUBLISHER, stream, quality)
        publisher = Publisher(self._declare_publisher(stream, quality), gid_of(token), self.types)
        self._declared.append(publisher)
        return publisher

    def _declare_publisher(self, stream: Stream, quality: Quality) -> Any:
        key = stream.key(self._node.domain)
        drop = zenoh.CongestionControl.DROP
        if not quality.is_latched:
            return self._session.declare_publisher(key, congestion_control=drop, express=True)
        return ext.declare_advanced_publisher(
            self._session,
            key,
            congestion_control=drop,
            cache=ext.CacheConfig(max_samples=quality.depth),
            sample_miss_detection=ext.MissDetectionConfig(
                heartbeat=None, sporadic_heartbeat=HEARTBEAT_S
            ),
            publisher_detection=True,
        )

    def subscribe(
        self, topic: str, kind: str, on_arrival: Callable[[Take], None], quality: Quality
    ) -> None:
        """Announce a subscription. `on_arrival` is called from Zenoh's thread for each message;
        another thread is to take it.

        Any hash of the type is received: it tells apart what distributions describe in other words.
        """
        stream = Stream(topic, kind, self.types.hash_of(kind))
        waiting: deque[tuple[bytes, bytes]] = deque(maxlen=quality.depth)

        def receive(sample: zenoh.Sample) -> None:
            attached = b"" if sample.attachment is None else bytes(sample.attachment)
            waiting.append((bytes(sample.payload), attached))
            on_arrival(take)

        def take() -> Any:
            try:
                content, attached = waiting.popleft()
            except IndexError:  # a newer one has taken its place
                return None
            try:
                self.gaps.update(topic, decoded(attached))
                return self.types.decoded(content, kind)
            except MessageError as error:
                raise MessageError(f"{topic}: {error}") from None

        key = stream._replace(type_hash="*").key(self._node.domain)
        if quality.is_latched:
            subscriber: Any = ext.declare_advanced_subscriber(
                self._session,
                key,
                receive,
                history=ext.HistoryConfig(detect_late_publishers=True, max_samples=quality.depth),
                subscriber_detection=True,
            )
        else:
            subscriber = self._session.declare_subscriber(key, receive)
        self._declared.append(subscriber)
        self._announce(End.SUBSCRIPTION, stream, quality)

    def watch(self, on_change: Callable[[Seen, bool], None]) -> None:
        """Call `on_change` from Zenoh's thread for each end of a topic that is there, comes or goes
        (False).
        """

        def changed(sample: zenoh.Sample) -> None:
            found = seen(str(sample.key_expr))
            if found is not None:
                on_change(found, sample.kind == zenoh.SampleKind.PUT)

        self._declared.append(
            self._session.liveliness().declare_subscriber(
                every_end(self._node.domain), changed, history=True
            )
        )

    def close(self) -> None:
        """Leave the graph, and close the session."""
        while self._declared:
            self._declared.pop().undeclare()
        self._session.close()  # type: ignore[no-untyped-call]

    def _announce(self, end: End, stream: Stream, quality: Quality) -> str:
        token = self._node.token_of(next(self._numbers), end, stream, quality)
        self._declared.append(self._session.liveliness().declare_token(token))
        return token


class Publisher:
    """Publishes messages of one type on one topic."""

    def __init__(self, publisher: Any, gid: bytes, types: Types) -> None:
        self._publisher = publisher
        self._gid = gid
        self._types = types
        self._numbers = itertools.count(1)

    def put(self, message: Any) -> None:
        """Publish a message."""
        attachment = Attachment(next(self._numbers), time.time_ns(), self._gid)
        self._publisher.put(self._types.encoded(message), attachment=attachment.encoded)

    def undeclare(self) -> None:
        """Take it back."""
        self._publisher.undeclare()
