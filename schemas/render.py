"""Messages as people and other programs read them: JSON, text, one field."""

from __future__ import annotations

import enum
from collections.abc import Callable
from typing import Any

import msgspec
import yaml

from cogmap.schemas.array import Array, Matrix

ONE_LINE = 2**31 - 1


def to_jsonable(message: Any, full: bool = False) -> Any:
    """Return `message`, or a part of one, as dicts, lists and scalars.

    An array becomes its dtype, shape, minimum and maximum (None if it is empty); with `full`, its
    dtype, shape and nested lists of all values.
    """
    return _plain(message, lambda array: _array(array, full))


def to_text(message: Any, full: bool = False, *, flow: bool = False) -> str:
    """Return `message`, or a part of one, as YAML without a line break at its end, on one line if
    it is to `flow`.

    An array becomes one line: its dtype, shape, minimum and maximum; with `full`, its dtype, shape
    and all values.
    """

    def line(array: Array | Matrix) -> str:
        facts = _array(array, full)
        shape = " x ".join(map(str, array.shape)) or "scalar"
        if full:
            return f"{array.dtype} {shape} {facts['data']}"
        if facts["min"] is None:
            return f"{array.dtype} {shape}, empty"
        return f"{array.dtype} {shape}, {facts['min']} to {facts['max']}"

    text: str = yaml.dump(
        _plain(message, line),
        Dumper=yaml.CSafeDumper,
        sort_keys=False,
        default_flow_style=flow,
        allow_unicode=True,
        width=ONE_LINE,
    )
    return text.removesuffix("\n...\n").rstrip("\n")


def field(message: Any, path: str) -> Any:
    """Return the part of `message` at `path`, such as `objects.0.label` or `samples.3.1`.

    Raises LookupError naming the step that leads nowhere and what there is instead.
    """
    value = message
    for step in path.split("."):
        is_array = isinstance(value, Array | Matrix)
        if isinstance(value, msgspec.Struct | dict) and not is_array:
            fields = fields_of(value) if isinstance(value, msgspec.Struct) else value
            if step not in fields:
                names = ", ".join(map(str, fields)) or "no fields"
                raise LookupError(f"no {step!r} on the way to {path!r}: there are {names}")
            value = fields[step]
            continue

        if not is_array and not isinstance(value, list | tuple):
            raise LookupError(f"nothing is inside {value!r}, so no {step!r} on the way to {path!r}")
        try:
            element = (value.numpy() if is_array else value)[int(step)]
        except ValueError:
            raise LookupError(
                f"{step!r} on the way to {path!r} is not a number, which an element needs"
            ) from None
        except IndexError:
            raise LookupError(f"no element {step} on the way to {path!r}") from None
        if is_array:
            element = Array.of(element) if element.ndim else element.item()
        value = element

    return value


def _plain(value: Any, of_array: Callable[[Array | Matrix], Any]) -> Any:
    """Return `value` as dicts, lists and scalars, each array in it as `of_array` returns it."""
    if isinstance(value, Array | Matrix):
        return of_array(value)
    if isinstance(value, enum.Enum):
        return value.value
    if isinstance(value, msgspec.Struct):
        value = fields_of(value)

    if isinstance(value, dict):
        return {str(name): _plain(part, of_array) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part, of_array) for part in value]
    return value


def fields_of(struct: msgspec.Struct) -> dict[str, Any]:
    """Return the fields of `struct` by name, its tag first; those that are unset are left out."""
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
    facts: dict[str, Any] = {"dtype": array.dtype, "shape": list(array.shape)}
    if full:
        return facts | {"data": values.tolist()}

    facts["min"] = values.min().item() if values.size else None
    facts["max"] = values.max().item() if values.size else None
    return facts
