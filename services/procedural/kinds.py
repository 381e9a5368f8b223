"""The kinds of nodes and their fields, as patterns name them."""

from __future__ import annotations

import enum
from collections.abc import Iterable
from typing import Any

import msgspec

from cogmap.schemas.base import Scalar
from cogmap.schemas.nodes import FUNCTIONS, KINDS, SATISFIED_BY, GraphNode, Node, kind_name

NEED = "need"
FUNCTION = "function"
_MEANING = {("need", "label"): NEED, ("goal", "need"): NEED, ("object", "function"): FUNCTION}
_SCALARS: dict[type[msgspec.inspect.Type], type] = {
    msgspec.inspect.BoolType: bool,
    msgspec.inspect.FloatType: float,
    msgspec.inspect.IntType: int,
    msgspec.inspect.StrType: str,
    msgspec.inspect.EnumType: str,
}


class NodeKinds:
    """The kinds that this version knows, and others that somebody's codelets write as generic
    nodes; the needs and the functions that it knows, and others of somebody's body and perception.
    """

    def __init__(
        self,
        generic: Iterable[str] = (),
        needs: Iterable[str] = (),
        functions: Iterable[str] = (),
    ) -> None:
        self._known = {NEED: [*SATISFIED_BY, *needs], FUNCTION: [*FUNCTIONS, *functions]}
        self._types: dict[str, type[GraphNode]] = {}
        for kind in KINDS:
            if kind is not Node:
                self._types[kind_name(kind)] = kind
        for name in generic:
            self._types.setdefault(name, Node)

    @property
    def names(self) -> list[str]:
        """Return every kind."""
        return sorted(self._types)

    def fields(self, kind: str) -> list[str] | None:
        """Return the fields of a kind; None if it may have any."""
        if self._types[kind] is Node:
            return None
        return [field.encode_name for field in msgspec.structs.fields(self._types[kind])]

    def known(self, meaning: str) -> list[str]:
        """Return the words that there are for NEED or FUNCTION."""
        return self._known[meaning]

    def meaning(self, kind: str, field: str) -> str:
        """Return what the words of a field mean, NEED or FUNCTION; empty if they may be any."""
        return _MEANING.get((kind, field), "")

    def scalar(self, kind: str, field: str) -> type | None:
        """Return the type of a field, of an enumeration that of its values; None if it is no
        scalar, or may be any.
        """
        if self.fields(kind) is None:
            return None
        types = {each.encode_name: each.type for each in msgspec.structs.fields(self._types[kind])}
        found = msgspec.inspect.type_info(types[field])
        return _SCALARS.get(type(found))

    def value(self, kind: str, field: str, value: Any) -> Scalar:
        """Convert a value to the type of its field: of an enumeration also the name of a member.

        Raises ValueError if it is no such value.
        """
        if self.fields(kind) is not None:
            fields = msgspec.structs.fields(self._types[kind])
            wanted = {each.encode_name: each.type for each in fields}[field]
            if isinstance(wanted, type) and issubclass(wanted, enum.Enum):
                named = {name.lower(): member for name, member in wanted.__members__.items()}
                value = named.get(value, value)
                if value not in named.values():
                    raise ValueError(f"{value!r} is none of {', '.join(named)}")

            try:
                value = msgspec.convert(value, wanted)
            except msgspec.ValidationError as error:
                raise ValueError(f"{value!r}: {error}") from None

        if not isinstance(value, bool | int | float | str):
            raise ValueError(f"{value!r} is neither a number, a word, true nor false")
        return value
