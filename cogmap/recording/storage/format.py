"""How a log is laid out in MCAP: a channel for each topic, one for the envelopes, metadata about
the recording.

A message's record holds its bytes as they travelled: log time is when it was received, publish time
when it was sent, sequence its number. The record before it, on the channel `_envelope`, tells the
facts of its transport.
"""

from __future__ import annotations

from functools import cache
from importlib.metadata import PackageNotFoundError, version

import msgspec

from cogmap.bus.codec import Cause, Envelope, Stage
from schemas import topics
from schemas.export import json_schema
from schemas.topics import Delivery, Topic

PROFILE = "cogmap"
MESSAGE_ENCODING = "msgpack"
SCHEMA_ENCODING = "jsonschema"
ENVELOPES = "_envelope"
RECORDING = "recording"
MEMBER = "member"
SUMMARY = "summary"
MAX_TIME_NS = 2**64 - 1
_MAX_SEQUENCE = 2**32 - 1


class EnvelopeRecord(msgspec.Struct, kw_only=True):
    """What the channel `_envelope` carries: the envelope of the message that the next record holds."""

    topic: str
    source: str
    seq: int
    incarnation: int
    sent_ns: int
    born_ns: int
    stages: list[Stage]
    causes: list[Cause]

    @classmethod
    def of(cls, topic: Topic, envelope: Envelope) -> EnvelopeRecord:
        """The record of `envelope`, which came with a message on `topic`."""
        return cls(
            topic=topic.name,
            **{name: getattr(envelope, name) for name in Envelope.__struct_fields__},
        )

    def envelope(self) -> Envelope:
        """The envelope that it was made of."""
        return Envelope(**{name: getattr(self, name) for name in Envelope.__struct_fields__})


def topics_to_record() -> list[Topic]:
    """Every topic of the table that belongs in a log, in the table's order."""
    return [
        topic
        for topic in topics.ALL
        if topic.keep_in_log and topic.delivery is not Delivery.ON_REQUEST
    ]


def schema_of(topic: Topic) -> bytes:
    """The JSON Schema that goes into the file for `topic`."""
    return msgspec.json.encode(json_schema(topic))


def envelope_schema() -> bytes:
    """The JSON Schema of the channel of envelopes."""
    return msgspec.json.encode(msgspec.json.schema(EnvelopeRecord))


def time_field(time_ns: int) -> int:
    """`time_ns` within what MCAP has room for; the exact one is in the envelope."""
    return min(max(time_ns, 0), MAX_TIME_NS)


def sequence_field(seq: int) -> int:
    """`seq` within what MCAP has room for; the exact one is in the envelope and the message."""
    return seq & _MAX_SEQUENCE


@cache
def software() -> str:
    """The name and version that a log names as its writer."""
    try:
        return f"cogmap {version('cogmap')}"
    except PackageNotFoundError:
        return "cogmap"
