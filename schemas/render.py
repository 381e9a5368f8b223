"""Messages as people and other programs read them: JSON, text, one field."""

from __future__ import annotations

import enum
from typing import Any

import msgspec
import yaml

from cogmap.schemas.array import Array, Matrix

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
        message = _fields(message)

    if isinstance(message, dict):
        return {str(name): to_jsonable(value, full) for name, value in message.items()}
    if isinstance(message, list | tuple):
        return [to_jsonable(value, full) for value in message]
    return message


def to_text(message: Any, full: bool = False) -> str:
    """`message`, or a part of one, as YAML without a line break at its end.

    An array becomes one line: its dtype, shape, least and greatest value; with `full`, its dtype,
    shape and all values.
    """
    parts = _arrays_as_text(message, full)
    text: str = yaml.dump(
        parts,
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
    config = struct.__struct_config__
    fields = {}
    if config.tag is not None:
        fields[str(config.tag_field)] = config.tag

    for name in struct.__struct_fields__:
        value = getattr(struct, name)
        if value is not msgspec.UNSET:
            fields[name] = value
    return fields


def _array(array: Array | Matrix, full: bool) -> dict[str, Any]:
    values = array.numpy()
    facts: dict[str, Any] = {
        "dtype": array.dtype,
        "shape": list(array.shape),
    }
    if full:
        facts["data"] = values.tolist()
        return facts

    is_empty = not values.size
    facts["min"] = None if is_empty else values.min().item()
    facts["max"] = None if is_empty else values.max().item()
    return facts


def _step(value: Any, step: str, path: str) -> Any:
    if isinstance(value, _NAMED) and not isinstance(value, Array | Matrix):
        return _named_part(value, step, path)

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


def _named_part(value: Any, name: str, path: str) -> Any:
    fields = _fields(value) if isinstance(value, msgspec.Struct) else value
    if name in fields:
        return fields[name]

    names = ", ".join(map(str, fields)) or "no fields"
    raise LookupError(f"no {name!r} on the way to {path!r}: there are {names}")


def _element(value: Any, index: int) -> Any:
    if not isinstance(value, Array | Matrix):
        return value[index]

    part = value.numpy()[index]
    if part.ndim:
        return Array.of(part)
    return part.item()


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
