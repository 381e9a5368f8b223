"""What every message and every part of one has in common."""

from __future__ import annotations

import math
from functools import cache
from typing import Annotated, Any, get_args, get_type_hints

import msgspec

Count = Annotated[int, msgspec.Meta(ge=0, le=2**62)]
Name = Annotated[str, msgspec.Meta(min_length=1, max_length=200)]
Scalar = float | int | str | bool


@cache
def _number_fields(kind: type) -> tuple[str, ...]:
    """Fields of `kind` that may hold a float, alone or in a tuple, list or dict of scalars."""

    def may_hold_float(hint: Any) -> bool:
        return hint is float or any(may_hold_float(part) for part in get_args(hint))

    return tuple(name for name, hint in get_type_hints(kind).items() if may_hold_float(hint))


def _finite(value: object) -> bool:
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, list | tuple):
        return all(_finite(item) for item in value)
    if isinstance(value, dict):
        return all(_finite(item) for item in value.values())
    return True


class Part(msgspec.Struct, kw_only=True):
    """A piece of a message. Every float in it is finite, which msgpack alone would not guarantee."""

    def __post_init__(self) -> None:
        for name in _number_fields(type(self)):
            if not _finite(getattr(self, name)):
                raise ValueError(f"{name} is not finite")


class Message(Part, kw_only=True):
    """What travels on a topic.

    `stamp_ns` is the time of the sensing that it derives from; `seq` counts the messages of one `source` on
    one topic from 0. The module that emits it fills in `seq` and `source`.
    """

    stamp_ns: Count = 0
    seq: Count = 0
    source: str = ""
