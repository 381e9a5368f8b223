"""The fields of messages, by their types."""

from __future__ import annotations

from collections.abc import Iterator

import msgspec
from msgspec import inspect

from cogmap.errors import UsageError
from cogmap.hints import did_you_mean
from cogmap.schemas.array import Array, Matrix

ARRAYS = (Array, Matrix)


def kinds_at(message_type: type[msgspec.Struct], path: str) -> list[inspect.Type]:
    """Return the types that the part of a message at `path` may have, such as that of
    `objects.0.label`.

    Raises UsageError naming the step that leads nowhere and what there is instead.
    """
    kinds = list(alternatives(inspect.type_info(message_type)))
    for step in path.split("."):
        inside = [found for kind in kinds for found in _inside(kind, step)]
        if not inside:
            names = sorted({name for kind in kinds for name in fields_of(kind)})
            known = f"there are {', '.join(names)}" if names else "nothing is inside"
            hint = did_you_mean(step, names, known)
            raise UsageError(f"no {step!r} on the way to {path!r}: {hint}")
        kinds = [each for found in inside for each in alternatives(found)]
    return kinds


def fields_of(kind: inspect.Type) -> dict[str, inspect.Type]:
    """Return the types of a struct's fields, that of its tag among them; none of another type."""
    if not isinstance(kind, inspect.StructType) or kind.cls in ARRAYS:
        return {}

    fields: dict[str, inspect.Type] = {}
    if kind.tag_field is not None:
        fields[kind.tag_field] = inspect.LiteralType((kind.tag,))
    return fields | {field.encode_name: field.type for field in kind.fields}


def alternatives(kind: inspect.Type) -> Iterator[inspect.Type]:
    """Yield the types that a value of this type may have."""
    match kind:
        case inspect.Metadata(type=inner):
            yield from alternatives(inner)
        case inspect.UnionType(types=types):
            for each in types:
                yield from alternatives(each)
        case _:
            yield kind


def _inside(kind: inspect.Type, step: str) -> Iterator[inspect.Type]:
    """Yield the type of what is in a value of this type at `step`: a field, or an element."""
    is_number = step.isdecimal()
    match kind:
        case inspect.StructType(cls=cls) if cls in ARRAYS and is_number:
            yield inspect.AnyType()  # a number, or a row of numbers
        case inspect.StructType() if step in fields_of(kind):
            yield fields_of(kind)[step]
        case inspect.DictType(value_type=value_type):
            yield value_type
        case inspect.ListType(item_type=item) | inspect.VarTupleType(item_type=item) if is_number:
            yield item
        case inspect.TupleType(item_types=items) if is_number and int(step) < len(items):
            yield items[int(step)]
        case inspect.AnyType():
            yield kind
