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
INDEPENDENT_PER_M, MOST_INDEPENDENT = 15.0, 6.0
SWITCH_COST, SWITCH_COST_AT_EDGE = 15.0, 4.0
SLIVER_M, DOUBTFUL_M = 1.1, 1.8
HEIGHT_SHARE, UNKNOWN_HEIGHT = 0.5, -1.0
TOP_SD_PX, CUT_ROW = 1.5, 2


@dataclass(frozen=True, eq=False)
class Columns:
    """The nearest wall in each of w columns: disparity in pixels, 0 where none stands, how wide
    a piece of it fills the column, and its rows.

    `evidence` (w, n + 2) is the log probability of the colours seen on it, for the columns of Appearance.log_colour.
    """

    disparity_px: Floats
    width_m: Floats
    top_row: npt.NDArray[np.intp]
    bottom_row: npt.NDArray[np.intp]
    evidence: Floats


@dataclass(frozen=True)
class Segment:
    """Columns `left` to `right`, inclusive, that show one object; `name` indexes the model's names.

    `left_true` and `right_true` say that the object itself ends there, and is not hidden or cut off by the image.
    """

    left: int
    right: int
    left_true: bool
    right_true: bool
    name: int
    activation: float


def columns(lab_image: Image, depth_m: npt.NDArray[np.float32], calibration: Calibration, model: Appearance) -> Columns:
    """Gather by column what stands nearest, from depth (h, w), 0 unknown, and colour (h, w, 3)."""
    focal_baseline = calibration.fx_px * calibration.baseline_m
    rows = np.arange(calibration.height_px, dtype=np.float32)[:, None]
    height = calibration.mount_height_m - (rows - calibration.cy_px) / calibration.fy_px * depth_m
    disparity = np.divide(focal_baseline, depth_m, out=np.zeros_like(depth_m), where=depth_m > 0)
    possible = (disparity > focal_baseline / FARTHEST_M) & (disparity < calibration.width_px)
    upright = possible & (height > LOWEST_M)
    wall_px = _middle(np.where(upright & (height < HIGHEST_M), disparity, np.inf))
    on_wall = upright & (np.abs(disparity - wall_px) < 0.6 + 0.12 * wall_px)
    count = on_wall.sum(0)
    wall_px[count < np.maximum(FEWEST_PIXELS, LEAST_TALL_M / calibration.baseline_m * wall_px)] = 0.0
    column_m = np.divide(calibration.baseline_m, wall_px, out=np.zeros_like(wall_px), where=wall_px > 0)
    weight = np.minimum(MOST_INDEPENDENT, INDEPENDENT_PER_M * column_m)
    order = np.argsort(~on_wall, axis=0, kind="stable")
    top, bottom = _row_at(order, np.array([[0.0], [0.97]]) * count)
    evidence = _colours(lab_image, order, count, model) + HEIGHT_SHARE * _heights(top, wall_px, calibration, model)
    evidence *= weight[:, None]
    evidence[wall_px == 0] = 0.0
    return Columns(wall_px.astype(np.float64), column_m.astype(np.float64), top, bottom, evidence)


def _middle(values: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """The median of the finite values in each column, 0 where there are fewer than FEWEST_PIXELS."""
    count = np.isfinite(values).sum(0)
    ordered = np.sort(values, axis=0)
    middle = ordered[count // 2, np.arange(values.shape[1])]
    return np.where(count >= FEWEST_PIXELS, middle, 0).astype(np.float32)


def _row_at(order: npt.NDArray[np.intp], place: Floats) -> npt.NDArray[np.intp]:
    """The rows that are at `place` (k, w) among those on the wall, which `order` (h, w) puts first, from the top."""
    return np.take_along_axis(order, place.astype(np.intp), axis=0)


def _heights(
    top: npt.NDArray[np.intp], wall_px: npt.NDArray[np.float32], camera: Calibration, model: Appearance
) -> Floats:
    """Log probability (w, n + 2), but for a constant, of a wall that ends at row `top`; cut there, it may be higher."""
    depth_m = camera.fx_px * camera.baseline_m / np.maximum(wall_px, 0.5).astype(np.float64)
    top_m = camera.mount_height_m + (camera.cy_px - top) / camera.fy_px * depth_m
    sd_m = 0.25 + 0.05 * np.abs(top_m) + TOP_SD_PX * depth_m / camera.fy_px
    low, high = model.top_m.T
    short = np.where(top[:, None] <= CUT_ROW, 0.0, low - top_m[:, None])
    off = np.maximum(np.maximum(short, top_m[:, None] - high), 0.0) / sd_m[:, None]
    known = -0.5 * np.minimum(off, 3.0) ** 2
    return np.concatenate([known, np.full((len(top), 2), UNKNOWN_HEIGHT)], axis=1)


def _colours(lab_image: Image, order: npt.NDArray[np.intp], count: npt.NDArray[np.intp], model: Appearance) -> Floats:
    """Mean log probability (w, n + 2) of SAMPLES pixels spread over each column's wall."""
    rows = _row_at(order, (np.arange(SAMPLES)[:, None] + 0.5) * count[None] / SAMPLES)
    bins = colour_bins(lab_image[rows, np.arange(len(count))])
    return np.asarray(model.log_colour[bins].mean(0, dtype=np.float64))


def segments(seen: Columns, model: Appearance) -> list[Segment]:
    """The objects in view that have a name, from left to right.

    Next to a piece so narrow that it might be a part of the object or of another, nobody knows where the object ends.
    """
    names = _likeliest(seen)
    names[(seen.disparity_px == 0) | (names == model.background)] = -1
    disparity_px = np.where(names < 0, 0.0, seen.disparity_px)
    _join_slivers(names, seen)
    pieces = runs(names)
    doubtful = [names[left] >= 0 and seen.width_m[left : right + 1].sum() < DOUBTFUL_M for left, right in pieces]
    found = []
    for number, (left, right) in enumerate(pieces):
        name = int(names[left])
        if 0 <= name < model.other:
            after_doubt, before_doubt = doubtful[max(number - 1, 0)], doubtful[min(number + 1, len(pieces) - 1)]
            ends = (
                not after_doubt and _ends(disparity_px, left, -1),
                not before_doubt and _ends(disparity_px, right, 1),
            )
            found.append(Segment(left, right, *ends, name, _activation(seen.evidence[left : right + 1], name)))
    return found


def _ends(disparity_px: Floats, column: int, outward: int) -> bool:
    """Whether an object whose last column is `column` really ends there.

    On the left the view ends, for what is nearer, where the right camera's does: as far in as the disparity.
    """
    beyond, inside = column + 4 * outward, column - 3 * outward
    wide = len(disparity_px)
    if not 0 <= beyond < wide or not 0 <= inside < wide or beyond < disparity_px[inside]:
        return False
    return bool(disparity_px[beyond] <= disparity_px[inside] + 0.3)


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


def runs(names: npt.NDArray[np.intp]) -> list[tuple[int, int]]:
    """First and last column of each run of equal names."""
    starts = np.flatnonzero(np.diff(names, prepend=-2))
    ends = np.append(starts[1:], len(names)) - 1
    return list(zip(starts.tolist(), ends.tolist(), strict=True))


def _join_slivers(names: npt.NDArray[np.intp], seen: Columns) -> None:
    """Give a piece too narrow to be an object the name of the wall that it continues: it is a stripe or a corner."""
    pieces = runs(names)
    for number, (left, right) in enumerate(pieces):
        if names[left] < 0 or seen.width_m[left : right + 1].sum() > SLIVER_M:
            continue
        best_m, name = 0.0, -1
        for other, near, far in ((number - 1, left, left - 1), (number + 1, right, right + 1)):
            if not 0 <= other < len(pieces) or names[far] < 0:
                continue
            step = abs(seen.disparity_px[near] - seen.disparity_px[far])
            wide_m = seen.width_m[pieces[other][0] : pieces[other][1] + 1].sum()
            if step < 0.3 + 0.03 * seen.disparity_px[near] and wide_m > max(best_m, SLIVER_M):
                best_m, name = float(wide_m), int(names[far])
        if name >= 0:
            names[left : right + 1] = name


def _activation(evidence: Floats, name: int) -> float:
    """The posterior of `name` given its columns, which see much the same wall and so count as few."""
    total = evidence.mean(0) * min(len(evidence), 4)
    weights = np.exp(total - total.max())
    return float(weights[name] / weights.sum())
