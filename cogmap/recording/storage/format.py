"""How a log is laid out in MCAP: a channel for each topic, one for envelopes, and metadata.

A message's record holds the bytes that travelled. Its log time is when it was received, its publish
time when it was sent, its sequence the sender's number. The record before it, on the channel
`_envelope`, holds its envelope. Each message has a later log time than the one before: where the
wall clock was set back or stood, by a nanosecond. Images, other large messages, and small ones are
in chunks of their own, which overlap in time: see `writer.Content`.

A schema is called by the message's type, is encoded as `jsonschema`, and describes bytes encoded as
`msgpack`; both names are of MCAP's registry. It has no profile for such logs, so the profile is
left empty: a log of ours is known by its library, or by the `software` of its recording, where a
tool has written it anew.
"""

from __future__ import annotations

import msgspec
from msgspec.structs import asdict

from cogmap.bus.codec import UNKNOWN, Cause, Envelope, Stage
from cogmap.schemas import topics
from cogmap.schemas.export import json_schema
from cogmap.schemas.topics import Delivery, Topic
from cogmap.version import VERSION

LOG_NAME = "log.mcap"
"""The name of the log in a run's folder."""

PROFILE = ""
SOFTWARE = f"cogmap {VERSION}"
MESSAGE_ENCODING = "msgpack"
SCHEMA_ENCODING = "jsonschema"
ENVELOPES = "_envelope"
RECORDING = "recording"
MEMBER = "member"
SUMMARY = "summary"
# MCAP's: unsigned numbers of 64 and of 32 bits.
MAX_TIME_NS = 2**64 - 1
_MAX_SEQUENCE = 2**32 - 1


class EnvelopeRecord(msgspec.Struct, kw_only=True):
    """The envelope of the message that the next record holds, with that message's topic."""

    topic: str
    source: str
    seq: int
    incarnation: int
    sent_ns: int
    born_ns: int
    stages: list[Stage]
    causes: list[Cause]
    earlier: int = UNKNOWN

    @classmethod
    def of(cls, topic: Topic, envelope: Envelope) -> EnvelopeRecord:
        """Return the record of `envelope`, which came with a message on `topic`."""
        facts = asdict(envelope)
        return cls(topic=topic.name, **facts)

    def envelope(self) -> Envelope:
        """Return the envelope that it was made of."""
        facts = asdict(self)
        del facts["topic"]
        return Envelope(**facts)


def topics_to_record() -> list[Topic]:
    """Return every topic of the table that belongs in a log, in the table's order."""
    return [
        topic
        for topic in topics.ALL
        if topic.keep_in_log and topic.delivery is not Delivery.ON_REQUEST
    ]


def schema_of(topic: Topic) -> tuple[str, bytes]:
    """Return the name and the JSON Schema of what `topic` carries."""
    schema = msgspec.json.encode(json_schema(topic))
    return topic.type.__name__, schema


def envelope_schema() -> tuple[str, bytes]:
    """Return the name and the JSON Schema of what the channel of envelopes carries."""
    schema = msgspec.json.encode(msgspec.json.schema(EnvelopeRecord))
    return EnvelopeRecord.__name__, schema


def time_field(time_ns: int) -> int:
    """Return `time_ns` limited to MCAP's range; the exact time is in the envelope."""
    return min(max(time_ns, 0), MAX_TIME_NS)


def sequence_field(seq: int) -> int:
    """Return the low 32 bits of `seq`, as MCAP keeps it; the number itself is in envelope and
    message.
    """
    return seq & _MAX_SEQUENCE
