"""Visual odometry: the robot's distance and turn between two views.

The last view is redrawn as it should look now, by the depth of the new view and the wheels' motion.
Corners are tracked between the two, which look alike, so that no patch is stretched by coming
nearer. The planar motion that explains the corners' positions in the last view is then solved for,
with the wheels' as its prior (robust Gauss-Newton).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from cogmap.geometry.arrays import Booleans, Bytes, Floats, Singles
from cogmap.schemas.sensing import Calibration
from cogmap.services.sensory.reprojection import Points, points_at, project_back, surface

# Corners that are looked for; with fewer that are found the wheels alone measure the motion.
CORNERS = 160
MIN_TRACKED = 12
# Corners have a depth between these. Pixels of unknown depth are redrawn as if on the horizon.
MIN_DEPTH_M = 2.0
MAX_DEPTH_M = 40.0
HORIZON_M = 1000.0
# Of a tracked corner; one that misfits by OUTLIER_PX has a quarter of its weight, and where more
# than half misfit by that much the motion is not believed.
TRACK_SD_PX = 1.2
OUTLIER_PX = 3.0
MIN_INLIER_SHARE = 0.5
# A bound on the steps; smaller ones than CONVERGED, in m and rad, end them; and the differences by
# which derivatives are computed.
ITERATIONS = 6
CONVERGED = 1e-6
DIFFERENCE = 1e-5
# Between two views the robot hardly tilts or moves sideways.
TILT_SD_RAD = 0.01
SIDEWAYS_SD_M = 0.01
# How far distances seen may all be wrong, as a share; in the town it was 0.001. Shorter ones than
# MIN_SCALED_M do not correct it.
SCALE_SD = 0.005
MIN_SCALED_M = 0.05


@dataclass(frozen=True)
class Motion:
    """Distance ahead and turn between two views, with their standard deviations."""

    distance_m: float
    turn_rad: float
    distance_sd_m: float
    turn_sd_rad: float


class Scale:
    """The ratio of distances by the wheels to distances seen.

    The wheels' noise is of mean one (paper §5.4), so their mean ratio estimates it better with
    every metre, whatever constant share the views get wrong.
    """

    def __init__(self) -> None:
        self._mean = 1.0
        self._information = 1 / SCALE_SD**2

    def correct(self, seen: Motion, wheels: Motion) -> Motion:
        """Return what was seen, in the wheels' metres; while moving, both improve the scale."""
        shortest_m = min(abs(seen.distance_m), abs(wheels.distance_m))
        if shortest_m > MIN_SCALED_M and wheels.distance_sd_m > 0.0:
            information = (seen.distance_m / wheels.distance_sd_m) ** 2
            self._information += information
            innovation = wheels.distance_m / seen.distance_m - self._mean
            self._mean += innovation * information / self._information

        scale_sd_m = seen.distance_m / math.sqrt(self._information)

        return Motion(
            distance_m=seen.distance_m * self._mean,
            turn_rad=seen.turn_rad,
            distance_sd_m=math.hypot(seen.distance_sd_m, scale_sd_m),
            turn_sd_rad=seen.turn_sd_rad,
        )


class VisualOdometry:
    """Compares each view with the last one."""

    def __init__(self) -> None:
        self._last: Bytes | None = None
        self._scale = Scale()

    def update(
        self, image: Bytes, depth_m: Singles, calibration: Calibration, wheels: Motion
    ) -> Motion:
        """Return the motion since the last view, by the wheels and the views; by the wheels alone
        if the views do not suffice.

        `image` is RGB (h, w, 3); `depth_m` (h, w) is its depth along the optical axis, 0 if it
        is unknown.
        """
        grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)
        last = self._last
        self._last = grey
        if last is None or last.shape != grey.shape:
            return wheels

        # Corners with a depth that is known well.
        mask = ((depth_m > MIN_DEPTH_M) & (depth_m < MAX_DEPTH_M)).astype(np.uint8)
        found = cv2.goodFeaturesToTrack(grey, CORNERS, 0.01, 7, mask=mask)
        if found is None or len(found) < MIN_TRACKED:
            return wheels

        corners_px = np.asarray(found, np.float32).reshape(-1, 2)
        pair = _Pair(last, grey, depth_m, calibration)
        for turn_rad in (wheels.turn_rad, 0.0):
            guess = np.array([wheels.distance_m, 0.0, turn_rad, 0.0, 0.0])
            before_px, is_found = _track_back(pair, corners_px, guess)
            if is_found.sum() < MIN_TRACKED:
                continue

            points = points_at(corners_px[is_found], depth_m, calibration)
            seen = _solve(points, before_px[is_found], guess, wheels, calibration)
            if seen is not None:
                return self._scale.correct(seen, wheels)

        return wheels


class _Pair(NamedTuple):
    """Two grey views (h, w), the depth of the new one, and their calibration."""

    last: Bytes
    new: Bytes
    depth_m: Singles
    calibration: Calibration


def _track_back(pair: _Pair, corners_px: Singles, guess: Floats) -> tuple[Floats, Booleans]:
    """Find where the new view's corners were in the last one, (n, 2), and which were found (n,)."""
    # The last view as it would look after the motion `guess`, and where each of its pixels was.
    depth_m = np.where(pair.depth_m > 0, pair.depth_m, HORIZON_M).astype(np.float32)
    points = surface(depth_m, pair.calibration)
    before = np.dstack(project_back(points, guess, pair.calibration)).astype(np.float32)
    redrawn = cv2.remap(
        pair.last,
        before[..., 0],
        before[..., 1],
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )

    anywhere = np.zeros_like(corners_px)
    tracked_px, is_tracked, _ = cv2.calcOpticalFlowPyrLK(
        pair.new,
        redrawn,
        corners_px,
        anywhere,
        winSize=(11, 11),
        maxLevel=3,
    )

    at = tracked_px.reshape(1, -1, 2)
    before_px = cv2.remap(
        before,
        at[..., 0],
        at[..., 1],
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )[0]

    height_px, width_px = pair.new.shape
    last_px = (width_px - 1, height_px - 1)
    is_inside = ((before_px >= 0) & (before_px <= last_px)).all(axis=1)
    is_found = np.asarray(is_tracked[:, 0], bool) & is_inside
    return np.asarray(before_px, np.float64), is_found


def _solve(
    points: Points,
    before_px: Floats,
    guess: Floats,
    wheels: Motion,
    calibration: Calibration,
) -> Motion | None:
    """Find the motion that best explains the points' earlier positions, by Gauss-Newton from
    `guess`; None if too few agree on it.
    """
    # The wheels' motion is the prior, and that the robot hardly moves sideways or tilts.
    expected = np.array([wheels.distance_m, 0.0, wheels.turn_rad, 0.0, 0.0])
    sds = [wheels.distance_sd_m, SIDEWAYS_SD_M, wheels.turn_sd_rad, TILT_SD_RAD, TILT_SD_RAD]
    prior = np.diag(1 / np.maximum(sds, 1e-6) ** 2)

    motion = guess.copy()
    information = prior
    for _ in range(ITERATIONS):
        # Residuals (n, 2) and their Jacobian (n, 2, 5), by differences.
        differences = np.vstack([np.zeros(5), np.diag(np.full(5, DIFFERENCE))])
        column_px, row_px = project_back(points, (motion + differences).T[..., None], calibration)
        predicted_px, *shifted_px = np.stack([column_px, row_px], axis=2)
        changes = (np.stack(shifted_px) - predicted_px) / DIFFERENCE
        residual_px = before_px - predicted_px
        jacobian = np.ascontiguousarray(np.moveaxis(changes, 0, 2))

        # Geman-McClure's weights, over the variance of a track.
        squared = (np.hypot(residual_px[:, 0], residual_px[:, 1]) / OUTLIER_PX) ** 2
        weight: Floats = 1 / (1 + squared) ** 2 / TRACK_SD_PX**2

        information = prior + np.einsum("nik,n,nil->kl", jacobian, weight, jacobian)
        pull = np.einsum("nik,n,ni->k", jacobian, weight, residual_px)
        step = np.linalg.solve(information, pull - prior @ (motion - expected))
        motion = motion + step
        if np.abs(step).max() < CONVERGED:
            break

    residual_px = before_px - np.column_stack(project_back(points, motion, calibration))
    distance_px = np.hypot(*residual_px.T)
    if (distance_px < OUTLIER_PX).mean() < MIN_INLIER_SHARE:
        return None

    inflation = max(1.0, float(np.median(distance_px)) / TRACK_SD_PX)
    deviation = inflation * np.sqrt(np.diag(np.linalg.inv(information)))
    return Motion(
        distance_m=float(motion[0]),
        turn_rad=float(motion[2]),
        distance_sd_m=float(deviation[0]),
        turn_sd_rad=float(deviation[2]),
    )
