"""What a player plays: a recording as messages, view by view."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.runtime.config import Sections
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Pose, TrueTown

LEAD_NS = 1_000_000_000
"""The time of the first that was sensed: late enough for what led to it to be after 0."""


class Recording(Protocol):
    """Views in order of time, and what was sensed between them, stamped in ns since the run began.

    `settings` are those that such a recording asks of the modules, where the user sets none: which
    senses the robot has, and what they err by. `notes` are sentences on what of it is not played.
    """

    settings: Sections
    notes: Sequence[str]

    @property
    def stamps_ns(self) -> Sequence[int]:
        """Return the time of each view, increasing; there is one at least."""

    @property
    def true_poses(self) -> Sequence[Pose | None]:
        """Return where the robot really was at each view, None where nobody knows."""

    def before(self, number: int) -> list[Message]:
        """Return what was sensed after the view before this one, in order of time. Raises
        UsageError if it cannot be read.
        """

    def view(self, number: int) -> list[Message]:
        """Return what was sensed in a view. Raises UsageError if it cannot be read."""

    def town(self) -> TrueTown | None:
        """Return what really stood there; None if nobody knows."""


def poses_of(rows: Floats) -> list[Pose | None]:
    """Return (n, 3) rows of x_m, y_m and heading_rad as poses, None where one is NaN."""
    poses: list[Pose | None] = []
    for row in rows:
        if np.isnan(row).any():
            poses.append(None)
        else:
            x_m, y_m, heading_rad = row.tolist()
            poses.append(Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad))
    return poses
