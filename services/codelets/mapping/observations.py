"""Observations of landmarks from places of the path: what binds the map to the path (beyond the
paper).

Corrections do not change them: they state what the agent sensed, relative to the place of the path.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from cogmap.estimation.pose_graph import Constraints, matvec
from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.se2 import rotation_matrices
from cogmap.schemas.array import Matrix
from cogmap.schemas.nodes import ObservationColumn, Observations, observations_id
from cogmap.schemas.sensing import Percept

COLUMNS = len(ObservationColumn)
STAMP = ObservationColumn.STAMP_S
WHERE = slice(ObservationColumn.FORWARDS_M, ObservationColumn.LEFT_M + 1)
SPREAD = slice(ObservationColumn.ALONG_SD_M, ObservationColumn.ACROSS_SD_M + 1)
DIRECTION = ObservationColumn.DIRECTION_RAD
# An observation that deviates by this many standard deviations counts half as much as one that
# fits: it may be of another landmark.
DOUBTED = 2.0
ROUNDS = 6
NO_HEADING = 1e-6
MIN_SD_M = 1e-3
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
    """The observations of a landmark along a path segment, with one more."""
    row = _row(viewpoint, percept)
    rows = np.array([row])
    if before is not None:
        rows = np.vstack([before.rows.numpy(), rows])

    return Observations(
        id=observations_id(viewpoint.number, percept.label),
        base_level=1.0,
        number=viewpoint.number,
        landmark=percept.label,
        rows=Matrix.of(rows),
    )


def _row(viewpoint: Viewpoint, percept: Percept) -> list[float]:
    """One observation, in the columns of ObservationColumn."""
    forwards_m, left_m, turned_rad = viewpoint.step.tolist()
    direction_rad = turned_rad + percept.bearing_rad
    range_m = percept.range_m / (1 + viewpoint.range_gain)

    forwards_m += range_m * math.cos(direction_rad)
    left_m += range_m * math.sin(direction_rad)
    across_sd_m = range_m * percept.bearing_sd_rad
    return [
        viewpoint.stamp_s,
        forwards_m,
        left_m,
        percept.range_sd_m,
        across_sd_m,
        direction_rad,
    ]


def is_observed_from(observations: Observations | None, stamp_s: float) -> bool:
    """Whether the newest observation is from the place at `stamp_s`, or from a later one."""
    if observations is None:
        return False

    rows = observations.rows.numpy()
    newest_s = float(rows[-1, STAMP])
    return newest_s >= stamp_s


class Sightings(NamedTuple):
    """m observations as arrays: `place` (m,) on the path, `landmark` (m,) in `labels`, `where_m`
    (m, 2), `information` (m, 2, 2).
    """

    labels: tuple[str, ...]
    place: Indices
    landmark: Indices
    where_m: Floats
    information: Floats

    @classmethod
    def of(cls, observations: Iterable[Observations], stamps_s: Floats) -> Sightings:
        """The observations that were made from the places of the path at `stamps_s`, (n,)."""
        records = list(observations)
        labels = tuple(sorted({record.landmark for record in records}))

        parts = [record.rows.numpy() for record in records]
        rows = np.vstack([np.zeros((0, COLUMNS)), *parts])
        lengths = [len(part) for part in parts]
        landmark = np.repeat(_numbers(records, labels), lengths)

        place, is_known = _places_at(rows[:, STAMP], stamps_s)
        known = rows[is_known]
        return cls(
            labels=labels,
            place=place[is_known],
            landmark=landmark[is_known],
            where_m=known[:, WHERE],
            information=_information(known),
        )

    def weights(self, poses: Floats, landmarks_m: Floats) -> Floats:
        """(m,) how much each counts, the path being at (n, 3) `poses` and landmarks at (k, 2):
        Cauchy's weights.
        """
        residual_m = self._expected_m(poses, landmarks_m) - self.where_m
        squared = np.einsum("ma,mab,mb->m", residual_m, self.information, residual_m)
        doubt = squared / DOUBTED**2

        weights: Floats = 1 / (1 + doubt)
        return weights

    def _expected_m(self, poses: Floats, landmarks_m: Floats) -> Floats:
        """(m, 2): where each sighting should be, in the frame of its place."""
        position_m = poses[self.place, :2]
        offset_m = landmarks_m[self.landmark] - position_m

        turn = rotation_matrices(poses[self.place, 2])
        expected_m: Floats = np.einsum("mba,mb->ma", turn, offset_m)
        return expected_m

    def landmarks_m(self, poses: Floats) -> Floats:
        """(k, 2): where the landmarks are most likely, the path being at (n, 3) `poses`."""
        turn = rotation_matrices(poses[self.place, 2])
        offset_m = matvec(turn, self.where_m)
        seen_m = poses[self.place, :2] + offset_m
        information = turn @ self.information @ turn.mT

        landmarks_m = self._medians_m(seen_m)
        for _ in range(ROUNDS):
            weights = self.weights(poses, landmarks_m)
            weighed = information * weights[:, None, None]
            landmarks_m = self._means_m(seen_m, weighed)

        return landmarks_m

    def _medians_m(self, seen_m: Floats) -> Floats:
        """(k, 2): the median of where each landmark was seen, (m, 2)."""
        medians = []
        for number in range(len(self.labels)):
            is_seen = self.landmark == number
            median = np.median(seen_m[is_seen], axis=0)
            medians.append(median)

        return np.array(medians).reshape(-1, 2)

    def _means_m(self, seen_m: Floats, information: Floats) -> Floats:
        """(k, 2): the mean of where each landmark was seen, (m, 2), by (m, 2, 2) information."""
        weighed_m = matvec(information, seen_m)
        total = self._sums(information)
        pull = self._sums(weighed_m)

        means_m = np.linalg.solve(total, pull[..., None])
        return np.asarray(means_m[..., 0], np.float64)

    def _sums(self, values: Floats) -> Floats:
        """(k, ...): the sum of the (m, ...) values of each landmark's sightings."""
        _, *shape = values.shape
        sums = np.zeros((len(self.labels), *shape))
        np.add.at(sums, self.landmark, values)
        return sums

    def constraints(self, first_landmark: int, weights: Floats) -> Constraints:
        """Between places of the path and landmarks, the latter as poses from number
        `first_landmark` on.
        """
        count = len(self.place)
        headings_rad = np.zeros(count)
        measured = np.column_stack([self.where_m, headings_rad])

        weighed = self.information * weights[:, None, None]
        information = np.zeros((count, 3, 3))
        information[:, :2, :2] = weighed
        information[:, 2, 2] = NO_HEADING

        return Constraints(
            i=self.place,
            j=first_landmark + self.landmark,
            measurement=measured,
            information=information,
        )


def _numbers(records: list[Observations], labels: tuple[str, ...]) -> Indices:
    """The number in `labels` of the landmark of each of `records`."""
    number_of = {label: number for number, label in enumerate(labels)}
    numbers = [number_of[record.landmark] for record in records]
    return np.array(numbers, np.int64)


def _places_at(stamps_s: Floats, path_s: Floats) -> tuple[Indices, Booleans]:
    """(m,) each: the place of the path at each stamp, and whether it is of that very time."""
    following = np.searchsorted(path_s, stamps_s)
    if not len(path_s):
        return following, np.zeros(len(stamps_s), bool)

    last = len(path_s) - 1
    place = following.clip(0, last)
    away_s = np.abs(path_s[place] - stamps_s)
    return place, away_s < SAME_PLACE_S


def _information(rows: Floats) -> Floats:
    """(m, 2, 2): the information, forwards and left, of (m, COLUMNS) observations."""
    turn = rotation_matrices(rows[:, DIRECTION])
    sd_m = rows[:, None, SPREAD].clip(MIN_SD_M)

    information = turn * sd_m**-2 @ turn.mT
    return np.asarray(information, np.float64)
