"""Reads the renderings that `cogmap train render` wrote."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from cogmap.errors import UsageError
from cogmap.files.packed import read_arrays
from cogmap.geometry.arrays import Bytes, Floats, Singles
from cogmap.schemas.sensing import Calibration

# What a pixel of `surface` shows: a row of this.
SURFACES = ("sky", "ground", "road", "building", "prop")
# Names of buildings that are in no catalogue begin with it.
INVENTED = "invented-"
ARRAYS = ("left", "stereo_m", "depth_m", "label", "surface", "pose", "place_m", "size_m")


@dataclass(frozen=True, eq=False)
class Town:
    """All views of one town: `left` uint8 (n, h, w, 3), `stereo_m` and `depth_m` float32 (n, h, w),
    `label` and `surface` uint8 (n, h, w), `pose` float64 (n, 3); `names` of its buildings,
    `place_m` (k, 2), `size_m` (k, 3). See training/rendering/towns.py.
    """

    left: Bytes
    stereo_m: Singles
    depth_m: Singles
    label: Bytes
    surface: Bytes
    pose: Floats
    names: tuple[str, ...]
    place_m: Floats
    size_m: Floats
    calibration: Calibration


def read(path: Path) -> Town:
    """Return the town in the file at `path`. Raises UsageError if it does not hold one."""
    try:
        stored = read_arrays(path)
        calibration = msgspec.json.decode(stored["calibration"].tobytes(), type=Calibration)
        arrays: dict[str, Any] = {key: stored[key] for key in ARRAYS}
        names = tuple(str(name) for name in stored["names"])
        return Town(**arrays, names=names, calibration=calibration)
    except (UsageError, KeyError, msgspec.DecodeError) as error:
        raise UsageError(
            f"{path} holds no renderings ({error}): write them with cogmap train render"
        ) from None


def files(folder: Path, split: str) -> list[Path]:
    """Return the files of one split, by seed. Raises UsageError if there are none."""
    found = sorted((folder / split).glob("town-*.npz"))
    if not found:
        raise UsageError(f"no town-*.npz in {folder / split}: write them with cogmap train render")
    return found


def towns(folder: Path, split: str) -> Iterator[Town]:
    """Return the towns of one split, by seed. Raises UsageError if there are none."""
    return (read(path) for path in files(folder, split))
