"""KITTI odometry folders: rectified stereo pairs from a car (Geiger, Lenz and Urtasun 2012,
doi 10.1109/CVPR.2012.6248074).

A sequence has `calib.txt`, with the projection matrices of its rectified cameras, 12 numbers a
line, `times.txt`, in seconds, and pictures in `image_0` and `image_1` (grey), `image_2` and
`image_3` (colour) or `image_l` and `image_r`. Its true poses are `poses.txt` beside them, or
`poses/NN.txt` beside the folder `sequences`.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cogmap.data.stereo_recording import StereoRecording, checked_stamps, pair_size_px
from cogmap.data.text import NS_PER_S, Line, number_of, numbered_lines, time_ns_of
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats, Indices
from cogmap.schemas.sensing import Calibration

# The cameras of the car, in its published drawing: 1.65 m above the road, ten pairs a second.
MOUNT_HEIGHT_M = 1.65
INTERVAL_NS = NS_PER_S // 10
# Of rectified cameras the focal lengths are one number, printed with at least six digits.
MAX_FOCAL_DIFFERENCE = 1e-4
GIVE = "the folder of a KITTI odometry sequence"
MATRIX = "a camera's name and the 12 numbers of its projection matrix"
POSE = "the 12 numbers of a pose, 3 x 4"


class _Layout(NamedTuple):
    """The folders of a pair's pictures, and which of the cameras' matrices are theirs."""

    left: str
    right: str
    left_camera: int
    right_camera: int


LAYOUTS = (
    _Layout("image_0", "image_1", 0, 1),
    _Layout("image_l", "image_r", 0, 1),
    _Layout("image_2", "image_3", 2, 3),
)


def read_kitti(folder: Path) -> StereoRecording:
    """Return the sequence in `folder`. Pictures are numbered; a pair of which one is missing keeps
    its place.

    Raises UsageError if there is no calibration, no pair, or left and right are of other sizes; if
    stamps go back; or naming the line that is wrong.
    """
    if not folder.is_dir():
        raise UsageError(f"there is no folder {folder}: give {GIVE}")
    layout = _layout(folder)
    matrices = _matrices(folder)
    for camera in (layout.left_camera, layout.right_camera):
        if camera not in matrices:
            raise UsageError(
                f"{folder / 'calib.txt'} has no matrix P{camera}: give the sequence's own calib.txt"
            )

    numbers, left, right = _pictures(folder, layout)
    width_px, height_px = pair_size_px(zip(left, right, strict=True), folder, GIVE)
    calibration = _calibration(
        folder, matrices[layout.left_camera], matrices[layout.right_camera], width_px, height_px
    )
    return StereoRecording(
        name=folder.name,
        calibration=calibration,
        stamps_ns=_stamps_ns(folder, numbers),
        true_poses=_true_poses(folder, numbers),
        left=left,
        right=right,
    )


def _layout(folder: Path) -> _Layout:
    for layout in LAYOUTS:
        if (folder / layout.left).is_dir() and (folder / layout.right).is_dir():
            return layout
    raise UsageError(
        f"{folder} has no folders image_0 and image_1 (nor image_l and image_r): give {GIVE}"
    )


def _matrices(folder: Path) -> dict[int, Floats]:
    """Return the projection matrices (3, 4) by camera: those of lines `P0: ...`, or the lines in
    order if they have no names.
    """
    path = folder / "calib.txt"
    if not path.is_file():
        raise UsageError(f"{folder} has no calib.txt: give the sequence's own, with P0 and P1")

    matrices: dict[int, Floats] = {}
    for line in numbered_lines(path, GIVE):
        if not line.text.strip():
            continue
        name, colon, values = line.text.rpartition(":")
        named = re.fullmatch(r"P(\d)", name.strip())
        if colon and not named:
            continue  # `Tr`, to the laser
        camera = int(named[1]) if named else len(matrices)
        matrices[camera] = _numbers(line, values, MATRIX)
    return matrices


def _numbers(line: Line, text: str, expected: str) -> Floats:
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        raise line.wrong(expected) from None
    if values.shape != (12,) or not np.isfinite(values).all():
        raise line.wrong(expected)
    return values.reshape(3, 4)


def _calibration(
    folder: Path, left: Floats, right: Floats, width_px: int, height_px: int
) -> Calibration:
    fx_px = float(left[0, 0])
    fy_px = float(left[1, 1])
    # A matrix's last column is the focal length times how far its camera stands to the left.
    baseline_m = float(left[0, 3] - right[0, 3]) / fx_px if fx_px > 0 else 0.0
    is_alike = bool(np.allclose(left[:, :3], right[:, :3], rtol=MAX_FOCAL_DIFFERENCE, atol=1e-6))
    if not (is_alike and baseline_m > 0 and fy_px > 0):
        raise UsageError(
            f"{folder / 'calib.txt'}: its matrices are not of two rectified cameras, the second to "
            "the right of the first: give P0 and P1 of rectified pictures"
        )
    return Calibration(
        width_px=width_px,
        height_px=height_px,
        fx_px=fx_px,
        fy_px=fy_px,
        cx_px=float(left[0, 2]),
        cy_px=float(left[1, 2]),
        baseline_m=baseline_m,
        mount_height_m=MOUNT_HEIGHT_M,
    )


def _pictures(folder: Path, layout: _Layout) -> tuple[list[int], list[Path], list[Path]]:
    """Return the numbers of the pairs in order, and where the left and right picture of each is, or
    should be.
    """
    names: dict[int, str] = {}
    for side in (layout.left, layout.right):
        for path in (folder / side).glob("*.png"):
            number = number_of(path.stem)
            if number is None:
                raise UsageError(
                    f"{path}: the names of a KITTI sequence's pictures are numbers, such as "
                    "000000.png: rename it, or take it away"
                )
            names[number] = path.name

    numbers = sorted(names)
    left = [folder / layout.left / names[number] for number in numbers]
    right = [folder / layout.right / names[number] for number in numbers]
    return numbers, left, right


def _stamps_ns(folder: Path, numbers: list[int]) -> Indices:
    path = folder / "times.txt"
    if not path.is_file():
        return checked_stamps(np.array(numbers, np.int64) * INTERVAL_NS, folder)

    times_ns = [time_ns_of(line) for line in numbered_lines(path, GIVE)]
    _check_enough(path, len(times_ns), numbers)
    stamps_ns = np.array(times_ns, np.int64)[numbers]
    return checked_stamps(stamps_ns, path)


def _true_poses(folder: Path, numbers: list[int]) -> Floats | None:
    """Return the poses in the plane, (n, 3), relative to the first; None if there are none."""
    elsewhere = folder.resolve().parent.parent / "poses" / f"{folder.resolve().name}.txt"
    paths = [path for path in (folder / "poses.txt", elsewhere) if path.is_file()]
    if not paths:
        return None

    lines = [line for line in numbered_lines(paths[0], GIVE) if line.text.strip()]
    _check_enough(paths[0], len(lines), numbers)
    matrices = np.stack([_numbers(line, line.text, POSE) for line in lines])[numbers]

    # Cameras look along z, with x right: the frame of the first one is turned to x forward, y left.
    rotation = matrices[0, :, :3]
    position_m = (matrices[:, :, 3] - matrices[0, :, 3]) @ rotation
    optical_axis = matrices[:, :, 2] @ rotation
    heading_rad = np.unwrap(np.arctan2(-optical_axis[:, 0], optical_axis[:, 2]))
    return np.column_stack([position_m[:, 2], -position_m[:, 0], heading_rad])


def _check_enough(path: Path, lines: int, numbers: list[int]) -> None:
    if lines <= numbers[-1]:
        raise UsageError(
            f"{path} has {lines} lines, but there is a picture {numbers[-1]}, counted from 0: give "
            "the file of this sequence, all of it"
        )
