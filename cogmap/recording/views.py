"""The camera frames in a log: which there are, which one is meant, what was recognised in it."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np
import numpy.typing as npt

from cogmap.errors import LogError, MessageError, UsageError
from cogmap.recording.storage.reader import LogReader, Progress, Record
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.base import Count, Message
from cogmap.schemas.sensing import Percepts
from cogmap.schemas.topics import Topic

Image = npt.NDArray[np.uint8]
Depth = npt.NDArray[np.float32]


class _Numbered(Message, kw_only=True, frozen=True):
    """The part of a view, a stereo frame or percepts that names the frame, with its objects."""

    frame: Count
    objects: list[msgspec.Raw] = []


_decoder = msgspec.msgpack.Decoder(_Numbered)


@dataclass(frozen=True, slots=True)
class CameraFrame:
    """A camera frame in a log, received `at_s` seconds after the log's first message.

    `percepts` is what was recognised in it, `objects` how many; None and 0 if the log has none.
    """

    number: int
    stamp_ns: int
    at_s: float
    record: Record
    percepts: Record | None
    objects: int


def camera_frames(
    reader: LogReader, topic: Topic, progress: Progress | None = None
) -> list[CameraFrame]:
    """Return every frame on `topic`, which carries images, in order. Raises LogError if none is."""
    images: list[tuple[Record, _Numbered]] = []
    recognised: dict[tuple[int, int], tuple[Record, int]] = {}
    for record in reader.records({topic, topics.PERCEPTS}, progress):
        try:
            numbered = _decoder.decode(reader.payload(record))
        except msgspec.DecodeError as error:
            raise LogError(
                f"{reader.path}: a message of {record.topic_name} cannot be read: {error}"
            ) from None
        if record.topic is topic:
            images.append((record, numbered))
        else:
            key = numbered.frame, numbered.stamp_ns
            recognised[key] = record, len(numbered.objects)

    if not images:
        raise LogError(_holds_none(reader, topic.name))
    start_ns = reader.span_ns[0]
    frames = []
    for record, numbered in images:
        percepts, objects = recognised.get((numbered.frame, numbered.stamp_ns), (None, 0))
        at_s = (record.log_time_ns - start_ns) / 1e9
        frame = CameraFrame(numbered.frame, numbered.stamp_ns, at_s, record, percepts, objects)
        frames.append(frame)
    return frames


def with_percepts(reader: LogReader, frames: list[CameraFrame]) -> list[CameraFrame]:
    """Return the frames whose percepts are in the log. Raises LogError if there is none."""
    found = [frame for frame in frames if frame.percepts is not None]
    if not found:
        kind = f"{topics.PERCEPTS.name} of any of its {len(frames)} frames"
        raise LogError(_holds_none(reader, kind))
    return found


def by_number(frames: list[CameraFrame], number: int, path: object) -> CameraFrame:
    """Return the first frame with that number. Raises UsageError naming those that there are."""
    for frame in frames:
        if frame.number == number:
            return frame

    numbers = [frame.number for frame in frames]
    nearest = min(numbers, key=lambda other: abs(other - number))
    raise UsageError(
        f"no frame {number} in {path}: there are {len(frames)}, from {min(numbers)} to "
        f"{max(numbers)}, and {nearest} is the nearest"
    )


def at_time(frames: list[CameraFrame], at_s: float, reader: LogReader) -> CameraFrame:
    """Return the frame nearest to `at_s` into the log. Raises UsageError if the log is shorter."""
    if at_s > reader.span_s:
        raise UsageError(
            f"{reader.path} lasts {reader.span_s:.3f} s: choose a time before that, not {at_s:g} s"
        )
    return min(frames, key=lambda frame: abs(frame.at_s - at_s))


def message(reader: LogReader, record: Record) -> Message:
    """Return the message of a record. Raises LogError if it does not fit its topic."""
    try:
        return reader.message(record)
    except MessageError as error:
        raise LogError(f"{reader.path}: a message cannot be read: {error}") from None


def percepts(reader: LogReader, frame: CameraFrame) -> Percepts | None:
    """Return what was recognised in a frame, None if it is not in the log. Raises LogError."""
    if frame.percepts is None:
        return None
    found = message(reader, frame.percepts)
    assert isinstance(found, Percepts)
    return found


def image(array: Array, name: str) -> Image:
    """Return RGB, (h, w, 3). Raises LogError, naming it by `name`, if it is something else."""
    shape = array.shape
    is_rgb = array.dtype == "|u1" and len(shape) == 3 and shape[2] == 3
    if not is_rgb or 0 in shape:
        raise LogError(
            f"{name}: expected a uint8 image (height, width, 3), got {array.dtype} {shape}"
        )
    return array.numpy().astype(np.uint8, copy=False)


def camera_image(array: Array, name: str) -> Image:
    """Return a camera's image, grey or RGB, as RGB, (h, w, 3). Raises LogError as `image` does."""
    shape = array.shape
    if array.dtype == "|u1" and len(shape) == 2 and 0 not in shape:
        return np.repeat(array.numpy()[..., None], 3, axis=2).astype(np.uint8, copy=False)
    return image(array, name)


def depth(array: Array, name: str) -> Depth:
    """Return metres, (h, w), 0 unknown. Raises LogError, naming it by `name`, if it is no depth."""
    if array.dtype != "<f4" or len(array.shape) != 2 or 0 in array.shape:
        raise LogError(
            f"{name}: expected a float32 depth image (height, width), "
            f"got {array.dtype} {array.shape}"
        )
    return array.numpy().astype(np.float32, copy=False)


def _holds_none(reader: LogReader, what: str) -> str:
    return f"{reader.path} holds no {what}: `cogmap log info {reader.path}` shows what it holds"
