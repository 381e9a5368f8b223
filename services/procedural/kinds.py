"""The kinds of nodes and their fields, as patterns name them."""

from __future__ import annotations

import enum
from collections.abc import Iterable
from typing import Any

import msgspec

from schemas.base import Scalar
from schemas.nodes import KINDS, GraphNode, Node, kind_name


class NodeKinds:
    """The kinds that this version knows, and others that somebody's codelets write as generic
    nodes.
    """

    def __init__(self, generic: Iterable[str] = ()) -> None:
        self._types: dict[str, type[GraphNode]] = {}
        for kind in KINDS:
            if kind is not Node:
                self._types[kind_name(kind)] = kind
        for name in generic:
            self._types.setdefault(name, Node)

    @property
    def names(self) -> list[str]:
        """Every kind."""
        return sorted(self._types)

    def fields(self, kind: str) -> list[str] | None:
        """The fields of a kind; None where it may have any."""
        if self._types[kind] is Node:
            return None
        return [field.encode_name for field in msgspec.structs.fields(self._types[kind])]

    def value(self, kind: str, field: str, value: Any) -> Scalar:
        """A value of a field, of its type: of an enumeration also by the name of a member.

        Raises ValueError where it is no such value.
        """
        if self.fields(kind) is not None:
            value = self._converted(kind, field, value)
        if not isinstance(value, bool | int | float | str):
            raise ValueError(f"{value!r} is neither a number, a word, true nor false")
        return value

    def _converted(self, kind: str, field: str, value: Any) -> Any:
        types = {each.encode_name: each.type for each in msgspec.structs.fields(self._types[kind])}
        wanted = types[field]
        if isinstance(wanted, type) and issubclass(wanted, enum.Enum):
            named = {name.lower(): member for name, member in wanted.__members__.items()}
            if value in named:
                return named[value]
            if value not in named.values():
                raise ValueError(f"{value!r} is none of {', '.join(named)}")

        try:
            return msgspec.convert(value, wanted)
        except msgspec.ValidationError as error:
            raise ValueError(f"{value!r}: {error}") from None
