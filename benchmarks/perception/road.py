"""How well road is found: its pixels, and where it ends on the ground."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from schemas.sensing import Calibration

GROUND = 1
ROAD = 2
WITHIN_M = 15.0
BEYOND_M = 3.0
Bools = npt.NDArray[np.bool_]
Bytes = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float64]
Floats32 = npt.NDArray[np.float32]


def road_iou(found: Bools, surface: Bytes) -> float:
    """Of all pixels that are road or taken for it, the share that are both; masks and surfaces are
    (…, h, w).

    `surface` is 2 where there is road. NaN where there is none at all.
    """
    road = surface == ROAD
    either = np.count_nonzero(found | road)
    return float(np.count_nonzero(found & road) / either) if either else float("nan")


def road_edge_errors_m(
    boundary_m: npt.ArrayLike, surface: Bytes, depth_m: Floats32, camera: Calibration
) -> npt.NDArray[np.float64]:
    """How far each point of `boundary_m` (n, 2), in the robot's frame, is from the nearest true one
    of the view.

    `surface` and true `depth_m` are (h, w). Infinite where no road ends in the view.
    """
    points = np.asarray(boundary_m, np.float64).reshape(-1, 2)
    return _nearest_m(points, true_boundary_m(surface, depth_m, camera, WITHIN_M + BEYOND_M))


def road_edges_missed_m(
    boundary_m: npt.ArrayLike, surface: Bytes, depth_m: Floats32, camera: Calibration
) -> npt.NDArray[np.float64]:
    """How far each true point where road ends within WITHIN_M is from the nearest one that was
    found.
    """
    points = np.asarray(boundary_m, np.float64).reshape(-1, 2)
    return _nearest_m(true_boundary_m(surface, depth_m, camera, WITHIN_M), points)


def road_edge_error_m(errors_m: list[npt.NDArray[np.float64]]) -> float:
    """The median over all points of all views. NaN where there is no point."""
    every = np.concatenate([*errors_m, np.empty(0)])
    return float(np.median(every)) if every.size else float("nan")


def true_boundary_m(
    surface: Bytes, depth_m: Floats32, camera: Calibration, within_m: float
) -> Floats:
    """Where road and other ground are neighbours in the image: points half way between, (n, 2), in
    the robot's frame.

    Where something upright hides the ground, or the image ends, nobody can see the road end.
    """
    ground = _ground_m(depth_m, camera)
    points = []
    for here, there in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        one = surface[here]
        other = surface[there]
        ends = ((one == ROAD) & (other == GROUND)) | ((one == GROUND) & (other == ROAD))
        points.append((ground[here][ends] + ground[there][ends]) / 2)
    every = np.concatenate(points)
    return np.asarray(every[np.hypot(every[:, 0], every[:, 1]) <= within_m])


def _ground_m(depth_m: Floats32, camera: Calibration) -> Floats:
    """Forward and left of the robot, (h, w, 2), what each pixel shows."""
    columns = np.arange(depth_m.shape[1])
    left = (camera.cx_px - columns) / camera.fx_px * depth_m
    return np.stack([depth_m + camera.mount_forward_m, left], axis=-1).astype(np.float64)


def _nearest_m(points: Floats, others: Floats) -> Floats:
    """The distance from each of `points` (n, 2) to the nearest of `others` (m, 2)."""
    if not len(others):
        return np.full(len(points), np.inf)
    return np.asarray(np.hypot(*(points[:, None] - others[None]).transpose(2, 0, 1)).min(axis=1))
