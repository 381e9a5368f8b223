"""What sensor_msgs/CameraInfo says of two cameras, as the calibration of a pair."""

from __future__ import annotations

from typing import Any, NamedTuple

import cv2
import msgspec
import numpy as np

from cogmap.data.bags.mount import Mount
from cogmap.data.camera_pair import Camera, Maps, maps_of, remapped
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Bytes, Floats
from cogmap.schemas.sensing import Calibration

MODELS = ("", "plumb_bob", "rational_polynomial")
"""Distortions as OpenCV has them; an empty name is that of images without any."""

NUMBERS = 5
"""How many numbers of a distortion our calibration has."""

CALIBRATE = "calibrate both cameras together, as camera_calibration does"
NOWHERE = np.eye(4)

RECTIFIED = "image_rect"
"""In the name of a topic: its images are rectified, as image_proc does it."""

HEIGHT_M = 1.0
"""How high cameras stand of which nothing says it: as high as a hand holds them."""


class CameraInfo(NamedTuple):
    """A camera: its matrix (3, 3), distortion, the turn that rectifies it (3, 3), and how the
    rectified camera sees, (3, 4). `frame` is where it stands.
    """

    frame: str
    width_px: int
    height_px: int
    model: str
    matrix: Floats
    distortion: Floats
    turn: Floats
    seen: Floats

    @property
    def baseline_m(self) -> float:
        """Return how far to the right of the first camera this one stands; 0 if that is unknown."""
        focal_px = float(self.seen[0, 0])
        return -float(self.seen[0, 3]) / focal_px if focal_px else 0.0


class Pair(NamedTuple):
    """The calibration of a pair, and maps that rectify its images, None where sensory memory can do
    that by the calibration.
    """

    calibration: Calibration
    maps: tuple[Maps, Maps] | None

    def undistorted(self, left: Bytes, right: Bytes) -> tuple[Bytes, Bytes]:
        """Return the images, rectified if the calibration does not say how."""
        if self.maps is None:
            return left, right
        return remapped(left, self.maps[0]), remapped(right, self.maps[1])


def check_size(image: Bytes, calibration: Calibration, name: str) -> None:
    """Raise UsageError if an image, called `name`, is not of the calibration's size."""
    size = (calibration.height_px, calibration.width_px)
    if image.shape[:2] != size:
        raise UsageError(
            f"{name} is {image.shape[1]} x {image.shape[0]}, its CameraInfo says {size[1]} x "
            f"{size[0]}: give the calibration of these images"
        )


def mounted(mount: Mount, height_m: float) -> dict[str, float]:
    """Return where the left camera stands, as Calibration names that; `height_m` is 0 where the
    mount says it.
    """
    return {
        "mount_height_m": height_m or max(float(mount.place_m[2]), 0.0) or HEIGHT_M,
        "mount_forward_m": float(mount.place_m[0]),
    }


def camera_of(info: Any) -> CameraInfo:
    """Return what a message says; names of its fields are capitals in ROS 1."""

    def values(name: str) -> Floats:
        found = getattr(info, name, None)
        return np.asarray(getattr(info, name.upper()) if found is None else found, np.float64)

    return CameraInfo(
        frame=info.header.frame_id,
        width_px=int(info.width),
        height_px=int(info.height),
        model=info.distortion_model,
        matrix=values("k").reshape(3, 3),
        distortion=values("d"),
        turn=values("r").reshape(3, 3),
        seen=values("p").reshape(3, 4),
    )


def pair_of(
    left: CameraInfo, right: CameraInfo, is_rectified: bool, mount: dict[str, float], source: str
) -> Pair:
    """Return the calibration of two cameras on a `mount`, as Calibration names that.

    `is_rectified` says that the images are, whatever distortion the cameras have. Raises UsageError
    if the cameras have not been calibrated together, or have a distortion of another model.
    """
    size_px = (left.width_px, left.height_px)
    if size_px != (right.width_px, right.height_px):
        raise UsageError(
            f"{source}: the left camera's images are {left.width_px} x {left.height_px}, the "
            f"right one's {right.width_px} x {right.height_px}: give those of two cameras alike"
        )
    if not right.baseline_m > 0:
        raise UsageError(
            f"{source}: the right camera's P[3] is {right.seen[0, 3]:g}, by which it does not "
            f"stand to the right of the left one: {CALIBRATE}"
        )

    described = {} if is_rectified else _described(left, right)
    maps = None
    if described is None:
        maps = (_maps(left, left.seen, source), _maps(right, left.seen, source))

    seen = left.seen
    given = {
        "width_px": left.width_px,
        "height_px": left.height_px,
        "fx_px": seen[0, 0].item(),
        "fy_px": seen[1, 1].item(),
        "cx_px": seen[0, 2].item(),
        "cy_px": seen[1, 2].item(),
        "baseline_m": right.baseline_m,
        **mount,
        **(described or {}),
    }
    try:
        return Pair(msgspec.convert(given, Calibration), maps)
    except msgspec.ValidationError as error:
        raise UsageError(
            f"{source}: its CameraInfo is no camera's ({error}): {CALIBRATE}"
        ) from None


def _described(left: CameraInfo, right: CameraInfo) -> dict[str, Any] | None:
    """Return what our calibration says of the lenses and of how the right camera is turned, where
    it can: both cameras have one matrix, rectified or not, and the left one is not turned.
    """
    one = left.matrix
    matrices = (right.matrix, left.seen[:, :3], right.seen[:, :3])
    is_one = all(np.allclose(one, other) for other in matrices)
    is_level = np.allclose(left.turn, np.eye(3))
    is_known = all(each.model in MODELS for each in (left, right))
    is_short = all(len(each.distortion) <= NUMBERS for each in (left, right))
    if not (is_one and is_level and is_known and is_short):
        return None

    turn_rad, _ = cv2.Rodrigues(right.turn)
    return {
        "right_rotation_rad": tuple(np.asarray(turn_rad).ravel().tolist()),
        "left_distortion": _numbers(left),
        "right_distortion": _numbers(right),
    }


def _numbers(camera: CameraInfo) -> tuple[float, ...]:
    missing = NUMBERS - len(camera.distortion)
    return tuple(np.pad(camera.distortion, (0, missing)).tolist())


def _maps(camera: CameraInfo, seen: Floats, source: str) -> Maps:
    """Return where each pixel of a rectified image comes from."""
    if camera.model not in MODELS:
        raise UsageError(
            f"{source}: the distortion model {camera.model!r} is none of {', '.join(MODELS[1:])}: "
            "record rectified images (image_rect)"
        )
    given = Camera(
        matrix=camera.matrix,
        distortion=camera.distortion,
        width_px=camera.width_px,
        height_px=camera.height_px,
        on_body=NOWHERE,
    )
    return maps_of(given, camera.turn, seen)
