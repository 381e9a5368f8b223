"""One message of every topic, always the same: the golden bytes, and what they lack.

The golden files are the examples. A topic, a field or a kind of node that they do not have yet gets
values that follow from its annotations, so a new message needs no example of its own:
`python -m cogmap.schemas.export --golden schemas/golden` writes its bytes.
"""

from __future__ import annotations

import enum
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from msgspec import inspect

from cogmap.schemas import topics
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.base import Message
from cogmap.schemas.topics import Topic

GOLDEN = Path(__file__).parent / "golden"
HEADER = {"stamp_ns": 1_200_000_000, "seq": 0, "source": "sample"}
# Examples of types whose fields must fit each other, which no annotation says.
BY_HAND: dict[type[msgspec.Struct], msgspec.Struct] = {
    Array: Array.of(np.arange(6).reshape(3, 2) / 6),
    Matrix: Matrix.of(np.arange(6).reshape(3, 2) / 8),
}


def example_messages() -> list[Message]:
    """Return the example of every topic, in the order of the table."""
    return [example(topic) for topic in topics.ALL]


def example(topic: Topic, folder: Path = GOLDEN) -> Message:
    """Return the example of the messages that `topic` carries, by the golden bytes in `folder`:
    every field of it has another value than its default.

    Raises ValueError if the fields of a new type must fit each other: add one to BY_HAND.
    """
    path = folder / f"{topic.file_stem}.msgpack"
    known = msgspec.msgpack.decode(path.read_bytes()) if path.exists() else HEADER
    plain = completed(inspect.type_info(topic.type), known)
    try:
        return msgspec.msgpack.decode(msgspec.msgpack.encode(plain), type=topic.type)
    except msgspec.ValidationError as error:
        raise ValueError(
            f"no example of {topic.type.__name__} follows from its annotations ({error}): add one "
            "of the type whose fields must fit each other to BY_HAND in schemas/examples.py"
        ) from None


def completed(kind: inspect.Type, known: Any = msgspec.UNSET, default: Any = None) -> Any:
    """Return `known`, a plain value, with whatever else a value of this type has; if it is UNSET,
    a value of the type that is not `default`.
    """
    is_new = known is msgspec.UNSET
    whole: Any
    match kind:
        case inspect.StructType(cls=cls) if is_new and cls in BY_HAND:
            whole = msgspec.to_builtins(BY_HAND[cls], builtin_types=(bytes, memoryview))
        case inspect.StructType(fields=fields, tag_field=tag_field, tag=tag):
            values = {} if is_new else known
            whole = {} if tag_field is None else {tag_field: tag}
            for field in fields:
                value = values.get(field.encode_name, msgspec.UNSET)
                whole[field.encode_name] = completed(field.type, value, field.default)
        case inspect.UnionType(types=types):
            whole = completed(_member(types, known), known, default)
        case inspect.ListType(item_type=item) | inspect.VarTupleType(item_type=item):
            whole = [completed(item, each) for each in ([msgspec.UNSET] if is_new else known)]
            whole += [completed(each) for each in _absent(item, whole)]
        case inspect.TupleType(item_types=items):
            values = [msgspec.UNSET] * len(items) if is_new else known
            whole = [completed(item, value) for item, value in zip(items, values, strict=True)]
        case inspect.DictType(key_type=key_type, value_type=value_type):
            values = {completed(key_type): msgspec.UNSET} if is_new else known
            whole = {key: completed(value_type, value) for key, value in values.items()}
        case _:
            whole = scalar(kind, default) if is_new else known

    return whole


def _member(types: Iterable[inspect.Type], known: Any) -> inspect.Type:
    """Return the member of a union of `types` that `known` is of; the first one if it is UNSET."""
    members = [each for each in types if not isinstance(each, inspect.NoneType)]
    if known is msgspec.UNSET or (len(members) == 1 and known is not None):
        return members[0]

    structs = [each for each in members if isinstance(each, inspect.StructType)]
    if isinstance(known, dict) and structs:
        return next(each for each in structs if each.tag == known[each.tag_field or ""])
    return inspect.AnyType()


def _absent(item: inspect.Type, values: list[Any]) -> list[inspect.StructType]:
    """Return the kinds of a union that a list lacks, if it has most, as a delta's operations."""
    kinds = item.types if isinstance(item, inspect.UnionType) else ()
    tagged = [each for each in kinds if isinstance(each, inspect.StructType) and each.tag]
    present = {value[kind.tag_field] for kind in tagged[:1] for value in values}
    absent = [each for each in tagged if each.tag not in present]
    return absent if 2 * len(absent) < len(tagged) else []


def scalar(kind: inspect.Type, default: Any) -> Any:
    """Return a value of this type without parts that is not `default`, within its bounds."""
    match kind:
        case inspect.BoolType():
            return not default
        case inspect.EnumType(cls=cls):
            values = [each.value for each in cls]
        case inspect.LiteralType(values=values):
            pass
        case inspect.StrType():
            values = ["example", "other"]
        case inspect.BytesType() | inspect.MemoryViewType():
            values = [b"\x01", b"\x02"]
        case inspect.IntType():
            values = _within(kind, [3, 4])
        case inspect.FloatType():
            values = _within(kind, [0.25, 0.5])
        case _:
            raise ValueError(f"no example of a {type(kind).__name__}")

    unwanted = default.value if isinstance(default, enum.Enum) else default
    return next(value for value in values if value != unwanted)


def _within(kind: inspect.IntType | inspect.FloatType, values: list[Any]) -> list[Any]:
    """Return the `values` within bounds, or if there are none, those that the bounds allow."""
    low = kind.ge if kind.ge is not None else kind.gt
    high = kind.le if kind.le is not None else kind.lt
    inside = [
        value for value in values if (low is None or value > low) and (high is None or value < high)
    ]
    return inside or [each for each in (kind.ge, kind.le) if each is not None]
