"""A message as a user writes it, in JSON or YAML, turned into one."""

from __future__ import annotations

import contextlib
import difflib
from typing import Any

import msgspec
import numpy as np

from cogmap.errors import UsageError
from schemas.array import DTYPES
from schemas.base import Message
from schemas.topics import Topic


def parse(topic: Topic, text: str) -> Message:
    """The message of `topic` that `text` states; an array is `{dtype, shape, data}` with nested
    lists for data.

    Raises UsageError naming what was expected, what came, and where.
    """
    plain = _arrays_packed(_read(text))
    try:
        message = msgspec.convert(plain, topic.type)
    except msgspec.ValidationError as error:
        raise UsageError(
            f"{topic.name}: {error}".replace("`$.", "`").replace("`$`", "the top")
        ) from None
    unknown = _unknown(plain, msgspec.to_builtins(message), "")
    if unknown is not None:
        raise UsageError(f"{topic.name}: {unknown}")
    return message


def _read(text: str) -> Any:
    with contextlib.suppress(msgspec.DecodeError):
        return msgspec.json.decode(text)
    try:
        return msgspec.yaml.decode(text)
    except msgspec.DecodeError as error:
        raise UsageError(
            f"{text!r} is neither JSON nor YAML: {' '.join(str(error).split())}"
        ) from None


def _arrays_packed(value: Any) -> Any:
    if isinstance(value, list):
        return [_arrays_packed(item) for item in value]
    if not isinstance(value, dict):
        return value
    if isinstance(value.get("data"), list) and value.get("dtype") in DTYPES:
        try:
            numbers = np.array(value["data"], value["dtype"])
        except (ValueError, TypeError, OverflowError) as error:
            raise UsageError(f"data of an array of {value['dtype']}: {error}") from None
        return {"shape": list(numbers.shape), **value, "data": numbers.tobytes()}
    return {key: _arrays_packed(item) for key, item in value.items()}


def _unknown(given: Any, understood: Any, where: str) -> str | None:
    """A sentence about the first key in `given` that nothing was made of."""
    if isinstance(given, list) and isinstance(understood, list | tuple):
        pairs = [
            (item, other, f"{where}[{i}]")
            for i, (item, other) in enumerate(zip(given, understood, strict=True))
        ]
    elif isinstance(given, dict) and isinstance(understood, dict):
        for key in given:
            if key not in understood:
                close = difflib.get_close_matches(key, understood, 1)
                hint = (
                    f"did you mean {close[0]!r}?" if close else f"there are {', '.join(understood)}"
                )
                return f"no field {key!r} at {where.lstrip('.') or 'the top'}: {hint}"
        pairs = [(item, understood[key], f"{where}.{key}") for key, item in given.items()]
    else:
        return None
    return next((found for pair in pairs if (found := _unknown(*pair)) is not None), None)
