"""The rigid motion that best explains where points were before it: robust Gauss-Newton in all six
degrees of freedom, with the camera's disparity offset as a seventh. Pure.

All is in the camera's frame: x right, y down, z forward.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.schemas.sensing import Calibration

RIGHT, DOWN, FORWARD, PITCH, YAW, ROLL, OFFSET = range(7)
# Points nearer than this, in baselines, count as being there, so that nothing is divided by 0.
MIN_AHEAD_BASELINES = 0.6
# A bound on the steps; smaller ones than CONVERGED, in m and rad, end them.
ITERATIONS = 10
CONVERGED = 1e-5
# The least standard deviation of a track and of a disparity, in pixels.
MIN_TRACK_SD_PX = 0.08
FIRST_TRACK_SD_PX = 1.0
# Of a point's misfit, in its standard deviations: one that misfits by so much has a quarter of its
# weight (Geman and McClure). The median of two squared normal numbers.
OUTLIER_SDS = 3.0
MEDIAN_CHI2 = 1.386
# Of an offset that nothing shows, in pixels: so little is known of it.
MIN_OFFSET_PRECISION = 1 / 3.0**2


@dataclass(frozen=True)
class Prior:
    """What is expected of the motion: its mean (7,), and its precision (7, 7).

    The motion leads in the direction of half the turn, within `sideways_sd_m`.
    """

    mean: Floats
    precision: Floats
    sideways_sd_m: float


@dataclass(frozen=True)
class Solution:
    """The motion (7,), its covariance (7, 7), and the share of points that agree on it.

    `offset_px` is the offset that the points themselves show, whatever the prior, and
    `offset_sd_px` its standard deviation.
    """

    motion: Floats
    covariance: Floats
    inlier_share: float
    offset_px: float
    offset_sd_px: float


class Projection:
    """Points seen at `pixels` (n, 2) with `disparity_px` (n,), and where they were before a
    motion.
    """

    def __init__(self, pixels: Floats, disparity_px: Floats, calibration: Calibration) -> None:
        self._calibration = calibration
        self._focal_px = np.array([calibration.fx_px, calibration.fy_px])
        self._centre_px = np.array([calibration.cx_px, calibration.cy_px])
        ahead = np.ones((len(pixels), 1))
        self._rays = np.hstack([(pixels - self._centre_px) / self._focal_px, ahead])
        self._disparity_px = disparity_px

    def before(self, motion: Floats) -> tuple[Floats, Floats]:
        """Return the pixels (n, 2), and their derivatives by the motion (n, 2, 7)."""
        calibration = self._calibration
        mount_m = np.array([0.0, 0.0, calibration.mount_forward_m])
        disparity_px = np.maximum(self._disparity_px + motion[OFFSET], 0.1)
        depth_m = calibration.fx_px * calibration.baseline_m / disparity_px
        points_m = self._rays * depth_m[:, None]

        rotation, _ = cv2.Rodrigues(motion[PITCH : ROLL + 1])
        turned_m = (points_m + mount_m) @ rotation.T
        before_m = turned_m + motion[:PITCH] - mount_m
        least_m = MIN_AHEAD_BASELINES * calibration.baseline_m
        ahead_m = np.maximum(before_m[:, 2], least_m)
        plane = before_m[:, :2] / ahead_m[:, None]
        pixels = plane * self._focal_px + self._centre_px

        # By the point, then the point by the motion: a turn moves it across its arm.
        by_point = np.zeros((len(pixels), 2, 3))
        by_point[:, 0, 0] = self._focal_px[0] / ahead_m
        by_point[:, 1, 1] = self._focal_px[1] / ahead_m
        by_point[:, :, 2] = -self._focal_px * plane / ahead_m[:, None]
        by_turn = np.zeros((len(pixels), 3, 3))
        x_m, y_m, z_m = turned_m.T
        by_turn[:, 0, 1] = z_m
        by_turn[:, 0, 2] = -y_m
        by_turn[:, 1, 0] = -z_m
        by_turn[:, 1, 2] = x_m
        by_turn[:, 2, 0] = y_m
        by_turn[:, 2, 1] = -x_m
        by_offset = -(points_m / disparity_px[:, None]) @ rotation.T
        jacobian = np.concatenate(
            [by_point, by_point @ by_turn, by_point @ by_offset[:, :, None]], axis=2
        )
        return pixels, jacobian


def homography(motion: Floats, calibration: Calibration) -> Floats:
    """Return the matrix (4, 4) that maps columns, rows and disparities of points to what they were
    before `motion` (7,), up to scale (Demirdjian and Darrell 2001).
    """
    focal_baseline = calibration.fx_px * calibration.baseline_m
    from_points = np.array(
        [
            [calibration.fx_px, 0.0, calibration.cx_px, 0.0],
            [0.0, calibration.fy_px, calibration.cy_px, 0.0],
            [0.0, 0.0, 0.0, focal_baseline],
            [0.0, 0.0, 1.0, 0.0],
        ]
    )
    mount_m = np.array([0.0, 0.0, calibration.mount_forward_m])
    moved = np.eye(4)
    moved[:3, :3], _ = cv2.Rodrigues(motion[PITCH : ROLL + 1])
    moved[:3, 3] = moved[:3, :3] @ mount_m + motion[:PITCH] - mount_m

    shifted = np.eye(4)
    shifted[2, 3] = motion[OFFSET]
    result: Floats = from_points @ moved @ np.linalg.inv(from_points) @ shifted
    return result


def solve(projection: Projection, before_px: Floats, guess: Floats, prior: Prior) -> Solution:
    """Find the motion that best explains that the points were at `before_px` (n, 2), from `guess`
    (7,).

    A track errs by as much as tracks of these views do, and a disparity likewise.
    """
    motion = guess.copy()
    sd_px = FIRST_TRACK_SD_PX
    for _ in range(ITERATIONS):
        predicted_px, jacobian = projection.before(motion)
        residual_px = before_px - predicted_px
        by_disparity = jacobian[:, :, OFFSET]

        # The inverse covariance of each residual, 2 x 2, where both err by 1 px.
        spread = 1 + (by_disparity**2).sum(axis=1)
        precision = (
            np.eye(2) - by_disparity[:, :, None] * by_disparity[:, None] / spread[:, None, None]
        )
        squared = np.einsum("ni,nij,nj->n", residual_px, precision, residual_px)
        measured_px = float(np.sqrt(np.median(squared) / MEDIAN_CHI2))
        sd_px = float(np.clip(measured_px, MIN_TRACK_SD_PX, sd_px))
        misfit = squared / (OUTLIER_SDS * sd_px) ** 2
        weight = 1 / (1 + misfit) ** 2 / sd_px**2

        weighted = np.einsum("n,nij,nik->njk", weight, precision, jacobian)
        information = np.einsum("njk,njl->kl", jacobian, weighted)
        pull = np.einsum("njk,nj->k", weighted, residual_px)

        # Of the prior: the mean, and that the motion leads in the direction of half the turn.
        information += prior.precision
        pull -= prior.precision @ (motion - prior.mean)
        across = np.zeros(7)
        across[[RIGHT, FORWARD, YAW]] = 1.0, -motion[YAW] / 2, -motion[FORWARD] / 2
        across_m = motion[RIGHT] - motion[FORWARD] * motion[YAW] / 2
        information += np.outer(across, across) / prior.sideways_sd_m**2
        pull -= across * across_m / prior.sideways_sd_m**2

        step = np.linalg.solve(information, pull)
        motion = motion + step
        if np.abs(step).max() < CONVERGED:
            break

    # Without the prior of the offset, and so without its pull.
    free = information.copy()
    free[OFFSET, OFFSET] -= prior.precision[OFFSET, OFFSET] - MIN_OFFSET_PRECISION
    pull[OFFSET] += prior.precision[OFFSET, OFFSET] * (motion[OFFSET] - prior.mean[OFFSET])
    free_covariance = np.linalg.inv(free)
    return Solution(
        motion=motion,
        covariance=np.linalg.inv(information),
        inlier_share=float((misfit < 1).mean()),
        offset_px=float(motion[OFFSET] + (free_covariance @ pull)[OFFSET]),
        offset_sd_px=float(np.sqrt(free_covariance[OFFSET, OFFSET])),
    )
