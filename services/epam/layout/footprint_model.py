"""The measurement model of a footprint fit: the disparities and edges that a rectangle at a pose
predicts for the columns of a view, what is expected of its sides, and the residuals of both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Booleans, Floats
from cogmap.schemas.sensing import Calibration

# Columns at which a fit compares disparities, however wide the object is.
COLUMNS = 20
# Of the column where an object ends.
EDGE_SD_PX = 1.2
# What is nearer counts as being here, so that nothing is divided by 0.
MIN_RANGE_M = 0.5
# Of a fit: x and z in metres, orientation in radians, and half of either side in metres.
PARAMETERS = 5
# Of differences of these.
STEPS = (1e-3, 1e-3, 1e-4, 1e-3, 1e-3)
# A footprint has sides, however little is seen of it.
MIN_HALF_M = 1.0

# Of the corners of a rectangle, along its two axes.
CORNER_SIGNS_A = np.array([1, 1, -1, -1])
CORNER_SIGNS_B = np.array([1, -1, 1, -1])


@dataclass(frozen=True, eq=False)
class FootprintProblem:
    """s stacked silhouettes: ray slopes and disparities (s, COLUMNS), edge columns and whether each
    is hidden (s, 2), half sides as they are expected, and the standard deviations of that (s, 2),
    standard deviations of disparity and of its bias (s,).
    """

    slope: Floats
    disparity_px: Floats
    edge_px: Floats
    hidden: Booleans
    half_m: Floats
    half_sd_m: Floats
    sd_px: Floats
    bias_sd_px: Floats
    camera: Calibration

    def take(self, rows: npt.NDArray[np.intp]) -> FootprintProblem:
        """Return the problem of these rows, each of which may be taken several times."""
        return FootprintProblem(
            self.slope[rows],
            self.disparity_px[rows],
            self.edge_px[rows],
            self.hidden[rows],
            self.half_m[rows],
            self.half_sd_m[rows],
            self.sd_px[rows],
            self.bias_sd_px[rows],
            self.camera,
        )

    def copies(self) -> FootprintProblem:
        """Return the problem as `linearized` takes it: once as it is, and once for each
        derivative.
        """
        every_row = np.arange(len(self.slope))
        return self.take(np.tile(every_row, 1 + len(STEPS)))


def _residuals(parameters: Floats, problem: FootprintProblem) -> Floats:
    """Compute the residuals of disparities, edges and sides, (s, COLUMNS + 4), in standard
    deviations, of (s, PARAMETERS) parameters.
    """
    camera = problem.camera
    half_m = np.maximum(parameters[:, 3:], MIN_HALF_M)
    focal_baseline = camera.fx_px * camera.baseline_m
    disparity_px = focal_baseline * _inverse_depths(parameters, problem)
    error_px = disparity_px - problem.disparity_px

    of_columns = error_px / problem.sd_px[:, None]

    # From each edge to the outermost corner of the rectangle. The true end at a hidden edge may lie
    # anywhere farther out.
    x, z, orientation = parameters[:, :3].T[:, :, None]
    a = half_m[:, :1] * CORNER_SIGNS_A
    b = half_m[:, 1:] * CORNER_SIGNS_B
    cos = np.cos(orientation)
    sin = np.sin(orientation)
    corner_x = x + a * cos - b * sin
    corner_z = z + a * sin + b * cos

    depth_m = np.maximum(corner_z, MIN_RANGE_M)
    corners_px = camera.cx_px + camera.fx_px * corner_x / depth_m
    outermost_px = np.stack([corners_px.min(1), corners_px.max(1)], axis=1)
    error_px = outermost_px - problem.edge_px

    outward_px = error_px * np.array([-1.0, 1.0])
    is_free = problem.hidden & (outward_px > 0)
    of_edges = np.where(is_free, 0.0, error_px) / EDGE_SD_PX
    of_sides = (parameters[:, 3:] - problem.half_m) / problem.half_sd_m
    return np.concatenate([of_columns, of_edges, of_sides], axis=1)


def _inverse_depths(parameters: Floats, problem: FootprintProblem) -> Floats:
    """Return 1 / depth in metres, (s, COLUMNS), where the rays meet sides that face the camera."""
    x, z, orientation = parameters[:, :3].T
    halves_m = np.maximum(parameters[:, 3:], MIN_HALF_M)
    cos = np.cos(orientation)
    sin = np.sin(orientation)

    inverse = np.full(problem.slope.shape, np.inf)
    axes = ((cos, sin), (-sin, cos))
    for (axis_x, axis_z), half_m in zip(axes, halves_m.T, strict=True):
        along_m = x * axis_x + z * axis_z
        gap_m = np.abs(along_m) - half_m

        # A ray approaches the side by so much for each metre of depth, and crosses the gap before
        # it, unless the side does not face the camera.
        across = problem.slope * axis_x[:, None] + axis_z[:, None]
        towards = across * np.sign(along_m)[:, None]
        facing = gap_m > 1e-3
        safe_gap_m = np.where(facing, gap_m, 1.0)
        of_side = np.where(facing[:, None], towards / safe_gap_m[:, None], np.inf)
        inverse = np.minimum(inverse, of_side)

    met = np.isfinite(inverse)
    return np.where(met, inverse, 1 / MIN_RANGE_M)


def linearized(parameters: Floats, copies: FootprintProblem) -> tuple[Floats, Floats]:
    """Compute residuals (s, r) and their derivatives (s, r, PARAMETERS), by forward differences, of
    (s, PARAMETERS) `parameters` and the copies of their problem.
    """
    evaluated = [parameters]
    for axis, step in enumerate(STEPS):
        shifted = parameters.copy()
        shifted[:, axis] += step
        evaluated.append(shifted)

    # All at once: one call of numpy for four evaluations.
    values = _residuals(np.concatenate(evaluated), copies)
    residuals, *others = np.split(values, len(evaluated))

    changes = zip(others, STEPS, strict=True)
    derivatives = [(other - residuals) / step for other, step in changes]
    return residuals, np.stack(derivatives, axis=2)
