"""Messages as people and other programs read them: JSON, text, one field."""

from __future__ import annotations

import enum
from typing import Any

import msgspec
import yaml

from schemas.array import Array, Matrix

_NAMED = (msgspec.Struct, dict)
_ONE_LINE = 2**31 - 1


def to_jsonable(message: Any, full: bool = False) -> Any:
    """`message`, or a part of one, as dicts, lists and scalars.

    An array becomes its dtype, shape, least and greatest value (None where it is empty); with
    `full`, its dtype, shape and nested lists of all values.
    """
    if isinstance(message, Array | Matrix):
        return _array(message, full)
    if isinstance(message, enum.Enum):
        return message.value
    if isinstance(message, msgspec.Struct):
        return {name: to_jsonable(value, full) for name, value in _fields(message).items()}
    if isinstance(message, dict):
        return {str(name): to_jsonable(value, full) for name, value in message.items()}
    if isinstance(message, list | tuple):
        return [to_jsonable(value, full) for value in message]
    return message


def to_text(message: Any, full: bool = False) -> str:
    """`message`, or a part of one, as YAML without a line break at its end.

    An array becomes one line: its dtype, shape, least and greatest value, or with `full` all values.
    """
    text: str = yaml.dump(
        _arrays_as_text(message, full),
        Dumper=yaml.CSafeDumper,
        sort_keys=False,
        allow_unicode=True,
        width=_ONE_LINE,
    )
    return text.removesuffix("...\n").rstrip("\n")


def field(message: Any, path: str) -> Any:
    """The part of `message` at `path`, such as `objects.0.label` or `samples.3.1`.

    Raises LookupError naming the step that leads nowhere and what there is instead.
    """
    value = message
    for step in path.split("."):
        value = _step(value, step, path)
    return value


def _fields(struct: msgspec.Struct) -> dict[str, Any]:
    tag = struct.__struct_config__.tag
    fields = {name: getattr(struct, name) for name in struct.__struct_fields__}
    return fields if tag is None else {str(struct.__struct_config__.tag_field): tag, **fields}


def _array(array: Array | Matrix, full: bool) -> dict[str, Any]:
    values = array.numpy()
    facts: dict[str, Any] = {"dtype": array.dtype, "shape": list(array.shape)}
    if full:
        return {**facts, "data": values.tolist()}
    ends = (values.min().item(), values.max().item()) if values.size else (None, None)
    return {**facts, "min": ends[0], "max": ends[1]}


def _step(value: Any, step: str, path: str) -> Any:
    if isinstance(value, _NAMED) and not isinstance(value, Array | Matrix):
        fields = _fields(value) if isinstance(value, msgspec.Struct) else value
        if step in fields:
            return fields[step]
        raise LookupError(
            f"no {step!r} on the way to {path!r}: there are {', '.join(map(str, fields)) or 'no fields'}"
        )
    if not isinstance(value, list | tuple | Array | Matrix):
        raise LookupError(f"nothing is inside {value!r}, so no {step!r} on the way to {path!r}")
    try:
        return _element(value, int(step))
    except ValueError:
        raise LookupError(
            f"{step!r} on the way to {path!r} is not a number, which an element needs"
        ) from None
    except IndexError:
        raise LookupError(f"no element {step} on the way to {path!r}") from None


def _element(value: Any, index: int) -> Any:
    if not isinstance(value, Array | Matrix):
        return value[index]
    part = value.numpy()[index]
    return Array.of(part) if part.ndim else part.item()


def _arrays_as_text(value: Any, full: bool) -> Any:
    if isinstance(value, enum.Enum):
        return value.value
    if isinstance(value, Array | Matrix):
        return _array_line(value, full)
    if isinstance(value, msgspec.Struct):
        value = _fields(value)

    if isinstance(value, dict):
        return {str(name): _arrays_as_text(part, full) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [_arrays_as_text(part, full) for part in value]
    return value


def _array_line(array: Array | Matrix, full: bool) -> str:
    facts = _array(array, full)
    shape = " x ".join(map(str, array.shape)) or "scalar"
    described = f"{array.dtype} {shape}"

    if full:
        return f"{described} {facts['data']}"
    if facts["min"] is None:
        return f"{described}, empty"
    return f"{described}, {facts['min']} to {facts['max']}"
