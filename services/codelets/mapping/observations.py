"""Observations of landmarks from places of the path: what binds the map to the path (beyond the
paper).

Corrections do not change them: they state what the agent sensed, relative to the place of the path.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable
from typing import NamedTuple

import numpy as np

from cogmap.estimation.pose_graph import Constraints, matvec
from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.se2 import rotation_matrices
from cogmap.schemas.array import Matrix
from cogmap.schemas.nodes import ObservationColumn, Observations, RangeColumn, observations_id
from cogmap.schemas.sensing import Percept

COLUMNS = len(ObservationColumn)
RANGE_COLUMNS = len(RangeColumn)
STAMP = ObservationColumn.STAMP_S
WHERE = slice(ObservationColumn.FORWARDS_M, ObservationColumn.LEFT_M + 1)
SPREAD = slice(ObservationColumn.ALONG_SD_M, ObservationColumn.ACROSS_SD_M + 1)
DIRECTION = ObservationColumn.DIRECTION_RAD
WHOLE = ObservationColumn.WHOLE
# An observation that deviates by this many standard deviations counts half as much as one that
# fits: it may be of another landmark.
DOUBTED = 2.0
# Times that observations are weighed anew.
ROUNDS = 6
# In rad^-2: a landmark has no heading, but the least squares need some information on each.
NO_HEADING = 1e-6
# Less than any sense is exact to: weights stay finite.
MIN_SD_M = 1e-3
# More than a stamp in s is rounded by, less than the time between two places.
SAME_PLACE_S = 1e-6


class Viewpoint(NamedTuple):
    """The pose that a landmark is observed from: the place of path segment `number` at `stamp_s`,
    and the step of path integration since then, (3,).

    `range_gain` is the share by which ranges are seen too large.
    """

    number: int
    stamp_s: float
    step: Floats
    range_gain: float


def extended(before: Observations | None, viewpoint: Viewpoint, percept: Percept) -> Observations:
    """Add one more to the observations of a landmark along a path segment, which has a range, and a
    bearing or none.
    """
    rows = np.zeros((0, COLUMNS)) if before is None else before.rows.numpy()
    ranges = _ranges_of(before)
    if percept.has_bearing:
        rows = np.vstack([rows, _sighting(viewpoint, percept)])
    else:
        ranges = np.vstack([ranges, _range_alone(viewpoint, percept)])

    return Observations(
        id=observations_id(viewpoint.number, percept.label),
        base_level=1.0,
        number=viewpoint.number,
        landmark=percept.label,
        rows=Matrix.of(rows),
        ranges=Matrix.of(ranges) if len(ranges) else None,
    )


def is_observed_from(observations: Observations | None, stamp_s: float) -> bool:
    """Return whether the newest observation is from the place at `stamp_s`, or from a later one."""
    if observations is None:
        return False

    seen_s = observations.rows.numpy()[-1:, STAMP].tolist()
    heard_s = _ranges_of(observations)[-1:, STAMP].tolist()
    newest_s: float = max(seen_s + heard_s)
    return newest_s >= stamp_s


def cauchy_weights(squared: Floats) -> Floats:
    """Compute how much each observation counts by its squared deviation, in variances."""
    weights: Floats = 1 / (1 + squared / DOUBTED**2)
    return weights


def _sighting(viewpoint: Viewpoint, percept: Percept) -> list[float]:
    forwards_m, left_m, turned_rad = viewpoint.step.tolist()
    direction_rad = turned_rad + percept.bearing_rad
    range_m = percept.range_m / (1 + viewpoint.range_gain)
    return [
        viewpoint.stamp_s,
        forwards_m + range_m * math.cos(direction_rad),
        left_m + range_m * math.sin(direction_rad),
        percept.range_sd_m,
        range_m * percept.bearing_sd_rad,
        direction_rad,
        float(percept.whole),
    ]


def _range_alone(viewpoint: Viewpoint, percept: Percept) -> list[float]:
    """Return a row as RangeColumn; the gain of ranges alone is estimated with the landmarks."""
    forwards_m, left_m, _ = viewpoint.step.tolist()
    return [viewpoint.stamp_s, forwards_m, left_m, percept.range_m, percept.range_sd_m]


def _ranges_of(observations: Observations | None) -> Floats:
    """Return the (m, 5) rows of the ranges alone."""
    if observations is None or observations.ranges is None:
        return np.zeros((0, RANGE_COLUMNS))
    return observations.ranges.numpy()


class Sightings(NamedTuple):
    """m observations as arrays: `place` (m,) on the path, `landmark` (m,) in `labels`, `where_m`
    (m, 2), `information` (m, 2, 2), and whether it was seen `whole` (m,).
    """

    labels: tuple[str, ...]
    place: Indices
    landmark: Indices
    where_m: Floats
    information: Floats
    whole: Booleans

    @classmethod
    def of(cls, observations: Iterable[Observations], stamps_s: Floats) -> Sightings:
        """Gather the observations made from the places of the path at `stamps_s`, (n,)."""
        records = [record for record in observations if len(record.rows.numpy())]
        labels = tuple(sorted({record.landmark for record in records}))
        number_of = {label: number for number, label in enumerate(labels)}

        parts = [record.rows.numpy() for record in records]
        rows = np.vstack([np.zeros((0, COLUMNS)), *parts])
        numbers = np.array([number_of[record.landmark] for record in records], np.int64)
        landmark = np.repeat(numbers, [len(part) for part in parts])

        place = np.searchsorted(stamps_s, rows[:, STAMP])
        is_known = np.zeros(len(rows), bool)
        if len(stamps_s):
            place = place.clip(0, len(stamps_s) - 1)
            is_known = np.abs(stamps_s[place] - rows[:, STAMP]) < SAME_PLACE_S

        known = rows[is_known]
        turn = rotation_matrices(known[:, DIRECTION])
        sd_m = known[:, None, SPREAD].clip(MIN_SD_M)
        return cls(
            labels=labels,
            place=place[is_known],
            landmark=landmark[is_known],
            where_m=known[:, WHERE],
            information=turn * sd_m**-2 @ turn.mT,
            whole=known[:, WHOLE] > 0,
        )

    def of_known_extent(self, known: Container[str]) -> Sightings:
        """Choose those of landmarks that were seen whole, or whose size is `known`, and these
        landmarks.
        """
        is_known = np.array([label in known for label in self.labels], bool)
        chosen = self.whole | is_known[self.landmark]
        numbers, landmark = np.unique(self.landmark[chosen], return_inverse=True)
        return Sightings(
            labels=tuple(self.labels[number] for number in numbers.tolist()),
            place=self.place[chosen],
            landmark=landmark,
            where_m=self.where_m[chosen],
            information=self.information[chosen],
            whole=self.whole[chosen],
        )

    def weights(self, poses: Floats, landmarks_m: Floats) -> Floats:
        """Compute how much each counts, (m,), by Cauchy's weights, if the path is at (n, 3) `poses`
        and landmarks at (k, 2).
        """
        offset_m = landmarks_m[self.landmark] - poses[self.place, :2]
        turn = rotation_matrices(poses[self.place, 2])
        residual_m = np.einsum("mba,mb->ma", turn, offset_m) - self.where_m
        squared = np.einsum("ma,mab,mb->m", residual_m, self.information, residual_m)

        return cauchy_weights(squared)

    def landmarks_m(self, poses: Floats) -> Floats:
        """Estimate where the landmarks are most likely, (k, 2), if the path is at (n, 3) `poses`:
        the means of where they were seen, weighed anew in each round, from the medians on.
        """
        turn = rotation_matrices(poses[self.place, 2])
        seen_m = poses[self.place, :2] + matvec(turn, self.where_m)
        information = turn @ self.information @ turn.mT

        count = len(self.labels)
        medians = [np.median(seen_m[self.landmark == number], axis=0) for number in range(count)]
        landmarks_m: Floats = np.array(medians).reshape(-1, 2)
        for _ in range(ROUNDS):
            weighed = information * self.weights(poses, landmarks_m)[:, None, None]
            total = self._sums(weighed)
            pull = self._sums(matvec(weighed, seen_m))
            landmarks_m = np.asarray(np.linalg.solve(total, pull[..., None])[..., 0], np.float64)

        return landmarks_m

    def _sums(self, values: Floats) -> Floats:
        """Compute the (k, ...) sums of the (m, ...) values of each landmark's sightings."""
        _, *shape = values.shape
        sums = np.zeros((len(self.labels), *shape))
        np.add.at(sums, self.landmark, values)
        return sums

    def constraints(self, first_landmark: int, weights: Floats) -> Constraints:
        """Return constraints between places of the path and landmarks, the latter as poses from
        number `first_landmark` on.
        """
        count = len(self.place)
        information = np.zeros((count, 3, 3))
        information[:, :2, :2] = self.information * weights[:, None, None]
        information[:, 2, 2] = NO_HEADING
        return Constraints(
            i=self.place,
            j=first_landmark + self.landmark,
            measurement=np.column_stack([self.where_m, np.zeros(count)]),
            information=information,
        )
