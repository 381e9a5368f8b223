"""The messages of a topic as a table: a row a message, a column a field."""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec
from msgspec import UNSET, inspect

from cogmap.errors import UsageError
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.base import Message

if TYPE_CHECKING:
    import pyarrow

TIME = "time_s"
"""The column of the time into the log at which a message was received."""

Convert = Callable[[Any], object]


class _Kind(NamedTuple):
    """The Arrow type of a field, and what makes a value of it of the field's; None where it is one
    already.
    """

    type: pyarrow.DataType
    convert: Convert | None = None


def table(kind: type[Message], rows: Iterable[tuple[float, Message]]) -> pyarrow.Table:
    """Return messages of `kind`, each with its time in seconds, as a table.

    The fields of a part are columns of their own (`pose.x_m`), and so on down to lists. An array is
    a struct of its dtype, shape and bytes; what may be of several types is JSON. Raises UsageError
    if there is no pyarrow.
    """
    arrow = arrow_library()
    times_s: list[float] = []
    messages: list[Message] = []
    for time_s, message in rows:
        times_s.append(time_s)
        messages.append(message)

    columns = {TIME: arrow.array(times_s, arrow.float64())}
    for name, column in _columns_of(kind):
        values = map(attrgetter(name), messages)
        if column.convert is not None:
            values = map(column.convert, values)
        columns[name] = arrow.array(list(values), column.type)
    return arrow.table(columns)


@cache
def _columns_of(kind: type[Message]) -> tuple[tuple[str, _Kind], ...]:
    """Return the columns of a message's fields: a long log asks for them again and again."""
    return tuple(_columns(kind, ""))


def _columns(kind: type[msgspec.Struct], prefix: str) -> Iterator[tuple[str, _Kind]]:
    """Yield the columns of a struct's fields, those of its parts among them, by their paths."""
    for field in msgspec.structs.fields(kind):
        name = prefix + field.name
        found = inspect.type_info(field.type)
        if isinstance(found, inspect.StructType) and not _is_array(found):
            yield from _columns(found.cls, f"{name}.")
        else:
            column = _kind(found)
            yield name, _or_none(column) if field.default is UNSET else column


def _kind(found: inspect.Type) -> _Kind:
    """Return how values of a type become Arrow's."""
    arrow = arrow_library()
    kind = _Kind(arrow.string(), _json)
    match found:
        case inspect.BoolType():
            kind = _Kind(arrow.bool_())
        case inspect.IntType():
            kind = _Kind(arrow.int64())
        case inspect.FloatType():
            kind = _Kind(arrow.float64())
        case inspect.StrType():
            kind = _Kind(arrow.string())
        case inspect.EnumType() | inspect.LiteralType():
            kind = _Kind(arrow.string(), _text)
        case inspect.ListType() | inspect.VarTupleType() | inspect.SetType():
            kind = _list_of(_kind(found.item_type))
        case inspect.TupleType() if len({type(item) for item in found.item_types}) == 1:
            kind = _list_of(_kind(found.item_types[0]))
        case inspect.DictType():
            kind = _map_of(_kind(found.key_type), _kind(found.value_type))
        case inspect.StructType() if _is_array(found):
            kind = _array()
        case inspect.StructType():
            kind = _struct_of({field.name: _kind(field.type) for field in found.fields})
        case inspect.UnionType():
            others = [one for one in found.types if not isinstance(one, inspect.NoneType)]
            if len(others) == 1:
                kind = _or_none(_kind(others[0]))
    return kind


def _is_array(found: inspect.StructType) -> bool:
    return found.cls in (Array, Matrix)


def _or_none(kind: _Kind) -> _Kind:
    return _Kind(
        kind.type, lambda value: None if value is None or value is UNSET else _made(kind, value)
    )


def _list_of(item: _Kind) -> _Kind:
    convert = list if item.convert is None else lambda values: [_made(item, one) for one in values]
    return _Kind(arrow_library().list_(item.type), convert)


def _map_of(key: _Kind, value: _Kind) -> _Kind:
    def pairs(values: dict[Any, Any]) -> object:
        return [(_made(key, name), _made(value, one)) for name, one in values.items()]

    return _Kind(arrow_library().map_(key.type, value.type), pairs)


def _struct_of(fields: dict[str, _Kind]) -> _Kind:
    def parts(whole: object) -> object:
        return {name: _made(kind, getattr(whole, name)) for name, kind in fields.items()}

    types = [(name, kind.type) for name, kind in fields.items()]
    return _Kind(arrow_library().struct(types), parts)


def _array() -> _Kind:
    def parts(array: Array | Matrix) -> object:
        return {"dtype": array.dtype, "shape": list(array.shape), "data": bytes(array.data)}

    arrow = arrow_library()
    shape = arrow.list_(arrow.int64())
    types = [("dtype", arrow.string()), ("shape", shape), ("data", arrow.binary())]
    return _Kind(arrow.struct(types), parts)


def _made(kind: _Kind, value: object) -> object:
    return value if kind.convert is None else kind.convert(value)


def _text(value: object) -> object:
    return str(value.value) if isinstance(value, enum.Enum) else str(value)


def _json(value: object) -> object:
    return msgspec.json.encode(value).decode()


def arrow_library() -> Any:
    """Return pyarrow. Raises UsageError if it is not installed."""
    try:
        import pyarrow
    except ImportError:
        raise UsageError(
            "tables need pyarrow: install it by `pip install 'cogmap[tables]'`"
        ) from None
    return pyarrow
