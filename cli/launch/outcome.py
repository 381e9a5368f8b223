"""How a drive ends."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class Outcome(enum.Enum):
    """How a drive ended. The value is what `summary.json` holds as `ended_by`.

    ROUTE_COMPLETE: every goal is reached or, where there was none, the time of the drive is over.
    RECORDING_OVER: all of a recording was played.
    MODULE_FAILED: a process cannot run, as it dies again and again, or the disk takes no more.
    STALLED: nothing happens any more. STUCK: time passes, and the robot stays where it is.
    TOO_SLOW: the same, as the machine is too slow for the robot to move safely. OUT_OF_ENERGY: the
    robot's battery is empty.
    """

    ROUTE_COMPLETE = "route complete"
    RECORDING_OVER = "recording over"
    INTERRUPTED = "interrupted"
    TIME_LIMIT = "time limit"
    MODULE_FAILED = "module failed"
    STALLED = "stalled"
    STUCK = "stuck"
    TOO_SLOW = "too slow"
    OUT_OF_ENERGY = "out of energy"

    @property
    def exit_code(self) -> int:
        """Return what `cogmap run` exits with."""
        match self:
            case Outcome.ROUTE_COMPLETE | Outcome.RECORDING_OVER:
                return 0
            case Outcome.INTERRUPTED:
                return 130
            case _:
                return 1


@dataclass(frozen=True)
class Ending:
    """An outcome, and a sentence that names the cause and the remedy where there is one."""

    outcome: Outcome
    reason: str
