"""A log of landmarks as views: what was seen at each stamp, and what the wheels did until then."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np

from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats, Indices
from cogmap.runtime.config import Sections
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import (
    Building,
    Percept,
    Percepts,
    Pose,
    RangeScan,
    SelfMotion,
    TrueTown,
)
from cogmap.services.player.recording import LEAD_NS

TICK_S = 0.2
"""Where nothing was seen for so long, nor soon is, there is a view of nothing: as often as the
town's robot has one.
"""

SAME_VIEW_S = 0.005
"""What was seen within this time of the one before was seen in one view: the stamps of one picture
differ by a rounding.
"""

POST_M = 0.1
"""What a surveyed landmark is drawn as: its size is not known."""


@dataclass(frozen=True, eq=False)
class LandmarkLog:
    """The views of a log: at the (n,) `stamps_s`, `percepts` of each, and (k, 5) rows of the
    `motions` since the view before. Of `surveyed`, landmarks by name, observers alone know. `rays`
    are those of each view, (k, 2) rows of bearing_rad and range_m; none if nobody measured any.
    """

    stamps_s: Floats
    percepts: Sequence[list[Percept]]
    motions: Sequence[Floats]
    true_poses: Sequence[Pose | None]
    surveyed: dict[str, tuple[float, float]]
    settings: Sections
    notes: Sequence[str] = ()
    rays: Sequence[Floats] = ()

    @cached_property
    def stamps_ns(self) -> list[int]:
        """Return the time of each view."""
        since_first_s = self.stamps_s - self.stamps_s[0]
        since_first_ns: list[int] = np.rint(since_first_s * 1e9).astype(np.int64).tolist()
        return [LEAD_NS + each_ns for each_ns in since_first_ns]

    def before(self, number: int) -> list[Message]:
        """Return nothing: self-motion comes with each view."""
        return []

    def view(self, number: int) -> list[Message]:
        """Return what was seen, the self-motion until then, and a range scan, without rays where
        nobody measured where it was free.
        """
        stamps_ns = self.stamps_ns
        stamp_ns = stamps_ns[number]
        rays = self.rays[number] if self.rays else np.zeros((0, 2))
        no_points = Array.of(np.zeros((0, 2), np.float32))
        motion = SelfMotion(
            stamp_ns=stamp_ns,
            frame=number,
            since_ns=stamps_ns[max(0, number - 1)],
            motions=Array.of(self.motions[number]),
        )
        scan = RangeScan(
            stamp_ns=stamp_ns,
            frame=number,
            bearing_rad=Array.of(rays[:, 0], "<f4"),
            range_m=Array.of(rays[:, 1], "<f4"),
        )
        seen = Percepts(
            stamp_ns=stamp_ns, frame=number, objects=self.percepts[number], road_m=no_points
        )
        return [motion, scan, seen]

    def town(self) -> TrueTown | None:
        """Return the landmarks where they were surveyed; None if nobody did."""
        if not self.surveyed:
            return None

        buildings = [
            Building(
                name=name,
                pose=Pose(x_m=x_m, y_m=y_m, heading_rad=0.0),
                width_m=POST_M,
                depth_m=POST_M,
                height_m=1.0,
            )
            for name, (x_m, y_m) in self.surveyed.items()
        ]
        return TrueTown(seed=0, streets=[], buildings=buildings)


def view_stamps(observed_s: Floats, begin_s: float, end_s: float) -> tuple[Floats, Indices]:
    """Return the (n,) stamps of views from `begin_s` to `end_s`, and which of these each of (k,)
    stamps of observations in between, in order of time, belongs to.

    There is one at `begin_s`, one for each group of observations, and ticks where there is none.
    """
    is_new = np.diff(observed_s, prepend=begin_s) > SAME_VIEW_S
    seen_s = observed_s[is_new]

    ticks = [np.array([begin_s])]
    for last_s, next_s in pairwise([begin_s, *seen_s.tolist(), end_s]):
        ticks.append(np.arange(last_s + TICK_S, next_s - TICK_S / 2, TICK_S))

    stamps_s = np.sort(np.concatenate([*ticks, seen_s]))
    view_of = np.searchsorted(stamps_s, observed_s, side="right") - 1
    return stamps_s, view_of


def check_landmarks(names: Collection[int], source: Path, kind: str) -> None:
    """Raise UsageError if there are fewer than two landmarks, by which nothing can be mapped."""
    if len(set(names)) < 2:
        seen = f"all its observations are of one {kind}" if names else f"no {kind} was observed"
        raise UsageError(
            f"{source}: {seen}, by which no robot finds where it is: give a log with several, each "
            "with a number of its own"
        )


def notes_of_order(late: int) -> list[str]:
    """Say how many observations came with a stamp before that of an earlier one, if any did."""
    return [f"{late} observations came late, and were put in order"] if late else []
