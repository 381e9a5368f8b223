"""Self-motion seen: how far the robot moved and turned between two views, from what moved in them.

The view before is drawn anew as it should look now, by the depth of the new view and the motion
that the wheels tell. Corners are tracked between the two, which look alike, so that no patch is
stretched by coming nearer; the planar motion that explains where they were before is solved for,
the wheels its prior (robust Gauss-Newton).
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
NEAREST_M = 2.0
FARTHEST_M = 40.0
HORIZON_M = 1000.0
TRACK_SD_PX = 1.2
OUTLIER_PX = 3.0
LEAST_AGREEING = 0.5
ITERATIONS = 6
TILT_SD_RAD = 0.01
SIDEWAYS_SD_M = 0.01
SCALE_SD = 0.005
LEAST_WAY_M = 0.05


@dataclass(frozen=True)
class Motion:
    """Way ahead and turn between two views, with their standard deviations."""

    way_m: float
    turn_rad: float
    way_sd_m: float
    turn_sd_rad: float


class Scale:
    """How long a metre seen is in metres rolled.

    The wheels' noise is of mean one (paper §5.4), so their mean ratio to what is seen tells it
    better with every metre, whatever the views get wrong by a constant share.
    """

    def __init__(self) -> None:
        self._mean = 1.0
        self._information = 1 / SCALE_SD**2

    def corrected(self, seen: Motion, wheels: Motion) -> Motion:
        """What was seen, in the wheels' metres; both together improve the scale, standing still
        does not.
        """
        if min(abs(seen.way_m), abs(wheels.way_m)) > LEAST_WAY_M and wheels.way_sd_m > 0.0:
            information = (seen.way_m / wheels.way_sd_m) ** 2
            self._information += information
            self._mean += (wheels.way_m / seen.way_m - self._mean) * information / self._information
        way_sd_m = math.hypot(seen.way_sd_m, seen.way_m / math.sqrt(self._information))
        return Motion(seen.way_m * self._mean, seen.turn_rad, way_sd_m, seen.turn_sd_rad)


class VisualMotion:
    """Compares each view with the one before."""

    def __init__(self) -> None:
        self._past: Bytes | None = None
        self._scale = Scale()

    def fuse(
        self, image: Bytes, depth_m: Floats, calibration: Calibration, wheels: Motion
    ) -> Motion:
        """The motion since the last call, of what the wheels and the views say together."""
        grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)
        past = self._past
        self._past = grey
        corners_px = _corners(grey, depth_m)
        if past is None or past.shape != grey.shape or len(corners_px) < LEAST_TRACKED:
            return wheels
        for turn_rad in (wheels.turn_rad, 0.0):
            guess = np.array([wheels.way_m, 0.0, turn_rad, 0.0, 0.0])
            before_px, found = _tracked_back(
                grey, *_redraw(past, depth_m, guess, calibration), corners_px
            )
            if found.sum() < LEAST_TRACKED:
                continue
            points = _points(corners_px[found], depth_m, calibration)
            seen = _solve(points, before_px[found], guess, wheels, calibration)
            if seen is not None:
                return self._scale.corrected(seen, wheels)
        return wheels


def _corners(grey: Bytes, depth_m: Floats) -> Floats:
    """Pixels (n, 2) that can be tracked and whose depth is known well."""
    mask = ((depth_m > NEAREST_M) & (depth_m < FARTHEST_M)).astype(np.uint8)
    found = cv2.goodFeaturesToTrack(grey, CORNERS, 0.01, 7, mask=mask)
    return (
        np.empty((0, 2), np.float32)
        if found is None
        else np.asarray(found, np.float32).reshape(-1, 2)
    )


def _points(pixels: Floats, depth_m: Floats, calibration: Calibration) -> Matrix:
    """(n, 3) points ahead, left and above the camera, from the robot's origin, at (n, 2) pixels."""
    column, row = np.rint(pixels).astype(int).T
    depth = depth_m[row, column].astype(np.float64)
    left = -(pixels[:, 0] - calibration.cx_px) / calibration.fx_px * depth
    up = -(pixels[:, 1] - calibration.cy_px) / calibration.fy_px * depth
    return np.column_stack([depth + calibration.mount_forward_m, left, up])


def _redraw(
    past: Bytes, depth_m: Floats, guess: Matrix, calibration: Calibration
) -> tuple[Bytes, Floats]:
    """The view before as `guess` would have it look now, and where each of its pixels was, (h, w,
    2).
    """
    row, column = np.indices(past.shape, np.float32)
    known = np.where(depth_m > 0, depth_m, HORIZON_M).astype(np.float32)
    points = _points(np.column_stack([column.ravel(), row.ravel()]), known, calibration)
    before = _project(points, guess, calibration).astype(np.float32).reshape(*past.shape, 2)
    redrawn = cv2.remap(
        past, before[..., 0], before[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(redrawn, np.uint8), before


def _tracked_back(
    grey: Bytes, redrawn: Bytes, before: Floats, corners_px: Floats
) -> tuple[Matrix, npt.NDArray[np.bool_]]:
    """Where the corners were in the view before, (n, 2), and which were found."""
    anywhere = np.zeros_like(corners_px)
    tracked, found, _ = cv2.calcOpticalFlowPyrLK(
        grey, redrawn, corners_px, anywhere, winSize=(11, 11), maxLevel=3
    )
    at = tracked.reshape(1, -1, 2)
    before_px = cv2.remap(
        before, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )[0]
    inside = np.all(
        (before_px >= 0) & (before_px <= (grey.shape[1] - 1, grey.shape[0] - 1)), axis=1
    )
    return np.asarray(before_px, np.float64), np.asarray(found[:, 0], bool) & inside


def _project(points: Matrix, motion: Matrix, calibration: Calibration) -> Matrix:
    """Pixels (n, 2) of (n, 3) points as they were before the motion: way, sideways, turn, pitch,
    roll.

    The way is an arc: it leads in the direction half-way through the turn.
    """
    way, sideways, turn, pitch, roll = motion
    cos = np.cos(turn)
    sin = np.sin(turn)
    ahead = cos * points[:, 0] - sin * points[:, 1]
    left = sin * points[:, 0] + cos * points[:, 1]
    cos = np.cos(turn / 2)
    sin = np.sin(turn / 2)
    ahead = ahead + cos * way - sin * sideways
    left = left + sin * way + cos * sideways
    ahead = np.maximum(ahead - calibration.mount_forward_m, 0.3)
    x = -left / ahead
    y = -points[:, 2] / ahead
    tilted = np.column_stack([x - roll * y, y + roll * x + pitch])
    return tilted * (calibration.fx_px, calibration.fy_px) + (calibration.cx_px, calibration.cy_px)


def _solve(
    points: Matrix, seen_px: Matrix, guess: Matrix, wheels: Motion, calibration: Calibration
) -> Motion | None:
    """The motion that best explains where the points were, sought from `guess`; None if too few
    agree on it.
    """
    prior_sd = np.array(
        [wheels.way_sd_m, SIDEWAYS_SD_M, wheels.turn_sd_rad, TILT_SD_RAD, TILT_SD_RAD]
    )
    prior = np.diag(1 / np.maximum(prior_sd, 1e-6) ** 2)
    expected = np.array([wheels.way_m, 0.0, wheels.turn_rad, 0.0, 0.0])
    motion = guess.copy()
    steps = np.diag(np.full(5, 1e-5))
    information = prior
    for _ in range(ITERATIONS):
        predicted = _project(points, motion, calibration)
        off = seen_px - predicted
        jacobian = np.stack(
            [(_project(points, motion + h, calibration) - predicted) / 1e-5 for h in steps], axis=2
        )
        weight = 1 / (1 + (np.hypot(off[:, 0], off[:, 1]) / OUTLIER_PX) ** 2) ** 2 / TRACK_SD_PX**2
        information = prior + np.einsum("nik,n,nil->kl", jacobian, weight, jacobian)
        gradient = np.einsum("nik,n,ni->k", jacobian, weight, off) - prior @ (motion - expected)
        step = np.linalg.solve(information, gradient)
        motion = motion + step
        if np.abs(step).max() < 1e-6:
            break
    off_px = np.hypot(*(seen_px - _project(points, motion, calibration)).T)
    if (off_px < OUTLIER_PX).mean() < LEAST_AGREEING:
        return None
    surprise = max(1.0, float(np.median(off_px)) / TRACK_SD_PX)
    sd = surprise * np.sqrt(np.diag(np.linalg.inv(information)))
    return Motion(float(motion[0]), float(motion[2]), float(sd[0]), float(sd[2]))
