"""The parameters of motor programs. Pure."""

from __future__ import annotations

from collections.abc import Mapping

from cogmap.errors import MessageError
from cogmap.schemas.base import Scalar

Parameters = Mapping[str, Scalar]


def number(parameters: Parameters, name: str) -> float:
    """Return a parameter that is a number. Raises MessageError if it is none."""
    value = parameters.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise MessageError(f"motor program: parameter {name!r} is {value!r}, not a number")
    return float(value)


def stamp(parameters: Parameters, name: str) -> int:
    """Return a parameter that is a time in ns. Raises MessageError if it is none."""
    value = parameters.get(name)
    if isinstance(value, bool) or not isinstance(value, int):
        raise MessageError(f"motor program: parameter {name!r} is {value!r}, not a time in ns")
    return value


def word(parameters: Parameters, name: str) -> str:
    """Return a parameter that is a word. Raises MessageError if it is none."""
    value = parameters.get(name)
    if not isinstance(value, str) or not value:
        raise MessageError(f"motor program: parameter {name!r} is {value!r}, not a word")
    return value
