"""What a replay found."""

from __future__ import annotations

import msgspec


class Outcome(msgspec.Struct, kw_only=True):
    """How one incarnation of an instance did.

    `fed` counts its inputs, `same` and `different` its outputs. `missing_outputs` are in the log
    and were not published, `extra_outputs` the reverse. `missing_inputs` are those that the log
    lacks, by topic. `first` is the first difference in words.
    """

    module: str
    instance: str
    incarnation: int
    fed: int = 0
    same: int = 0
    different: int = 0
    missing_outputs: int = 0
    extra_outputs: int = 0
    missing_inputs: dict[str, int] = {}
    first: str = ""
    notes: list[str] = []
    busy_s: float = 0.0

    @property
    def is_same(self) -> bool:
        """Return whether every output of the log was published, with the same bytes."""
        return not (self.different or self.missing_outputs or self.first)


class Report(msgspec.Struct, kw_only=True):
    """What a replay of `path` found. `speed` is the log's duration over that of the replay."""

    path: str
    log_s: float
    wall_s: float
    speed: float
    same: bool
    first: str
    outcomes: list[Outcome]
