"""Folders of pictures that a user took with a stereo camera, with a file that describes it.

`left` and `right` have the pictures; those of one name are a pair, in the order of the numbers in
their names. `camera.toml` has the keys of CameraFile:

    rate_hz = 10.0             # pairs a second, where there is no times.txt
    fx_px = 458.6              # the left camera's focal lengths and centre, which the right one
    fy_px = 457.3              # shares, in pixels
    cx_px = 367.2
    cy_px = 248.4
    baseline_m = 0.11          # how far to the right of the left camera the right one stands
    mount_height_m = 1.2       # how high above the ground the left one stands
    left_distortion = [-0.28, 0.07, 0.0, 0.0, 0.0]      # OpenCV's k1, k2, p1, p2, k3
    right_distortion = [-0.28, 0.07, 0.0, 0.0, 0.0]
    right_rotation_rad = [0.0, 0.0, 0.0]                # rotation vector, in the left one's frame

`times.txt` has the time of each pair in seconds, one a line, if it is there.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np

from cogmap.data.stereo_recording import StereoRecording, checked_stamps, pair_size_px
from cogmap.data.text import NS_PER_S, numbered_lines, read_bytes, time_ns_of
from cogmap.errors import UsageError
from cogmap.files.toml import parsed
from cogmap.geometry.arrays import Indices
from cogmap.schemas.base import Finite, Metres
from cogmap.schemas.sensing import Calibration

GIVE = "a folder with left, right and camera.toml"
CAMERA = "camera.toml"
SUFFIXES = (".png", ".jpg", ".jpeg", ".pgm", ".bmp", ".tif", ".tiff")

Pixels = Annotated[float, msgspec.Meta(gt=0, le=1e5)]
Distortion = tuple[Finite, Finite, Finite, Finite, Finite]
NO_DISTORTION = (0.0, 0.0, 0.0, 0.0, 0.0)


class CameraFile(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """What `camera.toml` says, as Calibration has it; the size is that of the pictures."""

    fx_px: Pixels
    fy_px: Pixels
    cx_px: Pixels
    cy_px: Pixels
    baseline_m: Annotated[float, msgspec.Meta(gt=0, le=10)]
    mount_height_m: Metres
    mount_forward_m: Finite = 0.0
    right_rotation_rad: tuple[Finite, Finite, Finite] = (0.0, 0.0, 0.0)
    left_distortion: Distortion = NO_DISTORTION
    right_distortion: Distortion = NO_DISTORTION
    rate_hz: Annotated[float, msgspec.Meta(gt=0, le=1000)] | None = None


def read_images(folder: Path) -> StereoRecording:
    """Return the pairs of a folder. A pair of which one picture is missing keeps its place.

    Raises UsageError if there is no calibration or it is wrong, no pair, or left and right are of
    other sizes; or if stamps go back.
    """
    for name in ("left", "right"):
        if not (folder / name).is_dir():
            raise UsageError(f"{folder} has no folder {name} with pictures: give {GIVE}")

    camera = _camera(folder / CAMERA)
    left = _pictures(folder / "left")
    right = _pictures(folder / "right")
    names = sorted(left.keys() | right.keys(), key=_in_order)
    paths = []
    for name in names:
        file_name = (left.get(name) or right[name]).name
        missing = (folder / "left" / file_name, folder / "right" / file_name)
        paths.append((left.get(name, missing[0]), right.get(name, missing[1])))
    width_px, height_px = pair_size_px(paths, folder, GIVE)
    described = msgspec.structs.asdict(camera)
    del described["rate_hz"]
    return StereoRecording(
        name=folder.resolve().name,
        calibration=Calibration(width_px=width_px, height_px=height_px, **described),
        stamps_ns=_stamps_ns(folder, len(names), camera.rate_hz),
        true_poses=None,
        left=[path for path, _ in paths],
        right=[path for _, path in paths],
    )


def _camera(path: Path) -> CameraFile:
    if not path.is_file():
        raise UsageError(
            f"{path.parent} has no {CAMERA}, its calibration: write one with fx_px, fy_px, cx_px, "
            "cy_px, baseline_m, mount_height_m and rate_hz, as docs/real.md has it"
        )
    try:
        written = parsed(read_bytes(path, GIVE).decode("utf-8", "replace"))
        return msgspec.convert(written, CameraFile)
    except tomllib.TOMLDecodeError as error:
        raise UsageError(f"{path} is no TOML ({error}): correct that line") from None
    except msgspec.ValidationError as error:
        raise UsageError(f"{path}: {error}: correct it") from None


def _pictures(folder: Path) -> dict[str, Path]:
    """Return the pictures of a folder by their names without a suffix."""
    paths = sorted(folder.iterdir())
    return {path.stem: path for path in paths if path.suffix.lower() in SUFFIXES}


def _in_order(name: str) -> list[tuple[int, str]]:
    """Return the key by which names are ordered: numbers in them count as such."""
    parts = re.split(r"(\d+)", name)
    return [(int(part), "") if part.isdecimal() else (0, part) for part in parts]


def _stamps_ns(folder: Path, pairs: int, rate_hz: float | None) -> Indices:
    """Return the times of the pairs, by `times.txt` or their rate. Raises UsageError."""
    path = folder / "times.txt"
    if not path.is_file():
        if rate_hz is None:
            raise UsageError(
                f"{folder} has neither times.txt nor a rate_hz in {CAMERA}: say how many pairs "
                "came a second"
            )
        return np.rint(np.arange(pairs) * NS_PER_S / rate_hz).astype(np.int64)

    times_ns = [time_ns_of(line) for line in numbered_lines(path, GIVE)]
    if len(times_ns) != pairs:
        raise UsageError(
            f"{path} has {len(times_ns)} lines for {pairs} pairs of pictures: give one for each"
        )
    return checked_stamps(np.array(times_ns, np.int64), path)
