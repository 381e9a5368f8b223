"""What every message and every part of one has in common."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated

import msgspec

Count = Annotated[int, msgspec.Meta(ge=0, le=2**62)]
Name = Annotated[str, msgspec.Meta(min_length=1, max_length=200)]
Scalar = float | int | str | bool


class Part(msgspec.Struct, kw_only=True):
    """A piece of a message. Every float in it is finite, which msgpack alone would not guarantee."""


class Message(Part, kw_only=True):
    """What travels on a topic.

    `stamp_ns` is the time of the sensing that it derives from; `seq` counts the messages of one `source` on
    one topic from 0. The module that emits it fills in `seq` and `source`.
    """

    stamp_ns: Count = 0
    seq: Count = 0
    source: str = ""


def not_finite(value: object, path: str = "$") -> Iterator[str]:
    """The paths of all NaN and infinite floats in `value`, arrays apart, which see to theirs themselves."""
    if isinstance(value, float):
        if not math.isfinite(value):
            yield path
    elif isinstance(value, list | tuple):
        for number, item in enumerate(value):
            yield from not_finite(item, f"{path}[{number}]")
    elif isinstance(value, dict):
        for key, item in value.items():
            yield from not_finite(item, f"{path}.{key}")
    elif isinstance(value, Part):
        for name in value.__struct_fields__:
            yield from not_finite(getattr(value, name), f"{path}.{name}")
