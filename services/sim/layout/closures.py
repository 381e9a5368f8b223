"""When streets are closed and opened again. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Annotated

import msgspec

from cogmap.errors import ConfigError, MessageError
from cogmap.hints import did_you_mean
from cogmap.schemas.base import Name
from cogmap.schemas.sensing import StreetClosure
from cogmap.services.sim.layout.plan import Road

Seconds = Annotated[float, msgspec.Meta(ge=0, le=1e9)]


class Closure(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A street that a barrier closes for some time."""

    street: Annotated[Name, msgspec.Meta(description="Name of the street.")]
    from_s: Annotated[
        Seconds,
        msgspec.Meta(description="Simulated time at which it is closed, in s."),
    ]
    to_s: Annotated[
        Seconds,
        msgspec.Meta(description="Simulated time at which it is opened again, in s."),
    ] = 1e9


class ClosedStreets:
    """Which streets are closed: as the schedule says, unless a command has changed it since."""

    def __init__(self, roads: Sequence[Road], schedule: Sequence[Closure]) -> None:
        self._names = frozenset(road.name for road in roads)
        for closure in schedule:
            if closure.street not in self._names:
                raise ConfigError(f"[sim] closures: {self._unknown(closure.street)}")

        self._changes = _changes(schedule)
        self._closed: set[str] = set()
        self._is_changed = False

    @property
    def names(self) -> frozenset[str]:
        """Return the streets that are closed now."""
        return frozenset(self._closed)

    def advance(self, now_ns: int) -> bool:
        """Follow the schedule up to a time; return whether a street was closed or opened since the
        last call.
        """
        while self._changes and self._changes[0][0] * 1e9 <= now_ns:
            _, street, is_closed = self._changes.pop(0)
            self._set(street, is_closed)

        is_changed = self._is_changed
        self._is_changed = False
        return is_changed

    def on_closure(self, closure: StreetClosure) -> None:
        """Close or open a street now, whatever the schedule did before. Raises MessageError if
        there is none of that name.
        """
        if closure.street not in self._names:
            raise MessageError(self._unknown(closure.street))

        self._set(closure.street, closure.closed)

    def _set(self, street: str, is_closed: bool) -> None:
        self._is_changed = True
        if is_closed:
            self._closed.add(street)
        else:
            self._closed.discard(street)

    def _unknown(self, street: str) -> str:
        names = sorted(self._names)
        meant = did_you_mean(street, names, f"name one of {', '.join(names)}")
        return f"there is no street {street!r} in the town: {meant}"


def _changes(schedule: Iterable[Closure]) -> list[tuple[float, str, bool]]:
    """Return time in s, street, and whether it is closed then, in order; at one time streets are
    opened first.
    """
    changes = []
    for closure in schedule:
        changes.append((closure.from_s, closure.street, True))
        changes.append((closure.to_s, closure.street, False))

    return sorted(changes, key=lambda change: (change[0], change[2], change[1]))
