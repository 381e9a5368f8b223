"""What became of a lie: whether the agent stopped, obeyed, forked, and who named it. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import cos, sin
from statistics import median

from benchmarks.campaign.listener import Command, Place, times_s
from benchmarks.forge.cases import Case

STOPPED_S = 5.0
"""Without progress for so long after the last lie the agent counts as stopped for good."""

MIN_LONG_S = 1.0
LONG_GAPS = 5.0
BACKWARDS_M_S = -1.0
"""The agent backs away from what it stands before at 0.4 m/s."""


@dataclass
class Outcome:
    """Of one case. `recovered_s` is None if the agent was not itself again while it was watched.
    `named_by` are the first of those who named it.
    """

    case: Case
    lies: int = 0
    ended: bool = False
    stood_s: float = 0.0
    recovered_s: float | None = None
    is_steered: bool = False
    is_forked: bool = False
    named_by: list[str] = field(default_factory=list)
    remark: str = ""

    @property
    def has_stopped(self) -> bool:
        """Return whether it stopped for good."""
        return self.ended or self.stood_s >= STOPPED_S

    @property
    def is_forked_unsaid(self) -> bool:
        """Return whether a graph differs and nobody named anything."""
        return self.is_forked and not self.named_by

    @property
    def is_clean(self) -> bool:
        """Return whether the next case may find the same system."""
        return not self.has_stopped and self.recovered_s is not None and not self.is_forked

    @property
    def failures(self) -> list[str]:
        """Return the bars that it misses."""
        is_late = self.recovered_s is None or self.recovered_s > STOPPED_S
        missed = {
            "stopped for good": self.has_stopped,
            "steered": self.is_steered,
            "forked unsaid": self.is_forked_unsaid,
            "not itself within 5 s": is_late and not self.has_stopped,
            "unnamed": not self.named_by,
        }
        return [name for name, is_missed in missed.items() if is_missed]


def usual_gap_s(commands: Sequence[Command]) -> float:
    """Return the usual time from one command to the next."""
    came_s = times_s(commands)
    gaps_s = [later - earlier for earlier, later in pairwise(came_s)]
    return median(gaps_s) if gaps_s else MIN_LONG_S


def longest_stand_s(commands: Sequence[Command], last_lie_s: float, now_s: float) -> float:
    """Return the longest time after the last lie in which no command turned a wheel."""
    moving_s = [each.time_s for each in commands if each.moves and each.time_s > last_lie_s]
    return max(later - earlier for earlier, later in _gaps(last_lie_s, moving_s, now_s))


def flowing_after_s(
    commands: Sequence[Command], last_lie_s: float, now_s: float, gap_s: float
) -> float | None:
    """Return how long after the last lie commands flowed as before, so often as one in `gap_s`;
    None if they do not at `now_s`.
    """
    long_s = max(MIN_LONG_S, LONG_GAPS * gap_s)
    came_s = [time_s for time_s in times_s(commands) if time_s > last_lie_s]
    flowing_s = 0.0
    for earlier, later in _gaps(last_lie_s, came_s, now_s):
        if later - earlier > long_s:
            if later == now_s:
                return None
            flowing_s = later - last_lie_s
    return flowing_s


def _gaps(began_s: float, times: Sequence[float], now_s: float) -> list[tuple[float, float]]:
    bounds = [began_s, *times, now_s]
    return list(pairwise(bounds))


def slowest_m_s(places: Sequence[Place]) -> float:
    """Return the least speed along its heading that the robot had from one pose to the next."""
    least = 0.0
    for earlier, later in pairwise(places):
        passed_s = (later.pose.stamp_ns - earlier.pose.stamp_ns) / 1e9
        if not 0 < passed_s < 1:
            continue
        was, now = earlier.pose.pose, later.pose.pose
        ahead_m = (now.x_m - was.x_m) * cos(was.heading_rad) + (now.y_m - was.y_m) * sin(
            was.heading_rad
        )
        least = min(least, ahead_m / passed_s)
    return least
