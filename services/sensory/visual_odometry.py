"""Visual odometry: how far the robot moved and turned between two views.

The last view is redrawn as it should look now, by the depth of the new view and the wheels' motion.
Corners are tracked between the two, which look alike, so that no patch is stretched by coming
nearer. The planar motion that explains where the corners were before is then solved for, with the
wheels' as its prior (robust Gauss-Newton).
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

CORNERS = 160
MIN_TRACKED = 12
MIN_DEPTH_M = 2.0
MAX_DEPTH_M = 40.0
HORIZON_M = 1000.0
TRACK_SD_PX = 1.2
OUTLIER_PX = 3.0
MIN_INLIER_SHARE = 0.5
ITERATIONS = 6
CONVERGED = 1e-6
DIFFERENCE = 1e-5
TILT_SD_RAD = 0.01
SIDEWAYS_SD_M = 0.01
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
        """What was seen, in the wheels' metres; where the robot moves, both improve the scale."""
        shortest_m = min(abs(seen.distance_m), abs(wheels.distance_m))
        if shortest_m > MIN_SCALED_M and wheels.distance_sd_m > 0.0:
            self._update(seen.distance_m, wheels)

        scale_sd_m = seen.distance_m / math.sqrt(self._information)

        return Motion(
            distance_m=seen.distance_m * self._mean,
            turn_rad=seen.turn_rad,
            distance_sd_m=math.hypot(seen.distance_sd_m, scale_sd_m),
            turn_sd_rad=seen.turn_sd_rad,
        )

    def _update(self, seen_m: float, wheels: Motion) -> None:
        information = (seen_m / wheels.distance_sd_m) ** 2
        self._information += information

        innovation = wheels.distance_m / seen_m - self._mean
        self._mean += innovation * information / self._information


class VisualOdometry:
    """Compares each view with the last one."""

    def __init__(self) -> None:
        self._last: Bytes | None = None
        self._scale = Scale()

    def update(
        self, image: Bytes, depth_m: Singles, calibration: Calibration, wheels: Motion
    ) -> Motion:
        """The motion since the last view, by the wheels and the views; by the wheels alone where
        the views do not suffice.

        `image` is RGB (h, w, 3); `depth_m` (h, w) is its depth along the optical axis, 0 where it
        is unknown.
        """
        grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)
        last = self._last
        self._last = grey
        if last is None or last.shape != grey.shape:
            return wheels

        corners_px = _corners(grey, depth_m)
        if len(corners_px) < MIN_TRACKED:
            return wheels

        pair = _Pair(last, grey, depth_m, calibration)
        for turn_rad in (wheels.turn_rad, 0.0):
            guess = np.array([wheels.distance_m, 0.0, turn_rad, 0.0, 0.0])
            seen = _estimate(pair, corners_px, guess, wheels)
            if seen is not None:
                return self._scale.correct(seen, wheels)

        return wheels


class _Pair(NamedTuple):
    """Two grey views (h, w), the depth of the new one, and their calibration."""

    last: Bytes
    new: Bytes
    depth_m: Singles
    calibration: Calibration


class _Tracks(NamedTuple):
    """Where (n,) corners were in the last view, (n, 2), and which were found."""

    before_px: Floats
    is_found: Booleans


class _Fit(NamedTuple):
    """Residuals (n, 2) in pixels, their Jacobian (n, 2, 5) and their robust weights (n,)."""

    residual_px: Floats
    jacobian: Floats
    weight: Floats


def _estimate(pair: _Pair, corners_px: Singles, guess: Floats, wheels: Motion) -> Motion | None:
    """The motion seen, searched from `guess`; None where too few corners are tracked or agree."""
    tracks = _track_back(pair, corners_px, guess)
    if tracks.is_found.sum() < MIN_TRACKED:
        return None

    found_px = corners_px[tracks.is_found]
    points = points_at(found_px, pair.depth_m, pair.calibration)
    before_px = tracks.before_px[tracks.is_found]

    return _solve(points, before_px, guess, wheels, pair.calibration)


def _corners(grey: Bytes, depth_m: Singles) -> Singles:
    """(n, 2) pixels that can be tracked and whose depth is known well."""
    is_far_enough = depth_m > MIN_DEPTH_M
    is_near_enough = depth_m < MAX_DEPTH_M
    mask = (is_far_enough & is_near_enough).astype(np.uint8)

    found = cv2.goodFeaturesToTrack(grey, CORNERS, 0.01, 7, mask=mask)
    if found is None:
        return np.empty((0, 2), np.float32)

    return np.asarray(found, np.float32).reshape(-1, 2)


def _track_back(pair: _Pair, corners_px: Singles, guess: Floats) -> _Tracks:
    """Where the corners of the new view were in the last one."""
    redrawn, before = _redraw(pair, guess)

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

    is_inside = _is_inside(np.asarray(before_px, np.float32), pair.new.shape)
    is_found = np.asarray(is_tracked[:, 0], bool) & is_inside
    return _Tracks(np.asarray(before_px, np.float64), is_found)


def _is_inside(pixels: Singles, shape: tuple[int, ...]) -> Booleans:
    """(n,): which of (n, 2) pixels, column and row, lie in an image of that shape (h, w)."""
    height_px, width_px = shape
    last = (width_px - 1, height_px - 1)

    is_inside = (pixels >= 0) & (pixels <= last)
    return np.asarray(is_inside.all(axis=1))


def _redraw(pair: _Pair, guess: Floats) -> tuple[Bytes, Singles]:
    """The last view as it would look after the motion `guess`, and where each of its pixels was,
    (h, w, 2).
    """
    depth_m = np.where(pair.depth_m > 0, pair.depth_m, HORIZON_M).astype(np.float32)
    points = surface(depth_m, pair.calibration)
    column_px, row_px = project_back(points, guess, pair.calibration)

    before = np.dstack([column_px, row_px]).astype(np.float32)
    redrawn = cv2.remap(
        pair.last,
        before[..., 0],
        before[..., 1],
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )

    return np.asarray(redrawn, np.uint8), before


def _solve(
    points: Points,
    before_px: Floats,
    guess: Floats,
    wheels: Motion,
    calibration: Calibration,
) -> Motion | None:
    """The motion that best explains where the points were, from `guess`; None where too few agree
    on it.
    """
    motion, information = _most_likely(points, before_px, guess, wheels, calibration)

    residual_px = before_px - np.column_stack(project_back(points, motion, calibration))
    distance_px = np.hypot(*residual_px.T)
    if (distance_px < OUTLIER_PX).mean() < MIN_INLIER_SHARE:
        return None

    inflation = max(1.0, float(np.median(distance_px)) / TRACK_SD_PX)
    variances = np.diag(np.linalg.inv(information))
    deviation = inflation * np.sqrt(variances)

    return Motion(
        distance_m=float(motion[0]),
        turn_rad=float(motion[2]),
        distance_sd_m=float(deviation[0]),
        turn_sd_rad=float(deviation[2]),
    )


def _most_likely(
    points: Points,
    before_px: Floats,
    guess: Floats,
    wheels: Motion,
    calibration: Calibration,
) -> tuple[Floats, Floats]:
    """The motion (5,) by Gauss-Newton from `guess`, and its information (5, 5)."""
    prior = _prior(wheels)
    expected = np.array([wheels.distance_m, 0.0, wheels.turn_rad, 0.0, 0.0])

    motion = guess.copy()
    information = prior
    for _ in range(ITERATIONS):
        fit = _linearize(points, before_px, motion, calibration)
        information = prior + np.einsum("nik,n,nil->kl", fit.jacobian, fit.weight, fit.jacobian)
        pull = np.einsum("nik,n,ni->k", fit.jacobian, fit.weight, fit.residual_px)

        gradient = pull - prior @ (motion - expected)
        step = np.linalg.solve(information, gradient)
        motion = motion + step
        if np.abs(step).max() < CONVERGED:
            break

    return motion, information


def _prior(wheels: Motion) -> Floats:
    """The information of the wheels' motion, and that the robot hardly moves sideways or tilts."""
    deviations = [
        wheels.distance_sd_m,
        SIDEWAYS_SD_M,
        wheels.turn_sd_rad,
        TILT_SD_RAD,
        TILT_SD_RAD,
    ]
    return np.diag(1 / np.maximum(deviations, 1e-6) ** 2)


def _linearize(points: Points, before_px: Floats, motion: Floats, calibration: Calibration) -> _Fit:
    """Residuals at `motion`, their Jacobian by differences, and their weights."""
    at_rest = np.zeros(5)
    differences = np.vstack([at_rest, np.diag(np.full(5, DIFFERENCE))])
    motions = motion + differences

    column_px, row_px = project_back(points, motions.T[..., None], calibration)
    projected_px = np.stack([column_px, row_px], axis=2)

    predicted_px = projected_px[0]
    changes = (projected_px[1:] - predicted_px) / DIFFERENCE
    jacobian = np.ascontiguousarray(np.moveaxis(changes, 0, 2))

    residual_px = before_px - predicted_px
    return _Fit(residual_px, jacobian, _robust_weight(residual_px))


def _robust_weight(residual_px: Floats) -> Floats:
    """Geman-McClure weights (n,) of (n, 2) residuals, over the variance of a track."""
    distance_px = np.hypot(residual_px[:, 0], residual_px[:, 1])
    squared = (distance_px / OUTLIER_PX) ** 2

    weight: Floats = 1 / (1 + squared) ** 2 / TRACK_SD_PX**2
    return weight
