"""EuRoC folders: two cameras on a drone, or on whatever else was recorded in their files (Burri and
others 2016, "The EuRoC micro aerial vehicle datasets", doi 10.1177/0278364915620033).

`mav0/cam0` and `mav0/cam1` have `sensor.yaml`, with intrinsics, radial-tangential distortion and
the camera's pose on the body, T_BS, and `data.csv`, a stamp in ns and a picture of `data` a line.
True poses of the body are in `mav0/state_groundtruth_estimate0`, if there are any.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from cogmap.data.camera_pair import Camera, RectifiedRecording, rectified
from cogmap.data.stereo_recording import StereoRecording, checked_stamps
from cogmap.data.text import (
    NS_PER_S,
    Line,
    cells_of,
    number_of,
    numbered_lines,
    read_bytes,
)
from cogmap.data.true_path import poses_at
from cogmap.errors import UsageError
from cogmap.files.yaml import parsed
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import transform_to

GIVE = "the folder of a EuRoC sequence, with mav0 in it"
MAX_YAML_CHARACTERS = 20_000
TRUTH = "a stamp in ns, a position and a quaternion w, x, y, z"
MOUNT_HEIGHT_M = 1.0
"""The files do not say how high above the ground the cameras are: as high as a hand holds them."""


def read_euroc(folder: Path) -> StereoRecording:
    """Return the sequence in `folder`, its pairs rectified. A stamp of the left camera without a
    picture of the right one keeps its place.

    Raises UsageError if there is no calibration, or it is of another model; no pair, or left and
    right are of other sizes; if stamps go back; or naming the line that is wrong.
    """
    root = folder / "mav0" if (folder / "mav0").is_dir() else folder
    if not (root / "cam0").is_dir() or not (root / "cam1").is_dir():
        raise UsageError(f"{folder} has no mav0/cam0 and mav0/cam1: give {GIVE}")

    pair = rectified(_camera(root / "cam0"), _camera(root / "cam1"), MOUNT_HEIGHT_M, root)
    left = _pictures(root / "cam0")
    right = _pictures(root / "cam1")
    stamps_ns = checked_stamps(np.array(list(left), np.int64), root / "cam0" / "data.csv")
    missing = root / "cam1" / "data"
    return RectifiedRecording(
        name=folder.resolve().name,
        calibration=pair.calibration,
        stamps_ns=stamps_ns,
        true_poses=_true_poses(root, stamps_ns, pair.on_body),
        left=list(left.values()),
        right=[right.get(each, missing / f"{each}.png") for each in left],
        maps=(pair.left, pair.right),
    )


def _camera(folder: Path) -> Camera:
    """Read a sensor.yaml. Raises UsageError."""
    path = folder / "sensor.yaml"
    if not path.is_file():
        raise UsageError(f"{folder} has no sensor.yaml, its calibration: give {GIVE}")

    sensor = _yaml(path)
    for key, model in (("camera_model", "pinhole"), ("distortion_model", "radial-tangential")):
        if sensor.get(key, model) not in {model, "radtan"}:
            raise UsageError(
                f"{path}: its {key} is {sensor[key]!r}, and {model} cameras are read: rectify the "
                "pictures, and give them as a folder of images"
            )

    fx_px, fy_px, cx_px, cy_px = _values(path, sensor, "intrinsics", 4)
    width_px, height_px = _values(path, sensor, "resolution", 2).astype(int).tolist()
    pose = sensor.get("T_BS")
    values = pose if isinstance(pose, dict) else {}
    return Camera(
        matrix=np.array([[fx_px, 0.0, cx_px], [0.0, fy_px, cy_px], [0.0, 0.0, 1.0]]),
        distortion=_values(path, sensor, "distortion_coefficients", 4),
        width_px=width_px,
        height_px=height_px,
        on_body=_values(path, {"T_BS": values.get("data")}, "T_BS", 16).reshape(4, 4),
    )


def _yaml(path: Path) -> dict[str, Any]:
    """Read a mapping, without OpenCV's first line `%YAML:1.0`. Raises UsageError."""
    text = read_bytes(path, GIVE).decode("utf-8", "replace")
    if len(text) > MAX_YAML_CHARACTERS or "&" in text:
        raise UsageError(
            f"{path} has more than {MAX_YAML_CHARACTERS} characters, or names parts by &: "
            f"no calibration does, give {GIVE}"
        )
    lines = [line for line in text.splitlines() if not line.startswith("%YAML")]
    try:
        read = parsed("\n".join(lines))
    except (yaml.YAMLError, ValueError) as error:
        words = " ".join(str(error).split())
        raise UsageError(f"{path} is no YAML ({words}): give {GIVE}") from None
    return read if isinstance(read, dict) else {}


def _values(path: Path, sensor: dict[str, Any], key: str, number: int) -> Floats:
    """Return the numbers of a key. Raises UsageError if they are not so many."""
    try:
        values = np.array(sensor.get(key), np.float64).ravel()
    except (TypeError, ValueError):
        values = np.empty(0)
    if len(values) != number or not np.isfinite(values).all():
        raise UsageError(f"{path}: its {key} must be {number} numbers: give {GIVE}")
    return values


def _rows(path: Path) -> Iterator[tuple[Line, list[str]]]:
    """Yield the lines of a data.csv, and their cells. Raises UsageError."""
    for line in numbered_lines(path, GIVE):
        if line.text.strip() and not line.text.startswith("#"):
            yield line, [cell.strip() for cell in cells_of(line)]


def _pictures(folder: Path) -> dict[int, Path]:
    """Return the pictures of a camera by their stamps, as they stand. Raises UsageError."""
    pictures = {}
    for line, cells in _rows(folder / "data.csv"):
        stamp_ns = number_of(cells[0])
        if len(cells) < 2 or stamp_ns is None or not cells[1] or "\0" in cells[1]:
            raise line.wrong("a stamp in ns and the name of a picture")
        pictures[stamp_ns] = folder / "data" / cells[1]
    return pictures


def _true_poses(root: Path, stamps_ns: Indices, on_body: Floats) -> Floats | None:
    """Return where the camera was at (n,) stamps, (n, 3) in the plane from the first pose that is
    known on, NaN where nobody knows; None if there is no truth.
    """
    path = root / "state_groundtruth_estimate0" / "data.csv"
    if not path.is_file():
        return None

    first_ns = int(stamps_ns[0])
    rows = []
    for line, cells in _rows(path):
        try:
            since_s = (int(cells[0]) - first_ns) / NS_PER_S
            rows.append([since_s, *map(float, cells[1:8])])
        except (ValueError, IndexError):
            raise line.wrong(TRUTH) from None
        is_complete = len(rows[-1]) == 8 and np.isfinite(rows[-1]).all()
        if not is_complete or not any(rows[-1][4:]):
            raise line.wrong(TRUTH)
    if not rows:
        return None

    known_s, body_m, quaternions = np.split(np.array(sorted(rows)), [1, 4], axis=1)
    rotations = Rotation.from_quat(quaternions, scalar_first=True).as_matrix()
    camera_m = body_m + rotations @ on_body[:3, 3]
    optical_axis = rotations @ on_body[:3, 2]
    heading_rad = np.arctan2(optical_axis[:, 1], optical_axis[:, 0])

    truth = np.column_stack([known_s, camera_m[:, :2], heading_rad])
    poses = poses_at(truth, (stamps_ns - first_ns) / NS_PER_S)
    is_known = np.isfinite(poses[:, 0])
    if not is_known.any():
        return None

    first = poses[is_known.argmax()]
    positions_m = transform_to(first, poses[:, :2])
    return np.column_stack([positions_m, poses[:, 2] - first[2]])
