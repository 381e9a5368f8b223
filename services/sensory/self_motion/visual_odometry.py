"""Visual odometry: the robot's motion between two views, and the error of the camera's disparities.

Corners of the new view, with their depth, are tracked to where the last view showed them. The rigid
motion that explains that is solved for.

A right camera that looks beside where its calibration says shifts all disparities alike: as the
robot moves, near and far things then contradict each other. That offset is estimated besides.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Bytes, Floats, Singles
from cogmap.schemas.sensing import Calibration
from cogmap.services.sensory.self_motion.motion import Motion
from cogmap.services.sensory.self_motion.motion_solver import (
    DOWN,
    FORWARD,
    OFFSET,
    PITCH,
    RIGHT,
    ROLL,
    YAW,
    Prior,
    Projection,
    Solution,
    homography,
    solve,
)
from cogmap.services.sensory.self_motion.tracks import (
    at_pixels,
    evened,
    is_exposed_alike,
    redrawn,
    seen_turn_rad,
    track_redrawn,
)

# With fewer tracks, or a smaller share of them that agrees, views measure no motion. Of several
# guesses the first that as many agree on as SURE_SHARE is taken.
MIN_TRACKED = 12
MIN_INLIER_SHARE = 0.4
SURE_SHARE = 0.7
# The motion is solved for so often, while corners move by FAR_PX against the guess.
ROUNDS = 3
FAR_PX = 2.0
# Smaller disparities are no better than none: they may be wrong by as much as they are.
MIN_DISPARITY_PX = 1.5
# How far a robot moves sideways and up: 1 cm on bumps, and up a slope, or as its camera is mounted,
# by that share of its way. Wheels do not lead it sideways. It tilts, as a random walk, by 1 degree
# in 0.1 s.
BUMPS_SD_M = 0.01
ASIDE_SHARE = 0.05
TILT_WALK_RAD = 0.06
# Tracks share errors, of matching, calibration and what moves by itself. By how much that raises
# the variance of a motion (squared errors over it are then about 1, on KITTI's drive and in the
# town), and that of the offset, which sees the same errors in every view.
SHARED_ERRORS = 2.0
LASTING_ERRORS = 10.0
# How far all distances seen may be wrong, as a share: the camera's baseline and focal length.
SCALE_SD = 0.005
# The offset of all disparities: its standard deviation before anything is known and at best, and by
# how much it may vary where the calibration is believed. On KITTI's pairs it is 0.1 px, in the town
# 0.01. One beyond MAX_OFFSET_PX is no error of the estimate: then the calibration is wrong.
OFFSET_SD_PX = 0.3
BEST_OFFSET_SD_PX = 0.03
BELIEVED_SD_PX = 0.02
MAX_OFFSET_PX = 0.5
# Of the camera's tilt against the ground: as it may be mounted (2 degrees), and at best, as a tilt
# of a body changes with its load. How far a bump moves the camera up or down between two views.
MOUNT_SLOPE_SD = 0.035
BEST_SLOPE_SD = 0.002
BUMP_SD_M = 0.02
# A drift is measured from this distance on.
MIN_DRIFT_M = 0.05
MAX_DRIFT_RAD = 0.5


@dataclass(frozen=True)
class Offset:
    """The error of all disparities in pixels, and the standard deviation of this estimate."""

    mean_px: float = 0.0
    sd_px: float = OFFSET_SD_PX

    @property
    def correction_px(self) -> float:
        """Return what must be added to disparities: 0 while the calibration may be right."""
        is_sure = abs(self.mean_px) > MAX_OFFSET_PX and self.sd_px < MAX_OFFSET_PX / 2
        return self.mean_px if is_sure else 0.0

    def updated(self, solution: Solution) -> Offset:
        """Return the offset with what a solution, of disparities that have been corrected by it,
        says of it.
        """
        seen_px = solution.offset_px + self.correction_px
        before = 1 / self.sd_px**2
        worth = 1 / (LASTING_ERRORS * solution.offset_sd_px**2)
        mean_px = (self.mean_px * before + seen_px * worth) / (before + worth)
        return Offset(mean_px, max(BEST_OFFSET_SD_PX, 1 / math.sqrt(before + worth)))


@dataclass(frozen=True)
class Slope:
    """By how much the camera sees its way lead down, as a share of the way, and how precisely: the
    robot drives along the ground, so that is how the camera is tilted against it.
    """

    mean: float = 0.0
    precision: float = 1 / MOUNT_SLOPE_SD**2

    def updated(self, solution: Solution) -> Slope:
        """Return the slope with one motion more."""
        forward_m = float(solution.motion[FORWARD])
        down_m = float(solution.motion[DOWN])
        precision = self.precision + (forward_m / BUMP_SD_M) ** 2
        mean = (self.mean * self.precision + down_m * forward_m / BUMP_SD_M**2) / precision
        return Slope(mean, min(precision, 1 / BEST_SLOPE_SD**2))


class TrackedView(NamedTuple):
    """A grey view (h, w), its disparities (h, w), 0 if they are unknown, and its corners (n, 2)."""

    grey: Bytes
    disparity_px: Singles
    corners_px: Singles
    calibration: Calibration


class VisualOdometry:
    """Compares each view with the last one, of a robot on wheels or of whatever moves a camera."""

    def __init__(self, has_wheels: bool) -> None:
        self._has_wheels = has_wheels
        self._last: TrackedView | None = None
        self.offset = Offset()
        self.slope = Slope()

    def update(
        self,
        view: TrackedView | None,
        expected: Motion,
        dt_s: float,
        guesses: Sequence[Motion],
    ) -> Motion | None:
        """Return the motion in the `dt_s` since the last view, or None if the views do not suffice.

        `expected` is the prior; tracking begins from one of `guesses`, or from a turn on the spot
        by which the views are most alike, whichever more tracks agree on.
        """
        last = self._last
        self._last = view
        if last is None or view is None:
            return None
        if last.calibration != view.calibration:
            self.offset = Offset()
            self.slope = Slope()
            return None

        at_corners_px = at_pixels(view.disparity_px, view.corners_px)
        is_usable = at_corners_px > MIN_DISPARITY_PX
        if is_usable.sum() < MIN_TRACKED:
            return None
        usable_px = at_corners_px[is_usable].astype(np.float64)
        if not is_exposed_alike(last.grey, view.grey):
            last = last._replace(grey=evened(last.grey))
            view = view._replace(grey=evened(view.grey))
        pair = _Pair(last.grey, view, view.corners_px[is_usable], usable_px)
        prior = self._prior(expected, dt_s)
        best: Solution | None = None
        for guess in _starts(guesses, last, view):
            solution = _solution(pair, prior, guess)
            if solution is None:
                continue
            if best is None or solution.inlier_share > best.inlier_share:
                best = solution
            if best.inlier_share > SURE_SHARE:
                break

        if best is None or best.inlier_share < MIN_INLIER_SHARE:
            return None
        self.offset = self.offset.updated(best)
        self.slope = self.slope.updated(best)
        return _motion(best)

    def _prior(self, expected: Motion, dt_s: float) -> Prior:
        mean = np.zeros(7)
        mean[FORWARD] = expected.distance_m
        mean[YAW] = -expected.turn_rad

        aside_m = ASIDE_SHARE * math.hypot(expected.distance_m, expected.distance_sd_m)
        aside_sd_m = math.hypot(BUMPS_SD_M, aside_m)
        tilt_sd_rad = TILT_WALK_RAD * math.sqrt(dt_s)
        sds = np.full(7, np.inf)
        sds[DOWN] = aside_sd_m
        sds[FORWARD] = max(expected.distance_sd_m, 1e-4)
        sds[YAW] = max(expected.turn_sd_rad, 1e-4)
        sds[[PITCH, ROLL]] = tilt_sd_rad
        sds[OFFSET] = BELIEVED_SD_PX
        sideways_sd_m = BUMPS_SD_M if self._has_wheels else aside_sd_m
        return Prior(mean, np.diag(1 / sds**2), sideways_sd_m)


def _starts(guesses: Sequence[Motion], last: TrackedView, new: TrackedView) -> Iterator[Motion]:
    """Yield the guesses, and then a turn on the spot."""
    yield from guesses
    turn_rad = seen_turn_rad(last.grey, new.grey, new.calibration.fx_px)
    yield Motion(0.0, turn_rad, 0.0, 0.0)


class _Pair(NamedTuple):
    """The last grey view (h, w) and the new view, with its usable corners (n, 2) and their
    disparities (n,).
    """

    last: Bytes
    new: TrackedView
    pixels: Singles
    disparity_px: Floats


def _solution(pair: _Pair, prior: Prior, guess: Motion) -> Solution | None:
    """Track from where `guess` puts the corners, and solve; None if too few are found.

    A motion that is far from the guess is a guess for another time.
    """
    motion = prior.mean.copy()
    motion[FORWARD] = guess.distance_m
    motion[YAW] = -guess.turn_rad
    calibration = pair.new.calibration
    pixels = pair.pixels.astype(np.float64)
    projection = Projection(pixels, pair.disparity_px, calibration)
    solution = None
    for _ in range(ROUNDS):
        before = homography(motion, calibration)
        last, at_px = redrawn(pair.last, pair.new.disparity_px, before)
        before_px, is_found = track_redrawn(pair.new.grey, last, at_px, pair.pixels)
        if is_found.sum() < MIN_TRACKED:
            return solution

        found = Projection(pixels[is_found], pair.disparity_px[is_found], calibration)
        solution = solve(found, before_px[is_found].astype(np.float64), motion, prior)
        change_px = projection.before(solution.motion)[0] - projection.before(motion)[0]
        motion = solution.motion
        if np.median(np.hypot(*change_px.T)) < FAR_PX:
            break
    return solution


def _motion(solution: Solution) -> Motion:
    """Return the motion in the plane, with its part of the errors that all tracks share."""
    forward_m = float(solution.motion[FORWARD])
    left_m = -float(solution.motion[RIGHT])
    turn_rad = -float(solution.motion[YAW])
    distance_m = math.copysign(math.hypot(forward_m, left_m), forward_m)

    # Where it hardly moves, noise has a direction, too.
    across_m = left_m - forward_m * turn_rad / 2
    drift_rad = across_m * forward_m / (forward_m**2 + MIN_DRIFT_M**2)
    variances = SHARED_ERRORS * np.diag(solution.covariance)
    return Motion(
        distance_m=distance_m,
        turn_rad=turn_rad,
        distance_sd_m=math.hypot(math.sqrt(variances[FORWARD]), SCALE_SD * distance_m),
        turn_sd_rad=math.sqrt(variances[YAW]),
        drift_rad=float(np.clip(drift_rad, -MAX_DRIFT_RAD, MAX_DRIFT_RAD)),
    )
