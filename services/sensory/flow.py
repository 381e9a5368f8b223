"""Self-motion seen: how far the robot moved and turned between two views, from what moved in them.

Corners of one view are tracked into the next, with their depth they are points in space, and the planar motion
that carries them to where they were tracked is solved for, wheel odometry as its prior (robust Gauss-Newton).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from schemas.sensing import Calibration
from services.sensory.image import Bytes, Floats

Matrix = npt.NDArray[np.float64]

CORNERS = 160
LEAST_TRACKED = 12
NEAREST_M, FARTHEST_M = 2.0, 40.0
TRACK_SD_PX = 1.2
OUTLIER_PX = 3.0
LEAST_AGREEING = 0.5
ITERATIONS = 6
TILT_SD_RAD = 0.01
SIDEWAYS_SD_M = 0.01
SCALE_SD = 0.03
LEAST_WAY_M = 0.05


@dataclass(frozen=True)
class Motion:
    """Way ahead and turn between two views, with their standard deviations."""

    way_m: float
    turn_rad: float
    way_sd_m: float
    turn_sd_rad: float


@dataclass(frozen=True)
class _Past:
    grey: Bytes
    points: Matrix
    corners_px: Floats


class Scale:
    """How long a metre seen is in metres rolled: what is tracked falls short by a constant share, wheels do not.

    The wheels' noise is of mean one (paper §5.4), so their mean ratio to what is seen tells that share better
    with every metre.
    """

    def __init__(self) -> None:
        self._mean, self._information = 1.0, 1 / SCALE_SD**2

    def corrected(self, seen: Motion, wheels: Motion) -> Motion:
        """What was seen, in the wheels' metres; both together improve the scale, standing still does not."""
        if min(abs(seen.way_m), abs(wheels.way_m)) > LEAST_WAY_M and wheels.way_sd_m > 0.0:
            information = (seen.way_m / wheels.way_sd_m) ** 2
            self._information += information
            self._mean += (wheels.way_m / seen.way_m - self._mean) * information / self._information
        way_sd_m = math.hypot(seen.way_sd_m, seen.way_m / math.sqrt(self._information))
        return Motion(seen.way_m * self._mean, seen.turn_rad, way_sd_m, seen.turn_sd_rad)


class VisualMotion:
    """Compares each view with the one before."""

    def __init__(self) -> None:
        self._past: _Past | None = None
        self._scale = Scale()

    def fuse(self, image: Bytes, depth_m: Floats, calibration: Calibration, wheels: Motion) -> Motion:
        """The motion since the last call, of what the wheels and the views say together."""
        grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)
        past, self._past = self._past, self._remember(grey, depth_m, calibration)
        if past is None or past.grey.shape != grey.shape or len(past.points) < LEAST_TRACKED:
            return wheels
        for turn_rad in (wheels.turn_rad, 0.0):
            guess = np.array([wheels.way_m, 0.0, turn_rad, 0.0, 0.0])
            seen = _track(past, grey, guess, wheels, calibration)
            if seen is not None:
                return self._scale.corrected(seen, wheels)
        return wheels

    @staticmethod
    def _remember(grey: Bytes, depth_m: Floats, calibration: Calibration) -> _Past:
        mask = ((depth_m > NEAREST_M) & (depth_m < FARTHEST_M)).astype(np.uint8)
        found = cv2.goodFeaturesToTrack(grey, CORNERS, 0.01, 7, mask=mask)
        corners = np.empty((0, 2), np.float32) if found is None else np.asarray(found, np.float32).reshape(-1, 2)
        column, row = np.rint(corners).astype(int).T.reshape(2, -1)
        depth = depth_m[row, column].astype(np.float64)
        left = -(corners[:, 0] - calibration.cx_px) / calibration.fx_px * depth
        up = -(corners[:, 1] - calibration.cy_px) / calibration.fy_px * depth
        return _Past(grey, np.column_stack([depth + calibration.mount_forward_m, left, up]), corners)


def _track(past: _Past, grey: Bytes, guess: Matrix, wheels: Motion, calibration: Calibration) -> Motion | None:
    """What is seen where corners are looked for as `guess` would have moved them; None if too few agree on it."""
    start_px = _project(past.points, guess, calibration).astype(np.float32)
    tracked_px, found, _ = cv2.calcOpticalFlowPyrLK(
        past.grey, grey, past.corners_px, start_px.copy(), winSize=(15, 15), maxLevel=3,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )  # fmt: skip
    inside = found[:, 0].astype(bool) & (np.abs(tracked_px - start_px).max(axis=1) < grey.shape[1] / 4)
    if inside.sum() < LEAST_TRACKED:
        return None
    return _solve(past.points[inside], tracked_px[inside].astype(np.float64), guess, wheels, calibration)


def _project(points: Matrix, motion: Matrix, calibration: Calibration) -> Matrix:
    """Pixels (n, 2) of (n, 3) points (ahead, left, above the camera) after way, sideways, turn, pitch, roll.

    The way is an arc: it leads in the direction half-way through the turn.
    """
    way, sideways, turn, pitch, roll = motion
    cos, sin = np.cos(turn / 2), np.sin(turn / 2)
    ahead, left = points[:, 0] - (cos * way - sin * sideways), points[:, 1] - (sin * way + cos * sideways)
    cos, sin = np.cos(turn), np.sin(turn)
    ahead, left = cos * ahead + sin * left - calibration.mount_forward_m, -sin * ahead + cos * left
    ahead = np.maximum(ahead, 0.3)
    x, y = -left / ahead, -points[:, 2] / ahead
    tilted = np.column_stack([x - roll * y, y + roll * x + pitch])
    return tilted * (calibration.fx_px, calibration.fy_px) + (calibration.cx_px, calibration.cy_px)


def _solve(points: Matrix, seen_px: Matrix, guess: Matrix, wheels: Motion, calibration: Calibration) -> Motion | None:
    """The motion that best explains where the points were tracked, sought from `guess`, the wheels its prior."""
    prior_sd = np.array([wheels.way_sd_m, SIDEWAYS_SD_M, wheels.turn_sd_rad, TILT_SD_RAD, TILT_SD_RAD])
    prior = np.diag(1 / np.maximum(prior_sd, 1e-6) ** 2)
    expected = np.array([wheels.way_m, 0.0, wheels.turn_rad, 0.0, 0.0])
    motion, steps = guess.copy(), np.diag(np.full(5, 1e-5))
    information = prior
    for _ in range(ITERATIONS):
        predicted = _project(points, motion, calibration)
        off = seen_px - predicted
        jacobian = np.stack([(_project(points, motion + h, calibration) - predicted) / 1e-5 for h in steps], axis=2)
        weight = 1 / (1 + (np.hypot(off[:, 0], off[:, 1]) / OUTLIER_PX) ** 2) ** 2 / TRACK_SD_PX**2
        information = prior + np.einsum("nik,n,nil->kl", jacobian, weight, jacobian)
        gradient = np.einsum("nik,n,ni->k", jacobian, weight, off) - prior @ (motion - expected)
        step = np.linalg.solve(information, gradient)
        motion = motion + step
        if np.abs(step).max() < 1e-6:
            break
    off = np.hypot(*(seen_px - _project(points, motion, calibration)).T)
    if (off < OUTLIER_PX).mean() < LEAST_AGREEING:
        return None
    surprise = max(1.0, float(np.median(off)) / TRACK_SD_PX)
    sd = surprise * np.sqrt(np.diag(np.linalg.inv(information)))
    return Motion(float(motion[0]), float(motion[2]), float(sd[0]), float(sd[2]))
