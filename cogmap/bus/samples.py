"""What a sample of Zenoh's says of the message in it."""

from __future__ import annotations

import zenoh

from cogmap.bus.codec import Envelope, decode_envelope
from cogmap.errors import MessageError
from cogmap.schemas.topics import Topic


def encoding(topic: Topic) -> zenoh.Encoding:
    """Return what a sample of `topic` holds, for storages and viewers:
    `application/msgpack;Odometry`.
    """
    return zenoh.Encoding(f"application/msgpack;{topic.type.__name__}")


def envelope_of(sample: zenoh.Sample) -> Envelope | None:
    """Decode the envelope in a sample's attachment; None if there is none that can be decoded."""
    if sample.attachment is None:
        return None
    try:
        return decode_envelope(bytes(sample.attachment))
    except MessageError:
        return None
