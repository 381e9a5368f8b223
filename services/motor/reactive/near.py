"""What the robot passed a moment ago and does not see any longer, in its own frame. Pure.

A camera looks ahead: what stands beside the robot was seen before, and is remembered by the
self-motion since. An arc that leads into it is replaced by one beside it.
"""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.se2 import moved_by, transform_to
from cogmap.robot import NEAREST_SCAN_M
from cogmap.schemas.sensing import RangeScan, SelfMotion

# Hits are kept until they are so far behind the robot, so old, or so far away.
REMEMBERED_M = 6.0
REMEMBERED_S = 20.0
FARTHEST_M = 12.0
# A hit counts where others were within so far of it, in so many scans as these altogether.
SAME_M = 0.5
MIN_SCANS = 3
# While the robot stands it sees the same again: so many scans of a place are enough.
STILL_M = 0.01
STILL_RAD = 0.01
STILL_SCANS = 2 * MIN_SCANS
# What is nearer than the scan has ranges for, and was not seen before, may be at any of these.
TOO_NEAR_M = np.array([1.2, 1.8, 2.4])
# A direction that is so near to that of a hit is not new: almost four rays of the scan.
SAME_RAD = 0.15
# What is seen so much farther away is another surface.
BEHIND_M = 1.0
# Of the arcs that are tried: their length, between their points, and curvatures, up to 1 m radius.
ARC_M = 2.0
STEP_M = 0.25
CURVATURES_PER_M = np.linspace(-1.0, 1.0, 21)


class NearObstacles:
    """Hits of the range scan, moved with the robot until they are far behind.

    Each is forgotten where a later scan sees farther in its direction. The robot is a disc that
    keeps `clearance_m` between its middle and them.
    """

    def __init__(self, clearance_m: float) -> None:
        self._clearance_m = clearance_m
        self._points_m = np.zeros((0, 2))
        self._stamps_ns = np.zeros(0, np.int64)
        self._is_sure = np.zeros(0, np.bool_)
        self._is_still = False
        self._moved_ns = -1
        self._early: RangeScan | None = None

    def on_motion(self, motion: SelfMotion) -> None:
        """Move what is remembered to where it is from the robot now; then comes the scan of the
        same view, also where it arrived earlier.
        """
        self._moved_ns = motion.stamp_ns
        pose = moved_by(np.zeros(3), np.asarray(motion.motions.numpy(), np.float64))
        self._is_still = bool(np.hypot(pose[0], pose[1]) <= STILL_M and abs(pose[2]) <= STILL_RAD)
        if len(self._points_m):
            moved_m = transform_to(pose, self._points_m)
            age_ns = np.abs(motion.stamp_ns - self._stamps_ns)
            is_near = np.hypot(*moved_m.T) <= FARTHEST_M
            is_beside = moved_m[:, 0] >= -REMEMBERED_M
            self._keep(moved_m, is_near & is_beside & (age_ns <= REMEMBERED_S * 1e9))

        early = self._early
        if early is not None and early.stamp_ns <= self._moved_ns:
            self._early = None
            self._add(early)

    def on_scan(self, scan: RangeScan) -> None:
        """Remember what is seen, and forget what is not there."""
        if scan.stamp_ns <= self._moved_ns:
            self._add(scan)
        else:
            self._early = scan

    def _add(self, scan: RangeScan) -> None:
        bearing_rad = np.asarray(scan.bearing_rad.numpy(), np.float64)
        range_m = np.asarray(scan.range_m.numpy(), np.float64)
        self._keep(self._points_m, ~self._is_seen_through(bearing_rad, range_m))

        hits_m = _hits_m(bearing_rad, range_m)
        if self._is_still:
            scans = _scans_near(hits_m, self._points_m, self._stamps_ns)
            hits_m = hits_m[scans < STILL_SCANS]

        sudden_m = self._sudden_m(bearing_rad, range_m)
        self._remember(hits_m, scan.stamp_ns, is_sure=False)
        self._remember(sudden_m, scan.stamp_ns, is_sure=True)

    def _remember(self, points_m: Floats, stamp_ns: int, is_sure: bool) -> None:
        number = len(points_m)
        self._points_m = np.concatenate([self._points_m, points_m])
        self._stamps_ns = np.concatenate([self._stamps_ns, np.full(number, stamp_ns, np.int64)])
        self._is_sure = np.concatenate([self._is_sure, np.full(number, is_sure)])

    def _sudden_m(self, bearing_rad: Floats, range_m: Floats) -> Floats:
        """Find where something may be, (n, 2), that two neighbouring rays hit too near for a range,
        and that was not seen from farther away before.
        """
        order = np.argsort(bearing_rad)
        ascending_rad = bearing_rad[order]
        is_too_near = ((range_m > 0) & (range_m < NEAREST_SCAN_M))[order]
        beside = np.pad(is_too_near, 1)
        sudden_rad = ascending_rad[is_too_near & (beside[:-2] | beside[2:])]

        is_close = np.hypot(*self._points_m.T) <= NEAREST_SCAN_M + SAME_M
        known_rad = np.arctan2(self._points_m[is_close, 1], self._points_m[is_close, 0])
        aside_rad = np.abs(sudden_rad[:, None] - known_rad)
        new_rad = sudden_rad[(aside_rad > SAME_RAD).all(axis=1)]

        each_rad = np.repeat(new_rad, len(TOO_NEAR_M))
        return _points_m(each_rad, np.tile(TOO_NEAR_M, len(new_rad)))

    def clear_curvature(self, wanted_per_m: float) -> float | None:
        """Find the curvature nearest to the one that is wanted whose arc leads past all that is
        near; None if none does.
        """
        # Near enough to matter, and seen in MIN_SCANS scans or suddenly.
        is_near = np.hypot(*self._points_m.T) <= ARC_M + self._clearance_m + SAME_M
        points_m = self._points_m[is_near]
        scans = _scans_near(points_m, points_m, self._stamps_ns[is_near])
        near_m = points_m[(scans >= MIN_SCANS) | self._is_sure[is_near]]
        if not len(near_m):
            return wanted_per_m

        per_m = np.append(CURVATURES_PER_M, wanted_per_m)
        away_m = _least_distances_m(per_m, near_m)
        enough_m = min(self._clearance_m, float(np.hypot(*near_m.T).min()))
        is_clear = away_m >= enough_m - 1e-9
        if is_clear[-1]:
            return wanted_per_m
        if not is_clear.any():
            return None

        change_per_m = np.where(is_clear, np.abs(per_m - wanted_per_m), np.inf)
        return float(per_m[change_per_m.argmin()])

    def _is_seen_through(self, bearing_rad: Floats, range_m: Floats) -> Booleans:
        """Decide which remembered points, (n,), lie before what a scan sees in their direction and
        to both sides of it: the edge of something is a little aside of where it was, by the error
        of odometry and the width of a ray.
        """
        x_m, y_m = self._points_m.T
        if len(bearing_rad) < 2:
            return np.zeros(len(x_m), bool)

        order = np.argsort(bearing_rad)
        ascending_rad = bearing_rad[order]
        half_rad = float(np.diff(ascending_rad).mean()) / 2

        direction_rad = np.arctan2(y_m, x_m)
        borders_rad = ascending_rad[:-1] + half_rad
        place = np.searchsorted(borders_rad, direction_rad)
        sector = order[place]
        is_in_view = np.abs(direction_rad - bearing_rad[sector]) <= half_rad

        ordered_m = range_m[order]
        beside_m = np.pad(np.where(ordered_m > 0, ordered_m, np.inf), 1, constant_values=np.inf)
        nearest_beside_m = np.minimum(beside_m[:-2], beside_m[2:])
        distance_m = np.hypot(x_m, y_m)
        seen_m = np.minimum(range_m[sector], nearest_beside_m[place])
        sees_farther = seen_m > distance_m + BEHIND_M
        is_through = is_in_view & sees_farther & (distance_m >= NEAREST_SCAN_M)
        return np.asarray(is_through, np.bool_)

    def _keep(self, points_m: Floats, is_kept: Booleans) -> None:
        self._points_m = points_m[is_kept]
        self._stamps_ns = self._stamps_ns[is_kept]
        self._is_sure = self._is_sure[is_kept]


def _scans_near(points_m: Floats, hits_m: Floats, stamps_ns: Indices) -> Indices:
    """Count the scans, (n,), that have one of (k, 2) hits, by their (k,) stamps, within SAME_M of
    each of (n, 2) points.
    """
    away_m = np.hypot(*(points_m[:, None] - hits_m).transpose(2, 0, 1))
    is_same = away_m <= SAME_M
    scans = np.zeros(len(points_m), np.int64)
    for stamp_ns in np.unique(stamps_ns).tolist():
        scans += is_same[:, stamps_ns == stamp_ns].any(axis=1)

    return scans


def _hits_m(bearing_rad: Floats, range_m: Floats) -> Floats:
    """Find what a scan hits, and the farthest ends of the surfaces that it hits, (n, 2)."""
    order = np.argsort(bearing_rad)
    ascending_rad = bearing_rad[order]
    seen_m = range_m[order]
    seen_m = np.where(seen_m >= NEAREST_SCAN_M, seen_m, np.inf)

    is_hit = seen_m <= FARTHEST_M
    hits_m = _points_m(ascending_rad[is_hit], seen_m[is_hit])
    if len(bearing_rad) < 2:
        return hits_m

    left_m = _ends_m(ascending_rad, seen_m)
    right_m = _ends_m(-ascending_rad[::-1], seen_m[::-1]) * (1, -1)
    return np.concatenate([hits_m, left_m, right_m])


def _ends_m(bearing_rad: Floats, range_m: Floats) -> Floats:
    """Find where a surface meets the first ray that passes it on the left, at most SAME_M from its
    last hit, (n, 2).

    Rays of (k,) ascending bearings sample a surface: it ends somewhere between two of them, which
    is far along it at a small angle of incidence. What leaves the view continues as well.
    """
    step_rad = float(np.diff(bearing_rad).mean())
    after_m = np.append(range_m[1:], np.inf)
    is_end = (range_m <= FARTHEST_M) & (after_m > range_m + BEHIND_M)

    last_rad = bearing_rad[is_end]
    last_m = range_m[is_end]
    before_m = np.append(np.inf, range_m[:-1])[is_end]
    is_surface = np.abs(before_m - last_m) <= BEHIND_M
    before_m = np.where(is_surface, before_m, last_m)

    # Along a straight line the inverse range is a sinusoid of the bearing.
    inverse_per_m = 2 * math.cos(step_rad) / last_m - 1 / before_m
    next_m = 1 / np.maximum(inverse_per_m, 1 / FARTHEST_M)

    hits_m = _points_m(last_rad, last_m)
    along_m = _points_m(last_rad + step_rad, next_m) - hits_m
    share = np.minimum(1.0, SAME_M / np.hypot(*along_m.T))
    ends_m: Floats = hits_m + share[:, None] * along_m
    return ends_m


def _points_m(bearing_rad: Floats, range_m: Floats) -> Floats:
    return np.column_stack([range_m * np.cos(bearing_rad), range_m * np.sin(bearing_rad)])


def _least_distances_m(per_m: Floats, points_m: Floats) -> Floats:
    """Compute how near arcs of (k,) curvatures lead past (n, 2) points, (k,)."""
    along_m = np.arange(STEP_M, ARC_M + STEP_M / 2, STEP_M)
    turned_rad = per_m[:, None] * along_m
    is_straight = np.abs(per_m) < 1e-6
    safe_per_m = np.where(is_straight, 1e-6, per_m)[:, None]

    x_m = np.sin(turned_rad) / safe_per_m
    y_m = (1 - np.cos(turned_rad)) / safe_per_m
    x_m = np.where(is_straight[:, None], along_m, x_m)
    away_m = np.hypot(x_m[..., None] - points_m[:, 0], y_m[..., None] - points_m[:, 1])
    least_m: Floats = away_m.min(axis=(1, 2))
    return least_m
