"""The frames in a log: which there are, which one is meant, and what was recognised in it."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np
import numpy.typing as npt

from cogmap.errors import LogError, MessageError, UsageError
from cogmap.recording.storage.reader import LogReader, Progress, Record
from schemas import topics
from schemas.array import Array
from schemas.base import Count, Message
from schemas.sensing import Percepts
from schemas.topics import Topic

Image = npt.NDArray[np.uint8]
Depth = npt.NDArray[np.float32]


class _Framed(Message, kw_only=True):
    """As much of a view, a stereo frame or percepts as tells which frame it is, and how many
    objects it has.
    """

    frame: Count
    objects: list[msgspec.Raw] = []


_decoder = msgspec.msgpack.Decoder(_Framed)


@dataclass(frozen=True, slots=True)
class Sight:
    """A frame, recorded `at_s` into the log; `percepts` where what was recognised in it is in the
    log too.
    """

    frame: int
    stamp_ns: int
    at_s: float
    record: Record
    percepts: Record | None
    objects: int


def sights(reader: LogReader, topic: Topic, progress: Progress | None = None) -> list[Sight]:
    """Every frame on `topic`, which carries images, in order. Raises LogError where there is none."""
    pictures: list[tuple[Record, _Framed]] = []
    answers: dict[tuple[int, int], tuple[Record, int]] = {}
    for record in reader.records({topic, topics.PERCEPTS}, progress):
        framed = _framed(reader, record)
        if record.topic is topic:
            pictures.append((record, framed))
        else:
            answers[framed.frame, framed.stamp_ns] = record, len(framed.objects)
    if not pictures:
        raise LogError(
            f"{reader.path} holds no {topic.name}: `cogmap log info {reader.path}` says what it holds"
        )
    start_ns = reader.span_ns[0]
    return [
        Sight(
            framed.frame,
            framed.stamp_ns,
            (record.log_time_ns - start_ns) / 1e9,
            record,
            *answers.get((framed.frame, framed.stamp_ns), (None, 0)),
        )
        for record, framed in pictures
    ]


def recognised(reader: LogReader, found: list[Sight]) -> list[Sight]:
    """Those of `found` that percepts tell of. Raises LogError where there is none."""
    told = [sight for sight in found if sight.percepts is not None]
    if not told:
        raise LogError(
            f"{reader.path} holds no {topics.PERCEPTS.name} of any of its {len(found)} frames: "
            f"`cogmap log info {reader.path}` says what it holds"
        )
    return told


def of_frame(found: list[Sight], frame: int, path: object) -> Sight:
    """The first with that number. Raises UsageError that says which there are."""
    for sight in found:
        if sight.frame == frame:
            return sight
    near = min(found, key=lambda sight: abs(sight.frame - frame)).frame
    first = min(sight.frame for sight in found)
    last = max(sight.frame for sight in found)
    raise UsageError(
        f"no frame {frame} in {path}: there are {len(found)}, from {first} to {last}, and {near} is the nearest"
    )


def at_time(found: list[Sight], at_s: float, reader: LogReader) -> Sight:
    """The one nearest to `at_s` into the log. Raises UsageError where the log is shorter."""
    if at_s > reader.span_s:
        raise UsageError(
            f"{reader.path} lasts {reader.span_s:.3f} s: choose a time before that, not {at_s:g} s"
        )
    return min(found, key=lambda sight: abs(sight.at_s - at_s))


def message(reader: LogReader, record: Record) -> Message:
    """The message of a sight. Raises LogError where it is not what its topic carries."""
    try:
        return reader.message(record)
    except MessageError as error:
        raise LogError(f"{reader.path}: a message cannot be read: {error}") from None


def percepts(reader: LogReader, sight: Sight) -> Percepts | None:
    """What was recognised in it, None where the log does not tell."""
    if sight.percepts is None:
        return None
    found = message(reader, sight.percepts)
    assert isinstance(found, Percepts)
    return found


def image(array: Array, name: str) -> Image:
    """RGB, (h, w, 3). Raises LogError, naming the image by `name`, where it is something else."""
    if array.dtype != "|u1" or len(array.shape) != 3 or array.shape[2] != 3 or 0 in array.shape:
        raise LogError(
            f"{name}: expected a uint8 image (height, width, 3), got {array.dtype} {array.shape}"
        )
    return array.numpy().astype(np.uint8, copy=False)


def depth(array: Array, name: str) -> Depth:
    """Metres, (h, w), 0 unknown. Raises LogError, naming it by `name`, where it is something else."""
    if array.dtype != "<f4" or len(array.shape) != 2 or 0 in array.shape:
        raise LogError(
            f"{name}: expected a float32 depth image (height, width), got {array.dtype} {array.shape}"
        )
    return array.numpy().astype(np.float32, copy=False)


def _framed(reader: LogReader, record: Record) -> _Framed:
    try:
        return _decoder.decode(reader.payload(record))
    except msgspec.DecodeError as error:
        raise LogError(
            f"{reader.path}: a message of {record.topic_name} cannot be read: {error}"
        ) from None
