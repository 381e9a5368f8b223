"""The types of messages and of their parts, in words."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Any

import msgspec
from msgspec import inspect

from cogmap.cli.messages.fields import ARRAYS, alternatives
from cogmap.schemas import topics

UNITS = {
    "_m_s2": "m/s²",
    "_m_s": "m/s",
    "_rad_s": "rad/s",
    "_rad_per_sqrt_m": "rad/√m",
    "_m2": "m²",
    "_m": "m",
    "_rad": "rad",
    "_ns": "ns",
    "_ms": "ms",
    "_s": "s",
    "_hz": "Hz",
    "_px": "pixels",
    "_mb": "MB",
}
"""Units, by how the name of a field ends; longer endings come first."""

GREATEST_COUNT = 2**62
"""The bound of schemas.base.Count, which is no limit that anybody meets."""

_PLAIN = {
    inspect.NoneType: "none",
    inspect.BoolType: "bool",
    inspect.BytesType: "bytes",
    inspect.MemoryViewType: "bytes",
    inspect.AnyType: "anything",
}


def messages_and_parts() -> dict[str, type[msgspec.Struct]]:
    """Return the types of all messages, in the order of the table of topics, and then of all that
    is in them, by name.
    """
    found: dict[str, type[msgspec.Struct]] = {}
    for topic in topics.ALL:
        found[topic.type.__name__] = topic.type
    waiting = list(found.values())
    while waiting:
        for part in _structs_in(waiting.pop(0)):
            if part.__name__ not in found:
                found[part.__name__] = part
                waiting.append(part)
    return found


def unit_of(name: str) -> str:
    """Return the unit of a field, which its name states; empty if it has none."""
    return next((unit for ending, unit in UNITS.items() if name.endswith(ending)), "")


def words(kind: inspect.Type) -> str:
    """Describe a type: what a value may be, and its bounds."""
    match kind:
        case inspect.Metadata(type=inner):
            text = words(inner)
        case inspect.IntType():
            text = f"int{_bounds(kind)}"
        case inspect.FloatType():
            text = f"float{_bounds(kind)}"
        case inspect.StrType(max_length=longest):
            text = "str" if longest is None else f"str of at most {longest}"
        case inspect.EnumType(cls=cls):
            text = _choice([each.value for each in cls])
        case inspect.LiteralType(values=values):
            text = _choice(list(values))
        case inspect.StructType(cls=cls):
            text = "array" if cls in ARRAYS else cls.__name__
        case inspect.ListType(item_type=item) | inspect.VarTupleType(item_type=item):
            text = f"list of {words(item)}"
        case inspect.TupleType(item_types=items):
            text = f"({', '.join(map(words, items))})"
        case inspect.DictType(value_type=value):
            text = f"by name: {words(value)}"
        case inspect.UnionType(types=types):
            text = " or ".join(map(words, types))
        case _:
            text = _PLAIN.get(type(kind), type(kind).__name__)
    return text


def default_of(field: inspect.Field) -> str:
    """Write the value that a field has where it is not given; empty if it has to be."""
    if field.default_factory is not msgspec.NODEFAULT:
        return str(msgspec.to_builtins(field.default_factory()))
    if field.default is msgspec.NODEFAULT or field.default is msgspec.UNSET:
        return ""
    value = msgspec.to_builtins(field.default)
    return value if isinstance(value, str) and value else repr(value)


def _structs_in(struct: type[msgspec.Struct]) -> Iterator[type[msgspec.Struct]]:
    """Yield the types of parts that are in the fields of a struct."""
    kind = inspect.type_info(struct)
    assert isinstance(kind, inspect.StructType)
    waiting = [field.type for field in kind.fields]
    while waiting:
        for each in alternatives(waiting.pop(0)):
            match each:
                case inspect.StructType(cls=cls) if cls not in ARRAYS:
                    yield cls
                case inspect.ListType(item_type=item) | inspect.VarTupleType(item_type=item):
                    waiting.append(item)
                case inspect.DictType(value_type=value):
                    waiting.append(value)
                case inspect.TupleType(item_types=items):
                    waiting += items


def _choice(values: list[Any]) -> str:
    named = [str(value) if value != "" else "''" for value in values]
    return named[0] if len(named) == 1 else f"one of {', '.join(named)}"


def _bounds(kind: inspect.IntType | inspect.FloatType) -> str:
    """Write the bounds of a number that are less than all there are; empty if it may be any."""
    low = kind.ge if kind.ge is not None else kind.gt
    high = kind.le
    has_low = low is not None and low > -sys.float_info.max
    has_high = high is not None and high < GREATEST_COUNT
    above = "above" if kind.gt is not None else "at least"
    if has_low and has_high:
        return f", {'above ' if kind.gt is not None else ''}{low:g} to {high:g}"
    if has_low:
        return f", {above} {low:g}"
    return f", at most {high:g}" if has_high else ""
