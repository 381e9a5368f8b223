"""A node of ROS 2 that is not ours: what rmw_zenoh speaks as two libraries of others have it.

Keys, tokens and attachments are made by zenoh-ros2-sdk, CDR by mcap-ros2-support.
"""

from __future__ import annotations

import itertools
import time
import uuid
from collections.abc import Callable
from types import TracebackType
from typing import Any

import zenoh

from benchmarks.optional import rosbags_types, zenoh_ros2_sdk
from cogmap.bus.session import open_client

Fields = dict[str, Any]


class Peer:
    """A node in domain 0 with publishers and subscriptions, to be used in a `with` statement."""

    def __init__(self, endpoint: str, name: str = "robot", domain: int = 0) -> None:
        self._sdk = zenoh_ros2_sdk()
        self._types = _Types()
        self._domain = domain
        self._session = open_client(endpoint)
        self._ids = itertools.count(1)
        self._tokens: list[Any] = []
        self._node = self._sdk.entity.NodeEntity(
            domain_id=domain,
            session_id=str(self._session.info.zid()),
            node_id=0,
            node_name=name,
        )
        self._declare(self._sdk.keyexpr.node_liveliness_keyexpr(self._node))

    def __enter__(self) -> Peer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._session.close()  # type: ignore[no-untyped-call]

    def encoded(self, kind: str, message: Fields) -> bytes:
        """Return a message as CDR."""
        return self._types.encoder(kind)(message)

    def publisher(self, topic: str, kind: str) -> Callable[[bytes], None]:
        """Announce a reliable publisher, and return what publishes the bytes of a message."""
        key = self._announce(topic, kind, self._sdk.entity.EntityKind.PUBLISHER)
        publisher = self._session.declare_publisher(
            key, congestion_control=zenoh.CongestionControl.BLOCK, express=True
        )
        gid = uuid.uuid4().bytes
        numbers = itertools.count(1)

        def publish(content: bytes) -> None:
            attachment = self._sdk.attachment.Attachment(next(numbers), time.time_ns(), gid)
            publisher.put(content, attachment=attachment.to_bytes())

        return publish

    def subscribe(self, topic: str, kind: str, receive: Callable[[Any, Any], None]) -> None:
        """Call `receive` from Zenoh's thread with each message and its attachment."""
        key = self._announce(topic, kind, self._sdk.entity.EntityKind.SUBSCRIPTION)
        decode = self._types.decoder(kind)
        attached = self._sdk.attachment.Attachment.from_bytes

        def on_sample(sample: zenoh.Sample) -> None:
            attachment = sample.attachment
            assert attachment is not None
            receive(decode(bytes(sample.payload)), attached(bytes(attachment)))

        self._tokens.append(self._session.declare_subscriber(key, on_sample))

    def _announce(self, topic: str, kind: str, end: Any) -> str:
        sdk = self._sdk
        dds_name = sdk.utils.ros2_to_dds_type(kind)
        type_hash = self._types.hash_of(kind)
        entity = sdk.entity.EndpointEntity(
            node=self._node,
            entity_id=next(self._ids),
            kind=end,
            name=topic,
            dds_type_name=dds_name,
            type_hash=type_hash,
            qos=sdk.qos.DEFAULT_QOS_PROFILE.encode(),
        )
        self._declare(sdk.keyexpr.endpoint_liveliness_keyexpr(entity))
        return str(sdk.keyexpr.topic_keyexpr(self._domain, topic, dds_name, type_hash))

    def _declare(self, token: str) -> None:
        self._tokens.append(self._session.liveliness().declare_token(token))


class _Types:
    """Definitions of messages, and what reads and writes them."""

    def __init__(self) -> None:
        self._store = rosbags_types()

    def hash_of(self, kind: str) -> str:
        return str(self._store.hash_rihs01(kind))

    def encoder(self, kind: str) -> Callable[[Any], bytes]:
        from mcap_ros2._dynamic import serialize_dynamic

        encoder: Callable[[Any], bytes] = serialize_dynamic(kind, self._definition(kind))[kind]
        return encoder

    def decoder(self, kind: str) -> Callable[[bytes], Any]:
        from mcap_ros2._dynamic import generate_dynamic

        decoder: Callable[[bytes], Any] = generate_dynamic(kind, self._definition(kind))[kind]
        return decoder

    def _definition(self, kind: str) -> str:
        definition, _ = self._store.generate_msgdef(kind, ros_version=2)
        return str(definition)
