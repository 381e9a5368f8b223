"""The facts of a run that all its modules share: the section [run] of the configuration."""

from __future__ import annotations

from typing import Annotated

import msgspec

SECTION = "run"

Instances = Annotated[int, msgspec.Meta(ge=1, le=1000)]


class Run(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Who takes part, and whether they wait for each other."""

    lockstep: Annotated[
        bool,
        msgspec.Meta(
            description="Whether every module waits for all that it depends on, so that a seed "
            "gives the same bytes; otherwise time is the wall's, and a cycle ends at "
            "its deadline."
        ),
    ] = False
    participants: Annotated[
        dict[str, Instances],
        msgspec.Meta(
            description="Modules, and instances of each, required before time begins; in lockstep "
            "a cycle waits for what they publish in each."
        ),
    ] = {}
    energy: Annotated[
        bool,
        msgspec.Meta(
            description="Whether the robot has a battery that runs down, and the town charging "
            "places."
        ),
    ] = False

    def has_any(self, *modules: str) -> bool:
        """Return true if one of `modules` takes part."""
        return not self.participants.keys().isdisjoint(modules)


REAL_TIME = Run()
LOCKSTEP = Run(lockstep=True)
