"""The renderings that `python -m training.rendering.dataset` wrote, as training reads them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import numpy.typing as npt

from cogmap.errors import UsageError
from schemas.sensing import Calibration

ARRAYS = ("left", "stereo_m", "depth_m", "label", "surface", "pose", "place_m", "size_m")


@dataclass(frozen=True, eq=False)
class Town:
    """All views of one town: `left` uint8 (n, h, w, 3), `stereo_m` and `depth_m` float32 (n, h, w),
    `label` and `surface` uint8 (n, h, w), `pose` float64 (n, 3); `names` of its buildings,
    `place_m` (k, 2), `size_m` (k, 3).
    """

    left: npt.NDArray[np.uint8]
    stereo_m: npt.NDArray[np.float32]
    depth_m: npt.NDArray[np.float32]
    label: npt.NDArray[np.uint8]
    surface: npt.NDArray[np.uint8]
    pose: npt.NDArray[np.float64]
    names: tuple[str, ...]
    place_m: npt.NDArray[np.float64]
    size_m: npt.NDArray[np.float64]
    calibration: Calibration


def read(path: Path) -> Town:
    """The town in one file. Raises UsageError where it does not hold any."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            calibration = msgspec.json.decode(stored["calibration"].tobytes(), type=Calibration)
            arrays = {key: stored[key] for key in ARRAYS}
            names = tuple(str(name) for name in stored["names"])
            return Town(**arrays, names=names, calibration=calibration)
    except (OSError, ValueError, KeyError, msgspec.DecodeError) as error:
        raise UsageError(
            f"{path} holds no renderings ({error}): write them with python -m training.rendering.dataset"
        ) from None


def files(folder: Path, split: str) -> list[Path]:
    """The files of one split. Raises UsageError where there are none."""
    found = sorted((folder / split).glob("town-*.npz"))
    if not found:
        raise UsageError(
            f"no town-*.npz in {folder / split}: write them with python -m training.rendering.dataset"
        )
    return found


def towns(folder: Path, split: str) -> Iterator[Town]:
    """The towns of one split, in order of their seeds."""
    return (read(path) for path in files(folder, split))
