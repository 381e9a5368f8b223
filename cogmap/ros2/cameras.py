"""Images and calibrations as they come, as stereo frames. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cogmap.data.bags.cameras import (
    RECTIFIED,
    CameraInfo,
    Pair,
    camera_of,
    check_size,
    mounted,
    pair_of,
)
from cogmap.data.bags.images import image_of
from cogmap.data.bags.mount import mount_by
from cogmap.data.bags.pairs import SAME_VIEW_NS
from cogmap.errors import UsageError
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import StereoFrame

LEFT, RIGHT = 0, 1
SIDES = (LEFT, RIGHT)

WAITING = 4
"""How many images of one side wait for the other: more are of a camera that is not triggered."""

GRACE_NS = 2_000_000_000
"""Time from the first image on in which the calibration may still come: some cameras say it once a
second.
"""


class StereoStream:
    """The pairs of two cameras, whose images come on `images` and calibrations on `infos`, left and
    right. `height_m` is that of the cameras above the ground, 0 where static transforms tell it.
    At most one pair in `period_ns` becomes a frame.
    """

    def __init__(
        self,
        images: tuple[str, str],
        infos: tuple[str, str],
        height_m: float,
        period_ns: int,
    ) -> None:
        self._images = images
        self._info_topics = infos
        self._height_m = height_m
        self._period_ns = period_ns
        self._infos: list[CameraInfo | None] = [None, None]
        self._waiting: tuple[dict[int, Any], dict[int, Any]] = ({}, {})
        self._camera: Pair | None = None
        self._next_ns = 0
        self._first_ns: int | None = None

    def on_info(self, side: int, info: Any) -> None:
        """Receive the calibration of a camera."""
        given = camera_of(info)
        if not _is_same(given, self._infos[side]):
            self._infos[side] = given
            self._camera = None

    def on_mount(self) -> None:
        """Take account of transforms that have changed."""
        self._camera = None

    def on_image(self, side: int, stamp_ns: int, image: Any) -> tuple[int, Any, Any] | None:
        """Receive an image. Returns the stamp of the left image and both, once both are there and
        one is due. Raises UsageError if one has waited for the other in vain.
        """
        own, other = self._waiting[side], self._waiting[1 - side]
        near_ns = min(other, key=lambda each_ns: abs(each_ns - stamp_ns), default=None)
        if near_ns is None or abs(near_ns - stamp_ns) > SAME_VIEW_NS:
            own[stamp_ns] = image
            if len(own) > WAITING:
                own.pop(min(own))
                raise UsageError(
                    f"an image of {self._images[side]} has no other one within "
                    f"{SAME_VIEW_NS / 1e6:g} ms on {self._images[1 - side]}: trigger both cameras "
                    "together, and stamp them by one clock"
                )
            return None

        partner = other[near_ns]
        for waiting in self._waiting:
            passed = [each_ns for each_ns in waiting if each_ns <= max(near_ns, stamp_ns)]
            for each_ns in passed:
                del waiting[each_ns]
        left_ns = stamp_ns if side == LEFT else near_ns
        if left_ns < self._next_ns or self._may_yet_come(left_ns):
            return None
        self._next_ns = left_ns + self._period_ns
        return (left_ns, image, partner) if side == LEFT else (left_ns, partner, image)

    def frame(
        self, number: int, stamp_ns: int, left: Any, right: Any, transforms: Mapping[str, Any]
    ) -> StereoFrame:
        """Make frame `number` of two images, where cameras stand as the static `transforms` say.
        Raises UsageError if they cannot be decoded, or there is no calibration that fits.
        """
        camera = self._camera or self._calibrated(transforms)
        self._camera = camera
        pictures = []
        for topic, message in zip(self._images, (left, right), strict=True):
            name = f"an image of {topic}"
            picture = image_of(message, name)
            check_size(picture, camera.calibration, name)
            pictures.append(picture)

        left_pixels, right_pixels = camera.undistorted(*pictures)
        return StereoFrame(
            stamp_ns=stamp_ns,
            frame=number,
            left=Array.of(left_pixels),
            right=Array.of(right_pixels),
            calibration=camera.calibration,
        )

    def _may_yet_come(self, stamp_ns: int) -> bool:
        """Return whether a calibration is missing that may still come."""
        if self._first_ns is None:
            self._first_ns = stamp_ns
        is_missing = any(info is None for info in self._infos)
        return is_missing and stamp_ns - self._first_ns < GRACE_NS

    def _calibrated(self, transforms: Mapping[str, Any]) -> Pair:
        left, right = self._infos
        if left is None or right is None:
            both = zip(self._info_topics, self._infos, strict=True)
            missing = [topic for topic, info in both if info is None]
            raise UsageError(
                f"nothing has come on {' and '.join(missing)} (sensor_msgs/msg/CameraInfo): "
                "publish the calibration beside the images"
            )
        is_rectified = all(RECTIFIED in name for name in self._images)
        mount = mounted(mount_by(transforms, left.frame), self._height_m)
        return pair_of(left, right, is_rectified, mount, " and ".join(self._info_topics))


def _is_same(one: CameraInfo, other: CameraInfo | None) -> bool:
    """Return whether two calibrations say the same."""
    if other is None:
        return False
    pairs: list[tuple[Any, Any]] = list(zip(one, other, strict=True))
    return all(np.array_equal(mine, theirs) for mine, theirs in pairs)
