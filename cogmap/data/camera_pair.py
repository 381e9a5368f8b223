"""Two cameras as they were calibrated, and their pictures rectified to those of a parallel pair."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from cogmap.data.stereo_recording import StereoRecording
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Bytes, Floats, Singles
from cogmap.schemas.sensing import Calibration

Maps = tuple[Singles, Singles]


class Camera(NamedTuple):
    """A pinhole camera: its matrix (3, 3), in pixels, OpenCV's distortion k1, k2, p1, p2 and maybe
    k3, the size of its pictures, and its pose on the robot's body, (4, 4).
    """

    matrix: Floats
    distortion: Floats
    width_px: int
    height_px: int
    on_body: Floats


class RectifiedPair(NamedTuple):
    """Where each pixel of the rectified pictures comes from, their `calibration`, and the pose of
    the left camera then, (4, 4) on the robot's body.
    """

    left: Maps
    right: Maps
    calibration: Calibration
    on_body: Floats


@dataclass(frozen=True)
class RectifiedRecording(StereoRecording):
    """The pairs of two cameras of which each has lenses and a mount of its own."""

    maps: tuple[Maps, Maps]

    def pair(self, number: int) -> tuple[Bytes, Bytes]:
        """Return a pair, rectified. Raises UsageError as StereoRecording does."""
        left, right = super().pair(number)
        return remapped(left, self.maps[0]), remapped(right, self.maps[1])


def rectified(left: Camera, right: Camera, mount_height_m: float, source: Path) -> RectifiedPair:
    """Rectify the pictures of two cameras so that they show nothing that is outside of them.

    Raises UsageError if their pictures are of other sizes, or the right camera does not stand to
    the right of the left one.
    """
    size_px = (left.width_px, left.height_px)
    if size_px != (right.width_px, right.height_px):
        raise UsageError(
            f"{source}: the left camera's pictures are {left.width_px} x {left.height_px}, the "
            f"right one's {right.width_px} x {right.height_px}: give those of two cameras alike"
        )

    to_right = np.linalg.inv(right.on_body) @ left.on_body
    left_turn, right_turn, seen_left, seen_right, *_ = cv2.stereoRectify(
        left.matrix,
        left.distortion,
        right.matrix,
        right.distortion,
        size_px,
        np.ascontiguousarray(to_right[:3, :3]),
        np.ascontiguousarray(to_right[:3, 3:]),
        alpha=0,
    )
    baseline_m = -float(seen_right[0, 3] / seen_right[0, 0])
    if not baseline_m > 0:
        raise UsageError(
            f"{source}: the second camera does not stand to the right of the first: give the left "
            "one as the first, and both poses on one body"
        )

    on_body = left.on_body.copy()
    on_body[:3, :3] = left.on_body[:3, :3] @ left_turn.T
    calibration = Calibration(
        width_px=left.width_px,
        height_px=left.height_px,
        fx_px=float(seen_left[0, 0]),
        fy_px=float(seen_left[1, 1]),
        cx_px=float(seen_left[0, 2]),
        cy_px=float(seen_left[1, 2]),
        baseline_m=baseline_m,
        mount_height_m=mount_height_m,
    )
    return RectifiedPair(
        left=maps_of(left, np.asarray(left_turn, np.float64), np.asarray(seen_left, np.float64)),
        right=maps_of(
            right, np.asarray(right_turn, np.float64), np.asarray(seen_right, np.float64)
        ),
        calibration=calibration,
        on_body=on_body,
    )


def maps_of(camera: Camera, turn: Floats, seen: Floats) -> Maps:
    """Return where each pixel comes from, of a camera that is turned and sees by another matrix."""
    columns, rows = cv2.initUndistortRectifyMap(
        camera.matrix,
        camera.distortion,
        turn,
        seen[:, :3],
        (camera.width_px, camera.height_px),
        cv2.CV_32FC1,
    )
    return np.asarray(columns, np.float32), np.asarray(rows, np.float32)


def remapped(image: Bytes, maps: Maps) -> Bytes:
    """Return an image of the pixels that the maps name, of the same size."""
    columns, rows = maps
    return np.asarray(cv2.remap(image, columns, rows, cv2.INTER_LINEAR), np.uint8)
