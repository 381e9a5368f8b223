"""Where an object's centre is: its learned ground plan laid under the walls that are seen.

A rectangle of known sides has three unknowns: its centre (x right, z forward of the camera) and its
turn. It is fitted to the disparity of each column and to the columns where the object truly begins
and ends, by damped least squares (Levenberg 1944, Marquardt 1963) from several turns at once. So
the centre does not depend on which walls are in view, and the fit says how sure it is; turns that
fit about as well are averaged by their likelihood.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from schemas.sensing import Calibration

Floats = npt.NDArray[np.float64]
TURNS = 10
POINTS = 20
ROUNDS = 9
DISPARITY_SD_PX = 0.14
ALIKE_COLUMNS = 5
DISPARITY_BIAS_SD_PX = 0.03
NARROW_BIAS_PX = 0.4
EDGE_SD_PX = 1.2
HUBER = 1.5
NEAREST_M = 0.5
LEAST_BEARING_SD_RAD = 0.003
LEAST_RANGE_SD_M = 0.1
HIDDEN_SD_M = 0.2


@dataclass(frozen=True)
class Outline:
    """What was seen of an object: columns (n,) with their disparities, the first and last of them,
    and whether it truly begins and ends there, or something else hides the rest; `sides_m` of its
    ground plan.
    """

    columns: Floats
    disparity_px: Floats
    left: float
    right: float
    left_true: bool
    right_true: bool
    sides_m: tuple[float, float]


@dataclass(frozen=True)
class Place:
    """The centre in the robot's frame, its standard deviations, and the root mean square misfit in
    deviations.
    """

    bearing_rad: float
    range_m: float
    bearing_sd_rad: float
    range_sd_m: float
    misfit: float


@dataclass(frozen=True, eq=False)
class _Problem:
    """Stacked outlines, a row each: slopes and disparities (s, POINTS), edge columns, which are
    hidden, half sides.
    """

    slope: Floats
    disparity: Floats
    edge: Floats
    hidden: npt.NDArray[np.bool_]
    half: Floats
    sd_px: Floats
    bias_sd_px: Floats
    camera: Calibration

    def take(self, rows: npt.NDArray[np.intp]) -> _Problem:
        return _Problem(
            self.slope[rows],
            self.disparity[rows],
            self.edge[rows],
            self.hidden[rows],
            self.half[rows],
            self.sd_px[rows],
            self.bias_sd_px[rows],
            self.camera,
        )


def locate(outlines: list[Outline], camera: Calibration) -> list[Place]:
    """The place of each outlined object, in the same order."""
    if not outlines:
        return []
    problem = _stack(outlines, camera)
    starts = _starts(problem)
    problem = problem.take(np.repeat(np.arange(len(outlines)), TURNS))
    found, residual, normal, pull = _solve(starts, problem)
    cost = (residual**2).sum(1)
    covariance = _covariance(normal, pull)
    hidden_variance = np.asarray(np.where(problem.hidden.any(1), HIDDEN_SD_M**2, 0.0))
    covariance[:, :2, :2] += hidden_variance[:, None, None] * np.eye(2)
    shape = (len(outlines), TURNS)
    error_px = residual[:, :POINTS] * problem.sd_px[:, None]
    misfit = np.sqrt((error_px**2).mean(1)).reshape(shape).min(1) / DISPARITY_SD_PX
    return [
        _place(*parts, camera)
        for parts in zip(
            found.reshape(*shape, 3),
            cost.reshape(shape),
            covariance.reshape(*shape, 3, 3),
            misfit,
            strict=True,
        )
    ]


def _stack(outlines: list[Outline], camera: Calibration) -> _Problem:
    picks = [
        np.linspace(0, len(outline.columns) - 1, POINTS).round().astype(np.intp)
        for outline in outlines
    ]
    columns = np.array(
        [outline.columns[pick] for outline, pick in zip(outlines, picks, strict=True)]
    )
    wide = np.array([len(outline.columns) for outline in outlines], float)
    return _Problem(
        (columns - camera.cx_px) / camera.fx_px,
        np.array(
            [outline.disparity_px[pick] for outline, pick in zip(outlines, picks, strict=True)]
        ),
        np.array([(outline.left, outline.right) for outline in outlines]),
        np.array([(not outline.left_true, not outline.right_true) for outline in outlines]),
        np.array([outline.sides_m for outline in outlines]) / 2,
        # Neighbouring columns err alike, so that many of them tell no more than few.
        DISPARITY_SD_PX * np.sqrt(np.maximum(1.0, POINTS * ALIKE_COLUMNS / wide)),
        DISPARITY_BIAS_SD_PX + NARROW_BIAS_PX / wide,
        camera,
    )


def _starts(problem: _Problem) -> Floats:
    """TURNS starts an object (s * TURNS, 3): behind the middle of what is seen."""
    camera = problem.camera
    depth = camera.fx_px * camera.baseline_m / np.median(problem.disparity, axis=1)
    slope = (problem.edge.mean(1) - camera.cx_px) / camera.fx_px
    behind = 1 + 0.8 * problem.half.mean(1) / (depth * np.hypot(slope, 1))
    turns = np.linspace(0, np.pi, TURNS, endpoint=False)
    centre = np.stack([slope * depth * behind, depth * behind, np.zeros_like(depth)], axis=1)
    starts = np.repeat(centre, TURNS, axis=0)
    starts[:, 2] = np.tile(turns, len(depth)) - np.repeat(np.arctan(slope), TURNS)
    return starts


def _residuals(parameters: Floats, problem: _Problem) -> Floats:
    """(s, POINTS + 2) in standard deviations, for (s, 3) parameters x_m, z_m, turn_rad."""
    camera = problem.camera
    x, z, turn = parameters.T
    cos = np.cos(turn)
    sin = np.sin(turn)
    inverse = np.full(problem.slope.shape, np.inf)
    for axis_x, axis_z, half in ((cos, sin, problem.half[:, 0]), (-sin, cos, problem.half[:, 1])):
        along = x * axis_x + z * axis_z
        gap = np.abs(along) - half
        facing = gap > 1e-3
        towards = (problem.slope * axis_x[:, None] + axis_z[:, None]) * np.sign(along)[:, None]
        plane = towards / np.where(facing, gap, 1.0)[:, None]
        inverse = np.where(facing[:, None], np.minimum(inverse, plane), inverse)
    inverse = np.where(np.isfinite(inverse), inverse, 1 / NEAREST_M)
    disparity = camera.fx_px * camera.baseline_m * inverse
    depth_error = (disparity - problem.disparity) / problem.sd_px[:, None]
    return np.concatenate([depth_error, _edge_error(x, z, cos, sin, problem)], axis=1)


def _edge_error(x: Floats, z: Floats, cos: Floats, sin: Floats, problem: _Problem) -> Floats:
    """How far the rectangle's outermost corners are from the edges; a hidden edge may lie anywhere
    farther out.
    """
    camera = problem.camera
    signs_a = np.array([1, 1, -1, -1])
    signs_b = np.array([1, -1, 1, -1])
    a = problem.half[:, :1] * signs_a
    b = problem.half[:, 1:] * signs_b
    corner_x = x[:, None] + a * cos[:, None] - b * sin[:, None]
    corner_z = z[:, None] + a * sin[:, None] + b * cos[:, None]
    corner = camera.cx_px + camera.fx_px * corner_x / np.maximum(corner_z, NEAREST_M)
    error = np.stack(
        [corner.min(1) - problem.edge[:, 0], corner.max(1) - problem.edge[:, 1]], axis=1
    )
    farther = error * np.array([-1.0, 1.0])
    return np.where(problem.hidden & (farther > 0), 0.0, error) / EDGE_SD_PX


def _linearised(parameters: Floats, problem: _Problem) -> tuple[Floats, Floats]:
    """Residuals (s, r) and their derivatives (s, r, 3), by differences."""
    steps = np.array([1e-3, 1e-3, 1e-4])
    moved = np.concatenate([parameters, *(parameters + step for step in np.diag(steps))])
    values = _residuals(moved, problem.take(np.tile(np.arange(len(parameters)), 4)))
    residual, *shifted = np.split(values, 4)
    return residual, np.stack(
        [(other - residual) / step for other, step in zip(shifted, steps, strict=True)], axis=2
    )


def _solve(parameters: Floats, problem: _Problem) -> tuple[Floats, Floats, Floats, Floats]:
    """The fits, their damped-down (Huber 1964) residuals, normal matrices, and the pull of a common
    disparity error.
    """
    damping = np.full(len(parameters), 0.1)
    best = np.full(len(parameters), np.inf)
    kept = parameters
    ahead = parameters
    residual, slope = _linearised(parameters, problem)
    for _ in range(ROUNDS):
        new_residual, new_slope = _linearised(ahead, problem)
        new_cost = _huber_cost(new_residual)
        better = new_cost < best
        best = np.where(better, new_cost, best)
        kept = np.where(better[:, None], ahead, kept)
        residual = np.where(better[:, None], new_residual, residual)
        slope = np.where(better[:, None, None], new_slope, slope)
        damping = np.where(better, damping * 0.2, damping * 8)
        weighted = slope * _weight(residual)[..., None]
        normal = np.einsum("sri,srj->sij", weighted, slope)
        gradient = np.einsum("sri,sr->si", weighted, residual)
        scale = np.einsum("sii->si", normal) * damping[:, None] + 1e-9
        step = np.linalg.solve(normal + scale[:, :, None] * np.eye(3), gradient[..., None])[..., 0]
        ahead = kept - step.clip([-5, -5, -0.4], [5, 5, 0.4])
    weight = _weight(residual)
    weighted = slope * weight[..., None]
    normal = np.einsum("sri,srj->sij", weighted, slope)
    pull = weighted[:, :POINTS].sum(1) * (problem.bias_sd_px / problem.sd_px)[:, None]
    return kept, residual * np.sqrt(weight), np.asarray(normal), np.asarray(pull)


def _weight(residual: Floats) -> Floats:
    return np.asarray(np.minimum(1.0, HUBER / np.maximum(np.abs(residual), 1e-12)))


def _huber_cost(residual: Floats) -> Floats:
    size = np.abs(residual)
    return np.asarray(np.where(size < HUBER, size**2, HUBER * (2 * size - HUBER)).sum(1))


def _covariance(normal: Floats, pull: Floats) -> Floats:
    """(s, 3, 3): of independent errors, and of one that all disparities have in common."""
    spread = np.linalg.inv(normal + np.diag([1e-4, 1e-4, 1e-2]))
    common = np.einsum("sij,sj->si", spread, pull)
    return np.asarray(spread + common[:, :, None] * common[:, None, :])


def _place(
    found: Floats, cost: Floats, covariance: Floats, misfit: float, camera: Calibration
) -> Place:
    """The mean and spread over all turns, weighted by their likelihood, as bearing and range from
    the robot.
    """
    weight = np.exp(-0.5 * (cost - cost.min()))
    weight /= weight.sum()
    centre = weight @ found[:, :2]
    away = found[:, :2] - centre
    spread = np.einsum(
        "s,sij->ij", weight, covariance[:, :2, :2] + away[:, :, None] * away[:, None, :]
    )
    forward = centre[1] + camera.mount_forward_m
    left = -centre[0]
    range_m = max(float(np.hypot(forward, left)), NEAREST_M)
    outward = np.array([-left, forward]) / range_m
    across = np.array([outward[1], -outward[0]])
    return Place(
        bearing_rad=float(np.arctan2(left, forward)),
        range_m=range_m,
        bearing_sd_rad=float(
            np.hypot(np.sqrt(across @ spread @ across) / range_m, LEAST_BEARING_SD_RAD)
        ),
        range_sd_m=float(np.hypot(np.sqrt(outward @ spread @ outward), LEAST_RANGE_SD_M)),
        misfit=float(misfit),
    )
