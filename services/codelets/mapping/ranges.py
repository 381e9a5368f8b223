"""Observations of landmarks by their range alone: together they say where each stands, up to where
the path leaves it open (beyond the paper).

All ranges come from one sense, which may measure too far by a share: that gain is estimated with
the landmarks, since a landmark heard from all sides shows it.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from cogmap.estimation.pose_graph import Constraints
from cogmap.estimation.trilateration import positions_from_ranges
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import rotation_matrices
from cogmap.schemas.nodes import Observations, RangeColumn
from cogmap.services.codelets.mapping.observations import (
    MIN_SD_M,
    NO_HEADING,
    SAME_PLACE_S,
    cauchy_weights,
)

COLUMNS = len(RangeColumn)
STAMP = RangeColumn.STAMP_S
CENTRE = slice(RangeColumn.FORWARDS_M, RangeColumn.LEFT_M + 1)
# Of the share by which a sense that nobody has calibrated measures ranges too far or too near.
GAIN_SD = 0.1
# A landmark that was heard from fewer places stands anywhere.
MIN_RANGES = 12
# In m^-2, across the line of sight: the least squares need some information there.
NO_DIRECTION = 1e-6


class Landmarks(NamedTuple):
    """Where landmarks are most likely, (k, 2), with (k, 2, 2) covariances, and by what share their
    ranges are seen too large.
    """

    positions_m: Floats
    covariance_m2: Floats
    range_gain: float


class Ranges(NamedTuple):
    """m ranges as arrays: `place` (m,) on the path, `landmark` (m,) in `labels`, `centre_m` (m, 2)
    the agent as seen from the place, `range_m` and `sd_m` (m,).
    """

    labels: tuple[str, ...]
    place: Indices
    landmark: Indices
    centre_m: Floats
    range_m: Floats
    sd_m: Floats

    @classmethod
    def of(cls, observations: Iterable[Observations], stamps_s: Floats) -> Ranges:
        """Gather the ranges from the places of the path at `stamps_s`, (n,), to the landmarks that
        were heard from MIN_RANGES places or more.
        """
        parts: dict[str, list[Floats]] = {}
        for record in observations:
            if record.ranges is not None:
                parts.setdefault(record.landmark, []).append(record.ranges.numpy())

        labels = []
        chosen = [np.zeros((0, COLUMNS))]
        places = [np.zeros(0, np.int64)]
        for label, tables in sorted(parts.items()):
            rows = np.vstack(tables)
            place = stamps_s.searchsorted(rows[:, STAMP]).clip(max=max(0, len(stamps_s) - 1))
            is_known = np.abs(stamps_s[place] - rows[:, STAMP]) < SAME_PLACE_S
            if is_known.sum() >= MIN_RANGES:
                labels.append(label)
                chosen.append(rows[is_known])
                places.append(place[is_known])

        rows = np.vstack(chosen)
        counts = [len(part) for part in chosen[1:]]
        return cls(
            labels=tuple(labels),
            place=np.concatenate(places),
            landmark=np.repeat(np.arange(len(labels)), counts),
            centre_m=rows[:, CENTRE],
            range_m=rows[:, RangeColumn.RANGE_M],
            sd_m=rows[:, RangeColumn.RANGE_SD_M].clip(MIN_SD_M),
        )

    def landmarks(self, poses: Floats) -> Landmarks:
        """Estimate where the landmarks are if the path is at (n, 3) `poses`, and the gain of their
        ranges, of which only GAIN_SD is known.
        """
        found = positions_from_ranges(
            self._centres_m(poses), self.range_m, self.sd_m, self.landmark, GAIN_SD
        )
        return Landmarks(*found)

    def constraints(self, poses: Floats, found: Landmarks, first_landmark: int) -> Constraints:
        """Return constraints between the places of the path, about (n, 3) `poses`, and landmarks,
        these as poses from number `first_landmark` on: along the line between the two, as both are
        believed.
        """
        turn = rotation_matrices(poses[self.place, 2])
        offset_m = found.positions_m[self.landmark] - self._centres_m(poses)
        distance_m = np.hypot(offset_m[:, 0], offset_m[:, 1]).clip(MIN_SD_M)
        direction = np.einsum("mba,mb->ma", turn, offset_m / distance_m[:, None])

        range_m = self.range_m / (1 + found.range_gain)
        weights = cauchy_weights(np.square((distance_m - range_m) / self.sd_m))
        along = direction[:, :, None] * direction[:, None, :]
        across = np.eye(2) - along
        known = (weights / self.sd_m**2)[:, None, None]

        count = len(self.place)
        information = np.zeros((count, 3, 3))
        information[:, :2, :2] = along * known + across * NO_DIRECTION
        information[:, 2, 2] = NO_HEADING
        where_m = self.centre_m + range_m[:, None] * direction
        return Constraints(
            i=self.place,
            j=first_landmark + self.landmark,
            measurement=np.column_stack([where_m, np.zeros(count)]),
            information=information,
        )

    def _centres_m(self, poses: Floats) -> Floats:
        """Compute where the agent was at each range, (m, 2)."""
        turn = rotation_matrices(poses[self.place, 2])
        centres_m: Floats = poses[self.place, :2] + np.einsum("mab,mb->ma", turn, self.centre_m)
        return centres_m
