"""When buildings are torn down. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import msgspec

from cogmap.errors import ConfigError


class Removal(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A building that is torn down."""

    building: Annotated[
        int,
        msgspec.Meta(ge=0, le=1_000_000, description="Its place among the town's."),
    ]
    from_s: Annotated[
        float,
        msgspec.Meta(ge=0, le=1e9, description="Simulated time from which it is gone, in s."),
    ]


class RemovedBuildings:
    """Which of so many buildings are gone, by a schedule."""

    def __init__(self, buildings: int, schedule: Sequence[Removal]) -> None:
        for removal in schedule:
            if removal.building >= buildings:
                raise ConfigError(
                    f"[sim] removals: there is no building {removal.building} in the town: "
                    f"choose one of 0 to {buildings - 1}"
                )

        self._left = sorted(schedule, key=lambda removal: removal.from_s)
        self._gone: set[int] = set()

    @property
    def numbers(self) -> frozenset[int]:
        """Return the buildings that are gone now."""
        return frozenset(self._gone)

    def advance(self, now_ns: int) -> bool:
        """Follow the schedule to a time; return whether a building has gone since the last call."""
        before = len(self._gone)
        while self._left and self._left[0].from_s * 1e9 <= now_ns:
            self._gone.add(self._left.pop(0).building)

        return len(self._gone) > before
