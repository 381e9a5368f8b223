"""The first difference between two messages, in words."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import msgspec
import numpy as np

from cogmap.bus.codec import decode
from cogmap.errors import MessageError
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.base import Message
from cogmap.schemas.topics import Topic

_MAX_SHOWN = 60
Sides = tuple[str, str]


class Difference(msgspec.Struct, frozen=True):
    """Where two messages first differ, and what each has there; `more` is the extent, if known."""

    path: str
    left: str
    right: str
    more: str = ""

    def in_words(self, sides: Sides) -> str:
        """Return a clause, with the names of the two sides."""
        left_side, right_side = sides
        return f"{self.path} is {self.left} in {left_side}, {self.right} in {right_side}{self.more}"


def difference(left: Any, right: Any, path: str = "") -> Difference | None:
    """Return where two messages, or two parts at `path`, first differ; None if they hold the
    same.
    """
    if type(left) is not type(right):
        return Difference(path or "its kind", _short(left), _short(right))
    for kind, compare in _COMPARISONS:
        if isinstance(left, kind):
            return compare(left, right, path)

    if repr(left) == repr(right):
        return None
    return Difference(path, _short(left), _short(right))


def describe(topic: Topic, left: bytes, right: bytes, sides: Sides) -> str:
    """Return a sentence on two messages of `topic` whose bytes differ: which, and where first."""
    try:
        first = decode(topic, left)
        second = decode(topic, right)
    except MessageError as error:
        return f"{topic.name}: one of the two is no message: {error}"

    found = difference(first, second)
    if found is not None:
        clause = found.in_words(sides)
    else:
        pairs = enumerate(zip(left, right, strict=False))
        shorter = min(len(left), len(right))
        first_byte = next((index for index, (one, other) in pairs if one != other), shorter)
        clause = f"the same values in other bytes, from byte {first_byte}"
    return f"{title(topic, first)}: {clause}"


def title(topic: Topic, message: Message) -> str:
    """Return a message's topic, number, source and stamp."""
    stamp_s = message.stamp_ns / 1e9
    return f"{topic.name} number {message.seq} of {message.source} (stamp {stamp_s:.3f} s)"


def _in_fields(left: msgspec.Struct, right: msgspec.Struct, path: str) -> Difference | None:
    for name in left.__struct_fields__:
        found = difference(getattr(left, name), getattr(right, name), _step(path, name))
        if found is not None:
            return found
    return None


def _in_list(left: Sequence[Any], right: Sequence[Any], path: str) -> Difference | None:
    for index, (one, other) in enumerate(zip(left, right, strict=False)):
        found = difference(one, other, _step(path, index))
        if found is not None:
            return found

    if len(left) == len(right):
        return None
    return Difference(f"the length of {path}", str(len(left)), str(len(right)))


def _in_dict(left: dict[Any, Any], right: dict[Any, Any], path: str) -> Difference | None:
    for name, value in left.items():
        step = _step(path, name)
        if name not in right:
            return Difference(step, _short(value), "absent")
        found = difference(value, right[name], step)
        if found is not None:
            return found

    for name, value in right.items():
        if name not in left:
            return Difference(_step(path, name), "absent", _short(value))
    return None


def _in_array(left: Array | Matrix, right: Array | Matrix, path: str) -> Difference | None:
    if (left.dtype, left.shape) != (right.dtype, right.shape):
        left_kind = f"{left.dtype} {left.shape}"
        right_kind = f"{right.dtype} {right.shape}"
        return Difference(f"the kind of {path}", left_kind, right_kind)

    differs = _raw(left) != _raw(right)
    if not differs.any():
        return None

    first = int(differs.argmax())
    index = tuple(int(i) for i in np.unravel_index(first, left.shape))
    where = ".".join([path, *map(str, index)])
    more = f" ({differs.sum()} of {differs.size} values differ)"
    return Difference(
        where, _short(left.numpy()[index].item()), _short(right.numpy()[index].item()), more
    )


def _raw(array: Array | Matrix) -> np.ndarray[Any, Any]:
    """Return the values as bytes, so that NaN equals NaN and -0.0 differs from 0.0."""
    size = int(array.dtype[2])
    return np.frombuffer(array.data, f"V{size}")


def _step(path: str, name: object) -> str:
    return f"{path}.{name}" if path else str(name)


def _short(value: Any) -> str:
    text = type(value).__name__ if isinstance(value, _COMPOUND) else repr(value)
    if len(text) <= _MAX_SHOWN:
        return text
    return f"{text[:_MAX_SHOWN]}..."


_COMPARISONS: tuple[tuple[type, Callable[[Any, Any, str], Difference | None]], ...] = (
    (Array, _in_array),
    (Matrix, _in_array),
    (msgspec.Struct, _in_fields),
    (list, _in_list),
    (tuple, _in_list),
    (dict, _in_dict),
)
_COMPOUND = tuple(kind for kind, _ in _COMPARISONS)
