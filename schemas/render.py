"""Messages as people and other programs read them: JSON, text, one field."""

from __future__ import annotations

from typing import Any

import msgspec

from schemas.array import Array

_NAMED = (msgspec.Struct, dict)


def to_jsonable(message: Any, full: bool = False) -> Any:
    """`message`, or a part of one, as dicts, lists and scalars.

    An array becomes its dtype, shape, least and greatest value (None where it is empty); with
    `full`, its dtype, shape and nested lists of all values.
    """
    if isinstance(message, Array):
        return _array(message, full)
    if isinstance(message, msgspec.Struct):
        return {name: to_jsonable(value, full) for name, value in _fields(message).items()}
    if isinstance(message, dict):
        return {str(name): to_jsonable(value, full) for name, value in message.items()}
    if isinstance(message, list | tuple):
        return [to_jsonable(value, full) for value in message]
    return message


def to_text(message: Any, full: bool = False) -> str:
    """`message` in YAML's manner, a line a field, without a line break at its end."""
    return "\n".join(_lines(message, full))


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


def _array(array: Array, full: bool) -> dict[str, Any]:
    values = array.numpy()
    facts: dict[str, Any] = {"dtype": array.dtype, "shape": list(array.shape)}
    if full:
        return {**facts, "data": values.tolist()}
    ends = (values.min().item(), values.max().item()) if values.size else (None, None)
    return {**facts, "min": ends[0], "max": ends[1]}


def _step(value: Any, step: str, path: str) -> Any:
    if isinstance(value, _NAMED) and not isinstance(value, Array):
        fields = _fields(value) if isinstance(value, msgspec.Struct) else value
        if step in fields:
            return fields[step]
        raise LookupError(
            f"no {step!r} on the way to {path!r}: there are {', '.join(map(str, fields)) or 'no fields'}"
        )
    if not isinstance(value, list | tuple | Array):
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
    if not isinstance(value, Array):
        return value[index]
    part = value.numpy()[index]
    return Array.of(part) if part.ndim else part.item()


def _lines(value: Any, full: bool) -> list[str]:
    if isinstance(value, Array):
        return [_array_line(value, full)]
    if isinstance(value, _NAMED):
        fields = _fields(value) if isinstance(value, msgspec.Struct) else value
        return [line for name, part in fields.items() for line in _named(str(name), part, full)]
    if isinstance(value, list | tuple):
        return [line for part in value for line in _item(part, full)]
    return [_scalar(value)]


def _named(name: str, part: Any, full: bool) -> list[str]:
    if not _is_nested(part):
        return [f"{name}: {_lines(part, full)[0] if _has_parts(part) else _empty(part)}"]
    indent = "" if isinstance(part, list | tuple) else "  "
    return [f"{name}:", *(indent + line for line in _lines(part, full))]


def _item(part: Any, full: bool) -> list[str]:
    first, *rest = _lines(part, full) if _has_parts(part) else [_empty(part)]
    return [f"- {first}", *(f"  {line}" for line in rest)]


def _is_nested(part: Any) -> bool:
    return (
        isinstance(part, (*_NAMED, list, tuple))
        and not isinstance(part, Array)
        and _has_parts(part)
    )


def _has_parts(part: Any) -> bool:
    return not isinstance(part, dict | list | tuple) or bool(part)


def _empty(part: Any) -> str:
    return "{}" if isinstance(part, dict) else "[]"


def _array_line(array: Array, full: bool) -> str:
    facts = _array(array, full)
    shape = " x ".join(map(str, array.shape)) or "scalar"
    if full:
        return f"{array.dtype} {shape} {facts['data']}"
    return f"{array.dtype} {shape}" + (
        f", {facts['min']} to {facts['max']}" if facts["min"] is not None else ", empty"
    )


def _scalar(value: Any) -> str:
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, str) else str(value)
