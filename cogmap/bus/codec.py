"""Messages to bytes and back, and the envelope that carries what is not part of a message."""

from __future__ import annotations

from functools import cache
from typing import Annotated

import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.schemas.base import Message
from cogmap.schemas.topics import Topic

Cause = tuple[str, str, int]
Stage = tuple[str, int, int]
UNKNOWN = -1


class Envelope(msgspec.Struct, array_like=True):
    """Facts of transport, beside the message so that its bytes depend on its content alone.

    A message is identified by `source`, `incarnation` (when that source was started, ns of wall
    time) and `seq`, its number on its topic. `earlier` counts the messages of that topic that the
    source published in earlier incarnations, UNKNOWN if it keeps no count: with it a receiver
    notices what was lost before a restart.

    `born_ns` is the wall time of the sensing, `sent_ns` of the publishing. `stages` are the modules
    passed since, each with nanoseconds of computing and of everything else (encoding, transport,
    queues). `causes` are the inputs (topic, source, seq) that the source received since its
    previous output: replay feeds them in that order.
    """

    source: Annotated[str, msgspec.Meta(max_length=200)]
    seq: int
    incarnation: int
    sent_ns: int
    born_ns: int
    stages: list[Stage] = []
    causes: list[Cause] = []
    earlier: int = UNKNOWN

    def continue_trace(self, cause: Envelope, module: str, compute_ns: int) -> None:
        """Make this the envelope of an answer to `cause` that `module` computed in `compute_ns`."""
        passed_ns = 0
        for _, stage_compute_ns, stage_rest_ns in cause.stages:
            passed_ns += stage_compute_ns + stage_rest_ns
        age_ns = self.sent_ns - cause.born_ns
        rest_ns = max(0, age_ns - passed_ns - compute_ns)

        self.born_ns = cause.born_ns
        self.stages = [*cause.stages, (module, compute_ns, rest_ns)]


def _plain(value: object) -> object:
    if isinstance(value, np.generic):
        return value.item()
    raise NotImplementedError(f"a message cannot hold {type(value).__name__}")


_encoder = msgspec.msgpack.Encoder(enc_hook=_plain)
_envelope_decoder = msgspec.msgpack.Decoder(Envelope)


@cache
def _decoder(kind: type[Message]) -> msgspec.msgpack.Decoder[Message]:
    return msgspec.msgpack.Decoder(kind)


def encode(message: msgspec.Struct) -> bytes:
    """Return the msgpack bytes of a message or an envelope."""
    return _encoder.encode(message)


def decode(topic: Topic, payload: bytes | memoryview) -> Message:
    """Return the message in `payload`, validated.

    Raises MessageError that names the topic, what was expected and where.
    """
    if len(payload) > topic.max_bytes:
        raise MessageError(
            f"{topic.name}: {len(payload)} bytes, at most {topic.max_bytes} are accepted"
        )
    try:
        return _decoder(topic.type).decode(payload)
    except (msgspec.DecodeError, ValueError, OverflowError, RecursionError) as error:
        raise MessageError(f"{topic.name}: {error}") from error


def decode_envelope(data: bytes | memoryview | None) -> Envelope:
    """Return the envelope in a Zenoh attachment. Raises MessageError if there is none."""
    if data is None:
        raise MessageError("no envelope")
    try:
        return _envelope_decoder.decode(data)
    except (msgspec.DecodeError, ValueError, OverflowError, RecursionError) as error:
        raise MessageError(f"envelope: {error}") from error
