"""Learns the appearance model from a folder of labelled renderings, written by `python -m services.sim.renderings`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import msgspec
import numpy as np
import numpy.typing as npt
from rich.progress import track

from bus.errors import UsageError
from schemas.sensing import Calibration
from services.epam.appearance import BINS, DEFAULT_PATH, LIGHTNESS_LEVELS, Appearance, Floats, Image, colour_bins, lab

FARTHEST_M = 60.0
FEWEST_POINTS = 400
EDGE_M = 0.35
GROUND_BAND = 0.05
_CHROMA_LEVELS = round((BINS / LIGHTNESS_LEVELS) ** 0.5)


@dataclass(frozen=True, eq=False)
class LabelledView:
    """A rendering: image, true depth, label (h, w), 0 for no building, and the robot's x_m, y_m, heading_rad."""

    image: Image
    depth_m: npt.NDArray[np.float32]
    label: npt.NDArray[np.uint8]
    pose: Floats
    calibration: Calibration


@dataclass(frozen=True, eq=False)
class TownViews:
    """All renderings of one town; `names` is the same in every one."""

    names: tuple[str, ...]
    views: list[LabelledView]


def read(path: Path) -> TownViews:
    """The renderings in one file. Raises UsageError where it does not hold any."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            calibration = msgspec.json.decode(stored["calibration"].tobytes(), type=Calibration)
            images, depths, labels, poses = (stored[key] for key in ("left", "depth_m", "label", "pose"))
            names = tuple(str(name) for name in stored["names"])
    except (OSError, ValueError, KeyError, msgspec.DecodeError) as error:
        raise UsageError(
            f"{path} holds no renderings ({error}): write it with python -m services.sim.renderings"
        ) from None
    rows = zip(images, depths, labels, poses, strict=True)
    return TownViews(names, [LabelledView(*row, calibration) for row in rows])


def learn(towns: Iterator[TownViews]) -> Appearance:
    """The appearance model of what is in `towns`: colours from all views, sizes from what was seen in each town."""
    names: tuple[str, ...] = ()
    colours = np.zeros((BINS, 0))
    sizes: dict[int, list[Floats]] = {}
    tops: dict[int, list[Floats]] = {}
    for town in towns:
        if not names:
            names = town.names
            colours = np.zeros((BINS, len(names) + 1))
        points: dict[int, list[Floats]] = {}
        for view in town.views:
            _count_colours(view, colours)
            _gather_points(view, points)
            _gather_tops(view, tops)
        for name, clouds in sorted(points.items()):
            size = _size(np.concatenate(clouds))
            if size is not None:
                sizes.setdefault(name, []).append(size)
    missing = [name for index, name in enumerate(names) if index not in sizes or index not in tops]
    if missing or not names:
        raise UsageError(f"too few views of {', '.join(missing) or 'anything'}: render more towns or more views")
    merged = np.array([np.median(sizes[index], axis=0) for index in range(len(names))])
    top_m = np.array([np.quantile(np.concatenate(tops[index]), (0.1, 0.9)) for index in range(len(names))])
    return Appearance(names, _log_colour(colours), merged[:, :2], merged[:, 2], top_m)


def _surface(view: LabelledView) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """World coordinates (h, w, 3) of what each pixel shows, and which of them are on a building."""
    camera, depth = view.calibration, view.depth_m.astype(np.float64)
    rows, columns = np.indices(depth.shape)
    forward = depth + camera.mount_forward_m
    left = (camera.cx_px - columns) / camera.fx_px * depth
    up = camera.mount_height_m - (rows - camera.cy_px) / camera.fy_px * depth
    x, y, heading = view.pose
    east = x + np.cos(heading) * forward - np.sin(heading) * left
    north = y + np.sin(heading) * forward + np.cos(heading) * left
    return np.stack([east, north, up], axis=-1), (view.label > 0) & (depth > 0) & (depth < FARTHEST_M)


def _count_colours(view: LabelledView, colours: Floats) -> None:
    """Add the view's colours, each wall in each view counting alike. The last column is what shows where no wall is."""
    _, shown = _surface(view)
    below_horizon = np.arange(len(view.label))[:, None] - view.calibration.cy_px
    shown |= (view.label == 0) & (below_horizon < GROUND_BAND * view.calibration.fy_px)
    background = colours.shape[1] - 1
    labels = np.where(view.label > 0, view.label.astype(np.intp) - 1, background)[shown]
    bins = colour_bins(lab(view.image))[shown]
    for name in np.unique(labels):
        counts = np.bincount(bins[labels == name], minlength=BINS)
        if counts.sum() >= FEWEST_POINTS // 4:
            colours[:, name] += counts / counts.sum()


def _gather_points(view: LabelledView, points: dict[int, list[Floats]]) -> None:
    surface, shown = _surface(view)
    near = shown & (view.depth_m < FARTHEST_M / 2)
    labels, places = view.label[near].astype(np.intp) - 1, surface[near]
    for name in np.unique(labels).tolist():
        points.setdefault(name, []).append(places[labels == name])


def _gather_tops(view: LabelledView, tops: dict[int, list[Floats]]) -> None:
    """The height at which each column of a building ends, where the image does not cut it off."""
    surface, shown = _surface(view)
    for name in np.unique(view.label[shown]).tolist():
        mask = shown & (view.label == name)
        row, column = mask.argmax(0), np.flatnonzero(mask.any(0))
        column = column[row[column] > 2]
        if len(column):
            tops.setdefault(name - 1, []).append(surface[row[column], column, 2])


def _size(points: Floats) -> Floats | None:
    """Sides of the ground plan and height; None where not all sides were seen."""
    walls = points[points[:, 2] > 0.3]
    if len(walls) < FEWEST_POINTS:
        return None
    centre, sides, degrees = cv2.minAreaRect(walls[:, :2].astype(np.float32))
    turn = np.radians(degrees)
    axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    local = (walls[:, :2] - centre) @ axes
    half = np.array(sides) / 2
    if not all(_spanned(local, half, axis, sign) for axis in (0, 1) for sign in (-1, 1)):
        return None
    height = float(np.quantile(walls[:, 2], 0.999))
    return np.array([2 * half.max(), 2 * half.min(), height])


def _spanned(local: Floats, half: Floats, axis: int, sign: int) -> bool:
    """Whether most of one side was seen: points along the edge at `sign` of `axis`, in the rectangle's own frame."""
    along = local[sign * local[:, axis] > half[axis] - EDGE_M, 1 - axis]
    return len(along) > FEWEST_POINTS // 8 and float(np.ptp(np.quantile(along, (0.05, 0.95)))) > half[1 - axis]


def _log_colour(colours: Floats) -> npt.NDArray[np.float32]:
    """Smoothed log probabilities. What was not learned, the last column but one, is an average wall or any colour."""
    grid = colours.reshape(LIGHTNESS_LEVELS, _CHROMA_LEVELS, _CHROMA_LEVELS, -1).copy()
    for axis in range(3):
        grid = 0.5 * grid + 0.25 * (_shifted(grid, axis, 1) + _shifted(grid, axis, -1))
    smooth = grid.reshape(BINS, -1)
    smooth = smooth / smooth.sum(0) * 0.98 + 0.02 / BINS
    unknown = 0.5 * smooth[:, :-1].mean(1) + 0.5 / BINS
    return np.asarray(np.log(np.insert(smooth, -1, unknown, axis=1)), np.float32)


def _shifted(grid: Floats, axis: int, step: int) -> Floats:
    """`grid` moved by one bin, its border repeated."""
    index = (np.arange(grid.shape[axis]) + step).clip(0, grid.shape[axis] - 1)
    return np.asarray(np.take(grid, index, axis=axis))


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m services.epam.learn", description=__doc__)
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder with town-SEED.npz")
    parser.add_argument(
        "--out", type=Path, default=DEFAULT_PATH, metavar="FILE", help=f"default {DEFAULT_PATH.name} here"
    )
    arguments = parser.parse_args()
    files = sorted(arguments.folder.glob("town-*.npz"))
    try:
        if not files:
            raise UsageError(f"no town-*.npz in {arguments.folder}: write some with python -m services.sim.renderings")
        learn(read(path) for path in track(files, "towns")).save(arguments.out)
    except UsageError as error:
        sys.exit(f"learn: {error}")


if __name__ == "__main__":
    main()
