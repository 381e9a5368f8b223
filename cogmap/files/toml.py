"""TOML that others wrote: numbers have 64 bits, and tables are not nested without end."""

from __future__ import annotations

import tomllib
from typing import Any

MAX_CHARACTERS = 4 << 20
MAX_DEPTH = 64
MAX_INTEGER = 1 << 63


def parsed(text: str) -> dict[str, Any]:
    """Return the tables in `text`. Raises tomllib.TOMLDecodeError for what TOML does not allow: an
    integer of more than 64 bits too, and for what nobody writes: MAX_DEPTH, MAX_CHARACTERS.
    """
    if len(text) > MAX_CHARACTERS:
        raise tomllib.TOMLDecodeError(f"it has more than {MAX_CHARACTERS} characters")

    # Python's reader takes the square of a dotted key's parts.
    if any(_has_long_key(line) for line in text.splitlines()):
        raise _too_deep()
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except RecursionError:
        raise _too_deep() from None
    except (ValueError, OverflowError):  # a date that there is not, thousands of digits
        raise tomllib.TOMLDecodeError("a number or a date in it is out of range") from None

    _check(tables)
    return tables


def _has_long_key(line: str) -> bool:
    """Decide whether a table's name, or what stands before a `=`, may have more than MAX_DEPTH
    parts.
    """
    if line.count(".") <= MAX_DEPTH:
        return False

    *keys, last = line.split("=")
    is_header = last.lstrip().startswith("[") and "," not in last and not keys
    return any(key.count(".") > MAX_DEPTH for key in [*keys, *[last] * is_header])


def _check(tables: dict[str, Any]) -> None:
    """Raise TOMLDecodeError for what is nested too deep, or a number that is too large."""
    layer: list[Any] = [tables]
    for _ in range(MAX_DEPTH):
        inner: list[Any] = []
        for value in layer:
            if isinstance(value, dict):
                inner.extend(value.values())
            elif isinstance(value, list):
                inner.extend(value)
            elif isinstance(value, int) and not -MAX_INTEGER <= value < MAX_INTEGER:
                raise tomllib.TOMLDecodeError("an integer in it has more than 64 bits")
        layer = inner
    if layer:
        raise _too_deep()


def _too_deep() -> tomllib.TOMLDecodeError:
    return tomllib.TOMLDecodeError(f"it is nested more than {MAX_DEPTH} deep")
