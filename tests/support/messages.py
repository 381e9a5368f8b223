"""Choosing among messages."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

T = TypeVar("T")


def of_type(kind: type[T], messages: Iterable[object]) -> list[T]:
    """The messages, nodes or operations of one type, in their order."""
    return [message for message in messages if isinstance(message, kind)]
