"""What every message and every part of one has in common."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from typing import Annotated, Any, get_args, get_type_hints

import msgspec

Count = Annotated[int, msgspec.Meta(ge=0, le=2**62)]
Name = Annotated[str, msgspec.Meta(min_length=1, max_length=200)]
Scalar = float | int | str | bool


class Part(msgspec.Struct, kw_only=True, gc=False):
    """A piece of a message. Every float in it is finite, which msgpack alone would not guarantee.

    Parts form trees, never cycles, so the garbage collector need not look at them.
    """


class Message(Part, kw_only=True, gc=False):
    """What travels on a topic.

    `stamp_ns` is the time of the sensing that it derives from; `seq` counts the messages of one `source` on
    one topic from 0. The module that emits it fills in `seq` and `source`.
    """

    stamp_ns: Count = 0
    seq: Count = 0
    source: str = ""


def not_finite(part: Part, path: str = "$") -> Iterator[str]:
    """The paths of all NaN and infinite floats in `part`, arrays apart, which see to theirs themselves."""
    for name in _float_fields(type(part)):
        yield from _not_finite(getattr(part, name), f"{path}.{name}")


def _not_finite(value: object, path: str) -> Iterator[str]:
    if isinstance(value, float):
        if not math.isfinite(value):
            yield path
    elif isinstance(value, Part):
        yield from not_finite(value, path)
    elif isinstance(value, list | tuple):
        for number, item in enumerate(value):
            yield from _not_finite(item, f"{path}[{number}]")
    elif isinstance(value, dict):
        for key, item in value.items():
            yield from _not_finite(item, f"{path}.{key}")


@cache
def _float_fields(kind: type[Part]) -> tuple[str, ...]:
    """The fields that may hold a float, however deep."""

    def may_hold_float(hint: Any) -> bool:
        if isinstance(hint, type) and issubclass(hint, Part):
            return bool(_float_fields(hint))
        return hint is float or any(may_hold_float(part) for part in get_args(hint))

    return tuple(name for name, hint in get_type_hints(kind).items() if may_hold_float(hint))
