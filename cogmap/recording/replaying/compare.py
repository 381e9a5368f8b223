"""The first difference between two messages, in words."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np

from cogmap.bus.codec import decode
from cogmap.errors import MessageError
from schemas.array import Array
from schemas.base import Message
from schemas.topics import Topic

_SHOWN = 60
Sides = tuple[str, str]


class Difference(msgspec.Struct, frozen=True):
    """Where two messages first differ, and what each has there; `more` says how far the difference
    goes.
    """

    path: str
    left: str
    right: str
    more: str = ""

    def in_words(self, sides: Sides) -> str:
        """A clause, each side called by its name."""
        return f"{self.path} is {self.left} in {sides[0]}, {self.right} in {sides[1]}{self.more}"


def difference(left: Any, right: Any, path: str = "") -> Difference | None:
    """Where two messages, or two parts at `path`, first differ; None where they say the same in the
    same bytes.
    """
    if type(left) is not type(right):
        return Difference(path or "its kind", _short(left), _short(right))
    if isinstance(left, Array):
        return _in_array(left, right, path)
    if isinstance(left, msgspec.Struct):
        return _in_fields(left, right, path)
    if isinstance(left, list | tuple):
        return _in_list(left, right, path)
    if isinstance(left, dict):
        return _in_dict(left, right, path)
    return None if repr(left) == repr(right) else Difference(path, _short(left), _short(right))


def in_words(topic: Topic, left: bytes, right: bytes, sides: Sides) -> str:
    """A sentence on two messages of `topic` whose bytes differ: which they are, and where they
    first differ.
    """
    try:
        first = decode(topic, left)
        second = decode(topic, right)
    except MessageError as error:
        return f"{topic.name}: one of the two is no message: {error}"
    found = difference(first, second)
    clause = (
        found.in_words(sides)
        if found
        else f"the same values in other bytes, from byte {_first_byte(left, right)}"
    )
    return f"{which(topic, first)}: {clause}"


def which(topic: Topic, message: Message) -> str:
    """How a message is called: its topic, number, source and stamp."""
    return f"{topic.name} number {message.seq} of {message.source} (stamp {message.stamp_ns / 1e9:.3f} s)"


def _in_fields(left: msgspec.Struct, right: msgspec.Struct, path: str) -> Difference | None:
    for name in left.__struct_fields__:
        found = difference(getattr(left, name), getattr(right, name), _step(path, name))
        if found is not None:
            return found
    return None


def _in_list(left: Any, right: Any, path: str) -> Difference | None:
    for index, (one, other) in enumerate(zip(left, right, strict=False)):
        found = difference(one, other, _step(path, index))
        if found is not None:
            return found
    if len(left) == len(right):
        return None
    return Difference(f"the length of {path}", str(len(left)), str(len(right)))


def _in_dict(left: dict[Any, Any], right: dict[Any, Any], path: str) -> Difference | None:
    for name, value in left.items():
        if name not in right:
            return Difference(_step(path, name), _short(value), "absent")
        found = difference(value, right[name], _step(path, name))
        if found is not None:
            return found
    added = next((name for name in right if name not in left), None)
    return None if added is None else Difference(_step(path, added), "absent", _short(right[added]))


def _in_array(left: Array, right: Array, path: str) -> Difference | None:
    if (left.dtype, left.shape) != (right.dtype, right.shape):
        return Difference(
            f"the kind of {path}", f"{left.dtype} {left.shape}", f"{right.dtype} {right.shape}"
        )
    raw = [np.frombuffer(array.data, f"V{int(array.dtype[2])}") for array in (left, right)]
    differing = np.flatnonzero(raw[0] != raw[1])
    if differing.size == 0:
        return None
    index = tuple(int(i) for i in np.unravel_index(differing[0], left.shape))
    more = f" ({differing.size} of {raw[0].size} values differ)"
    one, other = (_short(array.numpy()[index].item()) for array in (left, right))
    return Difference(".".join([path, *map(str, index)]), one, other, more)


def _step(path: str, name: object) -> str:
    return f"{path}.{name}" if path else str(name)


def _short(value: Any) -> str:
    text = (
        type(value).__name__
        if isinstance(value, msgspec.Struct | Array | list | tuple | dict)
        else repr(value)
    )
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."


def _first_byte(left: bytes, right: bytes) -> int:
    return next(
        (n for n, (one, other) in enumerate(zip(left, right, strict=False)) if one != other),
        len(left),
    )
