"""Fits an object's footprint to the walls that are seen, which gives its centre and its sides.

A rectangle has five unknowns: its centre (x right, z forward of the camera), its orientation, and
its sides, of which it is known what to expect. It is fitted to the disparity of each column and to
the columns where the object truly begins and ends, by damped least squares (Levenberg 1944,
Marquardt 1963) from several orientations at once. So the centre does not depend on which walls are
in view, and the fit has a covariance; orientations that fit about equally well are averaged by
their likelihood.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.schemas.sensing import MAX_BEARING_SD_RAD, Calibration
from cogmap.services.epam.layout.footprint_model import (
    COLUMNS,
    MIN_RANGE_M,
    PARAMETERS,
    FootprintProblem,
    linearized,
)

# Between two starts of a fit, which are over half a turn, as a rectangle has, and over a quarter
# where both sides are expected to be the same; a bound on its steps; and its first damping, 0.1 of
# the diagonal, lowered as after a step that improved the fit.
START_TURN_RAD = math.pi / 10
ITERATIONS = 8
FIRST_DAMPING = 0.1 * 0.2
# Errors of neighbouring columns are correlated: this many columns count as one.
CORRELATED_COLUMNS = 5
# Of a column's median, of what all columns of an object share, and of what is shared in addition
# when it has but one column.
DISPARITY_SD_PX = 0.14
DISPARITY_BIAS_SD_PX = 0.07
NARROW_BIAS_PX = 0.4
# Residuals beyond it, in standard deviations, count linearly.
HUBER = 1.5
MIN_BEARING_SD_RAD = 0.003
MIN_RANGE_SD_M = 0.1
HIDDEN_SD_M = 0.2
# Largest step of one iteration: x and z in metres, orientation in radians, half sides in metres.
MAX_STEP = np.array([5, 5, 0.4, 1, 1])
# What is known of the parameters beside, as information: next to nothing.
PRIOR = np.diag([1e-4, 1e-4, 1e-2, 0.0, 0.0])


@dataclass(frozen=True)
class Silhouette:
    """The visible part of an object: columns (n,) and their disparities in pixels (n,), the first
    and the last column, and whether the object truly begins and ends there or something else hides
    the rest; `sides_m` are those of its footprint, known to `sides_sd_m`.
    """

    columns: Floats
    disparity_px: Floats
    left: float
    right: float
    left_true: bool
    right_true: bool
    sides_m: tuple[float, float]
    sides_sd_m: tuple[float, float]

    @property
    def starts(self) -> int:
        """Return from how many orientations it is fitted."""
        sides = zip(self.sides_m, self.sides_sd_m, strict=True)
        is_square = len(set(sides)) == 1
        return round((math.pi / 2 if is_square else math.pi) / START_TURN_RAD)


@dataclass(frozen=True)
class ObjectPose:
    """An object's centre in the robot's frame, with standard deviations; `misfit` is the root mean
    square of the disparity residuals, in standard deviations. `width_m` is the mean of its sides.
    """

    bearing_rad: float
    range_m: float
    bearing_sd_rad: float
    range_sd_m: float
    misfit: float
    width_m: float

    @property
    def stated_bearing_sd_rad(self) -> float:
        """Return the standard deviation of the bearing as a percept states it: what stands at the
        camera, for all that is known, has no bearing.
        """
        return min(self.bearing_sd_rad, MAX_BEARING_SD_RAD)

    @property
    def sd_m(self) -> float:
        """Return the standard deviation of the place, along and across together."""
        return math.hypot(self.range_sd_m, self.range_m * self.bearing_sd_rad)

    def widened(self, factor: float) -> ObjectPose:
        """Return the pose with errors that many times as large."""
        return replace(
            self,
            bearing_sd_rad=factor * self.bearing_sd_rad,
            range_sd_m=factor * self.range_sd_m,
        )

    def blurred(self, sd_m: float) -> ObjectPose:
        """Return the pose with an error of that standard deviation more, in either direction."""
        across_sd_m = math.hypot(self.range_m * self.bearing_sd_rad, sd_m)
        return replace(
            self,
            bearing_sd_rad=across_sd_m / self.range_m,
            range_sd_m=math.hypot(self.range_sd_m, sd_m),
        )


@dataclass(frozen=True, eq=False)
class _Solution:
    """Fitted parameters (s, PARAMETERS), weighted residuals (s, r), normal matrices (s, PARAMETERS,
    PARAMETERS), and the gradient of a common disparity bias (s, PARAMETERS).
    """

    parameters: Floats
    residuals: Floats
    normal: Floats
    bias_gradient: Floats


def locate(silhouettes: list[Silhouette], camera: Calibration) -> list[ObjectPose]:
    """Return the pose of each silhouetted object, in the same order."""
    if not silhouettes:
        return []

    objects = _stacked(silhouettes, camera)
    starts = [silhouette.starts for silhouette in silhouettes]
    problem = objects.take(np.repeat(np.arange(len(silhouettes)), starts))
    start = np.concatenate([np.arange(count) for count in starts])
    solution = _solve(_started(problem, START_TURN_RAD * start), problem)

    # The root mean square residual of the disparities, in standard deviations of one column.
    error_px = solution.residuals[:, :COLUMNS] * problem.sd_px[:, None]
    rms_px = np.sqrt((error_px**2).mean(1))
    misfits = np.asarray(rms_px / DISPARITY_SD_PX)

    costs = (solution.residuals**2).sum(1)
    covariances = _covariances(solution, problem)
    ends = np.cumsum(starts)
    return [
        _mean_pose(
            solution.parameters[end - count : end],
            costs[end - count : end],
            covariances[end - count : end],
            misfits[end - count : end].min(),
            camera,
        )
        for count, end in zip(starts, ends, strict=True)
    ]


def bias_sd_px(width_px: Floats | int) -> Floats:
    """Return the standard deviation of what the disparities of an object err by together, of that
    many columns.
    """
    return np.asarray(DISPARITY_BIAS_SD_PX + NARROW_BIAS_PX / np.asarray(width_px))


def _stacked(silhouettes: list[Silhouette], camera: Calibration) -> FootprintProblem:
    """Stack all silhouettes into one problem, at COLUMNS evenly spaced columns of each."""
    columns = np.empty((len(silhouettes), COLUMNS))
    disparity_px = np.empty((len(silhouettes), COLUMNS))
    for row, silhouette in enumerate(silhouettes):
        spaced = np.linspace(0, len(silhouette.columns) - 1, COLUMNS)
        picked = spaced.round().astype(np.intp)
        columns[row] = silhouette.columns[picked]
        disparity_px[row] = silhouette.disparity_px[picked]

    width_px = np.array([len(each.columns) for each in silhouettes], float)
    edges_px = [(each.left, each.right) for each in silhouettes]
    true_ends = [(each.left_true, each.right_true) for each in silhouettes]
    sides_m = [each.sides_m for each in silhouettes]
    redundancy = np.maximum(1.0, COLUMNS * CORRELATED_COLUMNS / width_px)

    return FootprintProblem(
        slope=(columns - camera.cx_px) / camera.fx_px,
        disparity_px=disparity_px,
        edge_px=np.array(edges_px),
        hidden=~np.array(true_ends),
        half_m=np.array(sides_m) / 2,
        half_sd_m=np.array([each.sides_sd_m for each in silhouettes]) / 2,
        sd_px=DISPARITY_SD_PX * np.sqrt(redundancy),
        bias_sd_px=bias_sd_px(width_px),
        camera=camera,
    )


def _started(problem: FootprintProblem, turned_rad: Floats) -> Floats:
    """Return where each fit begins, (s, PARAMETERS): behind the middle of the wall that is seen,
    turned by `turned_rad` (s,) from the line of sight, with the sides that are expected.
    """
    camera = problem.camera
    right_px = problem.edge_px.mean(1) - camera.cx_px
    slope = np.asarray(right_px / camera.fx_px)

    focal_baseline = camera.fx_px * camera.baseline_m
    depth_m = focal_baseline / np.median(problem.disparity_px, axis=1)
    distance_m = depth_m * np.hypot(slope, 1)

    behind = 1 + 0.8 * problem.half_m.mean(1) / distance_m
    orientation = turned_rad - np.arctan(slope)
    centre = np.stack([slope * depth_m * behind, depth_m * behind, orientation], axis=1)
    return np.concatenate([centre, problem.half_m], axis=1)


def _solve(parameters: Floats, problem: FootprintProblem) -> _Solution:
    """Solve by Levenberg-Marquardt with Huber's weights (1964), each start with its own damping."""
    copies = problem.copies()
    best = parameters
    residuals, jacobian = linearized(best, copies)
    best_cost = _huber_cost(residuals)
    damping = np.full(len(best), FIRST_DAMPING)

    for _ in range(ITERATIONS):
        weighted, normal = _weighted_normal(jacobian, _huber_weight(residuals))
        gradient = np.einsum("sri,sr->si", weighted, residuals)
        added = np.einsum("sii->si", normal) * damping[:, None] + 1e-9
        damped = normal + added[:, :, None] * np.eye(PARAMETERS)
        step = np.linalg.solve(damped, gradient[..., None])[..., 0]

        candidate = best - step.clip(-MAX_STEP, MAX_STEP)
        new_residuals, new_jacobian = linearized(candidate, copies)
        cost = _huber_cost(new_residuals)

        better = cost < best_cost
        better_row = better[:, None]
        better_matrix = better_row[..., None]
        best_cost = np.where(better, cost, best_cost)
        best = np.where(better_row, candidate, best)
        residuals = np.where(better_row, new_residuals, residuals)
        jacobian = np.where(better_matrix, new_jacobian, jacobian)
        damping = np.where(better, damping * 0.2, damping * 8)

    weight = _huber_weight(residuals)
    weighted, normal = _weighted_normal(jacobian, weight)
    bias_share = problem.bias_sd_px / problem.sd_px
    of_columns = weighted[:, :COLUMNS].sum(1)
    return _Solution(
        parameters=best,
        residuals=residuals * np.sqrt(weight),
        normal=normal,
        bias_gradient=of_columns * bias_share[:, None],
    )


def _weighted_normal(jacobian: Floats, weight: Floats) -> tuple[Floats, Floats]:
    """Weight the derivatives (s, r, PARAMETERS) by (s, r), and compute the normal matrices (s,
    PARAMETERS, PARAMETERS).
    """
    weighted = jacobian * weight[..., None]
    normal = np.einsum("sri,srj->sij", weighted, jacobian)
    return weighted, np.asarray(normal)


def _huber_weight(residuals: Floats) -> Floats:
    safe_size = np.maximum(np.abs(residuals), 1e-12)
    return np.asarray(np.minimum(1.0, HUBER / safe_size))


def _huber_cost(residuals: Floats) -> Floats:
    size = np.abs(residuals)
    quadratic = size**2
    linear = HUBER * (2 * size - HUBER)
    cost = np.where(size < HUBER, quadratic, linear)
    return np.asarray(cost.sum(1))


def _covariances(solution: _Solution, problem: FootprintProblem) -> Floats:
    """Add up the covariances (s, PARAMETERS, PARAMETERS) of independent errors, of a bias that all
    disparities share, and of the centre if an edge is hidden.
    """
    independent = np.linalg.inv(solution.normal + PRIOR)

    common = np.einsum("sij,sj->si", independent, solution.bias_gradient)
    covariances = np.asarray(independent + _outer(common))

    hidden_m2 = np.where(problem.hidden.any(1), HIDDEN_SD_M**2, 0.0)
    covariances[:, :2, :2] += hidden_m2[:, None, None] * np.eye(2)
    return covariances


def _outer(vectors: Floats) -> Floats:
    """Compute the outer product of each of (s, k) vectors with itself, (s, k, k)."""
    columns = vectors[:, :, None]
    rows = vectors[:, None, :]
    return columns * rows


def _mean_pose(
    parameters: Floats, costs: Floats, covariances: Floats, misfit: float, camera: Calibration
) -> ObjectPose:
    """Average over all orientations, weighted by likelihood. Return bearing and range from the
    robot, with the standard deviations of this mixture.
    """
    likelihood = np.exp(-0.5 * (costs - costs.min()))
    weight = np.asarray(likelihood / likelihood.sum())
    centres = parameters[:, :2]
    mean: Floats = weight @ centres
    spread = covariances[:, :2, :2] + _outer(centres - mean)
    covariance: Floats = np.einsum("s,sij->ij", weight, spread)

    forward_m = mean[1] + camera.mount_forward_m
    left_m = -mean[0]
    distance_m = float(np.hypot(forward_m, left_m))
    range_m = max(distance_m, MIN_RANGE_M)

    radial = np.array([-left_m, forward_m]) / range_m
    tangential = np.array([radial[1], -radial[0]])
    range_sd_m = np.sqrt(radial @ covariance @ radial)
    bearing_sd_rad = np.sqrt(tangential @ covariance @ tangential) / range_m

    return ObjectPose(
        bearing_rad=float(np.arctan2(left_m, forward_m)),
        range_m=range_m,
        bearing_sd_rad=float(np.hypot(bearing_sd_rad, MIN_BEARING_SD_RAD)),
        range_sd_m=float(np.hypot(range_sd_m, MIN_RANGE_SD_M)),
        misfit=float(misfit),
        width_m=float(2 * (weight @ parameters[:, 3:]).mean()),
    )
