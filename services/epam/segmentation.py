"""Segments of the view: what stands in each image column, and where one object ends and the next begins.

The camera is level and walls are upright, so what divides the view into objects are upright lines: depth and
colour are gathered by column, and columns are joined into objects by the likeliest sequence of names (Viterbi 1967).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from schemas.sensing import Calibration
from services.epam.appearance import Appearance, Image, colour_bins

Floats = npt.NDArray[np.float64]
LOWEST_M, HIGHEST_M = 0.4, 4.0
FARTHEST_M = 80.0
SAMPLES = 32
FEWEST_PIXELS = 4
LEAST_TALL_M = 2.0
INDEPENDENT_PIXELS = 6.0
SWITCH_COST, SWITCH_COST_AT_EDGE = 12.0, 4.0


@dataclass(frozen=True, eq=False)
class Columns:
    """The nearest wall in each of w columns: disparity in pixels, 0 where none stands, its top row, and its evidence.

    `evidence` (w, n + 1) is the log probability of the colours seen on it for each name and for anything else.
    """

    disparity_px: Floats
    top_row: npt.NDArray[np.intp]
    bottom_row: npt.NDArray[np.intp]
    evidence: Floats


@dataclass(frozen=True)
class Segment:
    """Columns `left` to `right`, inclusive, that show one object; `name` indexes the model's names."""

    left: int
    right: int
    name: int
    activation: float


def columns(lab_image: Image, depth_m: npt.NDArray[np.float32], calibration: Calibration, model: Appearance) -> Columns:
    """Gather by column what stands nearest, from depth (h, w), 0 unknown, and colour (h, w, 3)."""
    focal_baseline = calibration.fx_px * calibration.baseline_m
    rows = np.arange(calibration.height_px, dtype=np.float32)[:, None]
    height = calibration.mount_height_m - (rows - calibration.cy_px) / calibration.fy_px * depth_m
    disparity = np.divide(focal_baseline, depth_m, out=np.zeros_like(depth_m), where=depth_m > 0)
    upright = (disparity > focal_baseline / FARTHEST_M) & (height > LOWEST_M)
    wall_px = _middle(np.where(upright & (height < HIGHEST_M), disparity, np.inf))
    on_wall = upright & (np.abs(disparity - wall_px) < 0.6 + 0.12 * wall_px)
    count = on_wall.sum(0)
    wall_px[count < np.maximum(FEWEST_PIXELS, LEAST_TALL_M / calibration.baseline_m * wall_px)] = 0.0
    evidence = _evidence(lab_image, on_wall, count, model)
    top, bottom = on_wall.argmax(0), len(rows) - 1 - on_wall[::-1].argmax(0)
    return Columns(wall_px.astype(np.float64), top, bottom, evidence)


def _middle(values: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """The median of the finite values in each column, 0 where there are fewer than FEWEST_PIXELS."""
    count = np.isfinite(values).sum(0)
    ordered = np.sort(values, axis=0)
    middle = ordered[count // 2, np.arange(values.shape[1])]
    return np.where(count >= FEWEST_PIXELS, middle, 0).astype(np.float32)


def _evidence(
    lab_image: Image, on_wall: npt.NDArray[np.bool_], count: npt.NDArray[np.intp], model: Appearance
) -> Floats:
    """Log probability of SAMPLES pixels spread over each column's wall, as if INDEPENDENT_PIXELS of them told apart."""
    width = on_wall.shape[1]
    order = np.argsort(~on_wall, axis=0, kind="stable")
    place = (np.arange(SAMPLES)[:, None] + 0.5) * count[None] / SAMPLES
    rows = np.take_along_axis(order, place.astype(np.intp), axis=0)
    bins = colour_bins(lab_image[rows, np.arange(width)])
    mean = np.asarray(model.log_colour[bins].mean(0, dtype=np.float64))
    mean[count < FEWEST_PIXELS] = 0.0
    return mean * INDEPENDENT_PIXELS


def segments(seen: Columns, model: Appearance) -> list[Segment]:
    """The objects in view that have a name, from left to right."""
    names = _likeliest(seen)
    names[seen.disparity_px == 0] = -1
    starts = np.flatnonzero(np.diff(names, prepend=-2))
    ends = np.append(starts[1:], len(names)) - 1
    found = []
    for left, right in zip(starts.tolist(), ends.tolist(), strict=True):
        name = int(names[left])
        if 0 <= name < model.other:
            found.append(Segment(left, right, name, _activation(seen.evidence[left : right + 1], name)))
    return found


def _likeliest(seen: Columns) -> npt.NDArray[np.intp]:
    """The likeliest name of each column, where a change of name costs less at a step in depth and nothing at a gap."""
    before, after = seen.disparity_px[:-1], seen.disparity_px[1:]
    step = np.abs(after - before) > 0.5 + 0.08 * np.minimum(before, after)
    cost = np.where(step, SWITCH_COST_AT_EDGE, SWITCH_COST)
    cost[(before == 0) | (after == 0)] = 0.0
    width, states = seen.evidence.shape
    came_from = np.empty((width, states), np.intp)
    stay = np.arange(states)
    score = seen.evidence[0]
    for column in range(1, width):
        best = int(score.argmax())
        switched = score[best] - cost[column - 1]
        came_from[column] = np.where(score >= switched, stay, best)
        score = np.maximum(score, switched) + seen.evidence[column]
    names = np.empty(width, np.intp)
    names[-1] = score.argmax()
    for column in range(width - 1, 0, -1):
        names[column - 1] = came_from[column, names[column]]
    return names


def _activation(evidence: Floats, name: int) -> float:
    """The posterior of `name` given its columns, which see much the same wall and so count as few."""
    total = evidence.mean(0) * min(len(evidence), 4)
    weights = np.exp(total - total.max())
    return float(weights[name] / weights.sum())
