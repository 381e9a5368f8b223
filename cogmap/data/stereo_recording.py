"""A stereo camera's recording in files: its calibration, and a pair of pictures for each stamp."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from cogmap.data.text import read_bytes
from cogmap.errors import UsageError
from cogmap.files.pictures import decoded
from cogmap.geometry.arrays import Bytes, Floats, Indices
from cogmap.schemas.sensing import Calibration

GIVE = "the picture that the camera took"
REMEDY = "copy it again, or leave this pair out"


class StereoPairs(Protocol):
    """The pairs of a camera, in order of time, wherever they are: see StereoRecording."""

    @property
    def calibration(self) -> Calibration:
        """Return the calibration of the pairs."""

    @property
    def stamps_ns(self) -> Indices:
        """Return the stamp of each pair, int64 (n,), of one clock."""

    @property
    def true_poses(self) -> Floats | None:
        """Return where the left camera really was, None if nobody measured it."""

    def pair(self, number: int) -> tuple[Bytes, Bytes]:
        """Return the left and the right picture of a pair, each uint8 (h, w), or RGB (h, w, 3).
        Raises UsageError if it cannot be read.
        """


@dataclass(frozen=True)
class StereoRecording:
    """The pairs of a camera, in order of time.

    `stamps_ns`: int64 (n,), of one clock. `true_poses`: float64 (n, 3), x_m forward, y_m left and
    heading_rad of the left camera in the plane, from the first pose on; None if nobody measured
    them. They are for evaluation only. `left` and `right` are n files each.
    """

    name: str
    calibration: Calibration
    stamps_ns: Indices
    true_poses: Floats | None
    left: list[Path]
    right: list[Path]

    def __len__(self) -> int:
        """Return how many pairs it has."""
        return len(self.stamps_ns)

    def pair(self, number: int) -> tuple[Bytes, Bytes]:
        """Return the left and the right picture of a pair, each uint8 (h, w), or RGB (h, w, 3).

        Raises UsageError if one of them is missing, broken or not of the calibration's size.
        """
        size = (self.calibration.height_px, self.calibration.width_px)
        pair = (picture(self.left[number]), picture(self.right[number]))
        for path, image in zip((self.left[number], self.right[number]), pair, strict=True):
            if image.shape[:2] != size:
                raise UsageError(
                    f"{path} is {image.shape[1]} x {image.shape[0]}, the camera's pictures are "
                    f"{size[1]} x {size[0]}: give every picture in one size, left and right"
                )
        return pair


def picture(path: Path) -> Bytes:
    """Return a picture, uint8 (h, w) if it is grey, else RGB (h, w, 3). Raises UsageError if it is
    missing or broken.
    """
    content = np.frombuffer(read_bytes(path, GIVE), np.uint8)
    image = decoded(content, str(path))
    if image is None:
        raise UsageError(f"{path} is no whole picture: {REMEDY}")
    return image


def pair_size_px(pairs: Iterable[tuple[Path, Path]], folder: Path, give: str) -> tuple[int, int]:
    """Return the width and height of the first pair of whole pictures.

    Raises UsageError, with the remedy to give `give`, if there is none, or its left and right are
    of other sizes.
    """
    for paths in pairs:
        try:
            sizes = [picture(path).shape[:2] for path in paths]
        except UsageError:
            continue  # a broken pair is an error when it is read, not before
        if sizes[0] != sizes[1]:
            shown = [f"{width} x {height}" for height, width in sizes]
            raise UsageError(
                f"{paths[0]} is {shown[0]}, {paths[1]} is {shown[1]}: give pictures of one size, "
                "left and right"
            )
        return sizes[0][1], sizes[0][0]
    raise UsageError(f"{folder} has no whole pair of pictures: give {give}, all of it")


def checked_stamps(stamps_ns: Indices, source: Path) -> Indices:
    """Return stamps, int64 (n,), of pairs. Raises UsageError if there is none, or one goes back."""
    if not len(stamps_ns):
        raise UsageError(f"{source} has no pair of pictures: give a recording with some")

    backwards = np.flatnonzero(np.diff(stamps_ns) <= 0)
    if backwards.size:
        number = int(backwards[0]) + 1
        raise UsageError(
            f"{source}: the stamp of pair {number} is not after that of the pair before: give "
            "stamps of one clock, in order of time"
        )
    return stamps_ns
