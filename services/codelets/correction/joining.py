"""Places of the path that are joined into older ones where these stood already (beyond the paper).

The path then grows with the town, not with driving time. Pure.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.estimation.pose_graph import residuals
from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.se2 import compose, relative, wrap_angle
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.mapping.path import JOINED, LAST, POSE, STAMP, steps_of

# A place is the same within twice the path's spacing, headed alike to 22 degrees.
SAME_M = 2.0
SAME_RAD = np.pi / 8
# The error of a place's pose, seen from the place that it is joined to.
JOIN_SD_M = 0.2
JOIN_SD_RAD = 0.02
# In standard deviations of a pose: of true steps one in 65,000 errs by more.
IMPOSSIBLE_SD = 5.0
STAYS = -1


class Joining(NamedTuple):
    """Which of k `known` places, (k, COLUMNS), each of n later `places` is joined into: `into`
    (n,), or STAYS.
    """

    known: Floats
    places: Floats
    into: Indices

    def preceded(self, rows: Floats) -> Joining:
        """Add (m, COLUMNS) places before the others; they stay."""
        stay = np.full(len(rows), STAYS)
        return self._replace(
            places=np.vstack([rows, self.places]), into=np.concatenate([stay, self.into])
        )

    @property
    def stays(self) -> Booleans:
        """Return which places stay, (n,)."""
        stays: Booleans = self.into == STAYS
        return stays

    @property
    def poses(self) -> Floats:
        """Return the (n, 3) poses of what the places become."""
        poses = self.places[:, POSE].copy()
        is_joined = ~self.stays
        poses[is_joined] = self.known[self.into[is_joined]][:, POSE]
        return poses

    @property
    def stamps_s(self) -> Floats:
        """Return the (n,) stamps of what the places become."""
        stamps_s = self.places[:, STAMP].copy()
        is_joined = ~self.stays
        stamps_s[is_joined] = self.known[self.into[is_joined], STAMP]
        return stamps_s

    @property
    def offsets(self) -> Floats:
        """Return each place in the frame of what it becomes, (n, 3)."""
        return relative(self.poses, self.places[:, POSE])


def joining(known: Floats, places: Floats, config: Config) -> Joining:
    """Return which of the places (n, COLUMNS) are joined into which of the `known` ones, (k,
    COLUMNS): the nearest that the agent left `revisit_s` before at least, headed as it was then.
    """
    into = np.full(len(places), STAYS)
    if not len(known):
        return Joining(known, places, into)

    offset = places[:, None, POSE] - known[:, POSE]
    away_m = np.hypot(offset[..., 0], offset[..., 1])
    is_same = (away_m <= SAME_M) & (np.abs(wrap_angle(offset[..., 2])) <= SAME_RAD)
    is_same &= known[:, STAMP] <= places[:, None, STAMP] - config.revisit_s

    nearest = np.where(is_same, away_m, np.inf).argmin(axis=1)
    is_joined = is_same.any(axis=1)
    into[is_joined] = nearest[is_joined]
    return Joining(known, places, into)


def left(joined: Joining) -> tuple[Floats, float]:
    """Return the places that stay, (m, COLUMNS), each with the number of those joined since the one
    before; and the number of those joined after the last.
    """
    rows = []
    count = 0.0
    for row, stays in zip(joined.places, joined.stays.tolist(), strict=True):
        count += row[JOINED]
        if not stays:
            count += 1.0
            continue

        kept = row.copy()
        kept[JOINED] = count
        rows.append(kept)
        count = 0.0

    return np.array(rows).reshape(-1, joined.places.shape[1]), count


def visited(joined: Joining) -> Floats:
    """Return the known places, (k, COLUMNS), each with the time when the agent was there last."""
    known = joined.known.copy()
    is_joined = ~joined.stays
    np.maximum.at(known[:, LAST], joined.into[is_joined], joined.places[is_joined, LAST])
    return known


def joins(joined: Joining, config: Config) -> Floats:
    """Compute the steps of path integration, (m, 7) in the columns of JoinColumn, from a place that
    stays to one that does not or back, between what these become.
    """
    steps = steps_of(joined.places, config)
    before = joined.offsets[:-1]
    after = joined.offsets[1:]
    origin = np.zeros(3)
    led = compose(compose(before, steps.measurement), relative(after, origin))

    stamps_s = joined.stamps_s
    variance_m2 = steps.variance_m2 + JOIN_SD_M**2
    variance_rad2 = steps.variance_rad2 + JOIN_SD_RAD**2
    rows = np.column_stack([stamps_s[:-1], stamps_s[1:], led, variance_m2, variance_rad2])

    stays = joined.stays
    is_between = stays[:-1] != stays[1:]
    is_successive = joined.places[1:, JOINED] == 0
    error = residuals(joined.places[:, POSE], steps)

    # If the agent was lost, it was not at the place that this one is joined into.
    squared_m2 = (error[:, :2] ** 2).sum(axis=1)
    squared = squared_m2 / variance_m2 + error[:, 2] ** 2 / variance_rad2
    is_possible = squared <= IMPOSSIBLE_SD**2
    chosen: Floats = rows[is_between & is_successive & is_possible]
    return chosen
