"""Parses a message that a user wrote as JSON or YAML, and shows how to write one."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np
import yaml

from cogmap.bus.codec import decode, encode
from cogmap.errors import MessageError, UsageError
from cogmap.files.yaml import parsed
from cogmap.hints import did_you_mean
from cogmap.schemas.array import DTYPES
from cogmap.schemas.base import Message
from cogmap.schemas.examples import example
from cogmap.schemas.render import ONE_LINE, to_jsonable
from cogmap.schemas.topics import Topic


def parse(topic: Topic, text: str) -> Message:
    """Parse a message of `topic`; an array is `{dtype, shape, data}`, data as nested lists.

    Raises UsageError naming what was expected, what was found, and where.
    """
    plain = _pack_arrays(_read(text))
    try:
        message = msgspec.convert(plain, topic.type)
    except msgspec.ValidationError as error:
        reason = str(error).replace("`$.", "`").replace("`$`", "the top")
        raise UsageError(f"{topic.name}: {reason}") from None

    unknown = _unknown(plain, msgspec.to_builtins(message), "")
    if unknown is not None:
        raise UsageError(f"{topic.name}: {unknown}")
    try:
        decode(topic, encode(message))  # as a subscriber does, who rejects what is out of range
    except MessageError as error:
        raise UsageError(str(error)) from None
    return message


def pattern(topic: Topic) -> str:
    """Write an example of the messages on `topic` in YAML, which `parse` reads; what the publisher
    fills in is left out.
    """
    plain = to_jsonable(example(topic), full=True)
    for name in Message.__struct_fields__:
        del plain[name]
    text: str = yaml.safe_dump(plain, sort_keys=False, allow_unicode=True, width=ONE_LINE)
    return text.rstrip("\n")


def _read(text: str) -> Any:
    """Read JSON or YAML. JSON comes first: YAML reads 1e4 as a string."""
    with contextlib.suppress(msgspec.DecodeError, RecursionError):
        return msgspec.json.decode(text)
    try:
        return parsed(text)
    except (yaml.YAMLError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise UsageError(f"{text!r} is neither JSON nor YAML: {reason}") from None


def _pack_arrays(value: Any) -> Any:
    if isinstance(value, list):
        return [_pack_arrays(item) for item in value]
    if not isinstance(value, dict):
        return value

    if isinstance(value.get("data"), list) and value.get("dtype") in DTYPES:
        return _packed(value)
    return {key: _pack_arrays(item) for key, item in value.items()}


def _packed(array: dict[str, Any]) -> dict[str, Any]:
    dtype = array["dtype"]
    try:
        numbers = np.array(array["data"], dtype)
    except (ValueError, TypeError, OverflowError) as error:
        raise UsageError(f"data of an array of {dtype}: {error}") from None
    return {"shape": list(numbers.shape), **array, "data": numbers.tobytes()}


def _unknown(given: Any, parsed: Any, where: str) -> str | None:
    """Write a sentence about the first key in `given` that the message has no field for."""
    if isinstance(given, dict) and isinstance(parsed, dict):
        for key in given:
            if key not in parsed:
                place = where.lstrip(".") or "the top"
                hint = did_you_mean(key, list(parsed), f"there are {', '.join(parsed)}")
                return f"no field {key!r} at {place}: {hint}"

    for part, parsed_part, place in _parts(given, parsed, where):
        found = _unknown(part, parsed_part, place)
        if found is not None:
            return found
    return None


def _parts(given: Any, parsed: Any, where: str) -> Iterator[tuple[Any, Any, str]]:
    if isinstance(given, list) and isinstance(parsed, list | tuple):
        for index, (part, parsed_part) in enumerate(zip(given, parsed, strict=True)):
            yield part, parsed_part, f"{where}[{index}]"
    elif isinstance(given, dict) and isinstance(parsed, dict):
        for key, part in given.items():
            yield part, parsed[key], f"{where}.{key}"
