"""Pictures of a stereo camera as stereo frames."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

import cv2
import numpy as np

from cogmap.data.euroc import read_euroc
from cogmap.data.image_folder import read_images
from cogmap.data.kitti import read_kitti
from cogmap.data.stereo_recording import StereoRecording
from cogmap.geometry.arrays import Bytes
from cogmap.runtime.config import Sections
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Pose, StereoFrame, TrueTown
from cogmap.services.player.config import Config
from cogmap.services.player.recording import LEAD_NS, poses_of


class StereoFrames:
    """The frames of a camera without wheels."""

    def __init__(self, recorded: StereoRecording) -> None:
        self.settings: Sections = {}
        self._recorded = recorded

    @cached_property
    def stamps_ns(self) -> list[int]:
        """Return the time of each frame."""
        stamps_ns = self._recorded.stamps_ns
        since_first_ns: list[int] = (stamps_ns - stamps_ns[0]).tolist()
        return [LEAD_NS + each_ns for each_ns in since_first_ns]

    @cached_property
    def true_poses(self) -> list[Pose | None]:
        """Return where the camera's robot really was at each frame."""
        poses = self._recorded.true_poses
        if poses is None:
            return [None] * len(self._recorded)

        return poses_of(poses)

    def before(self, number: int) -> list[Message]:
        """Return nothing: all that was sensed are pictures."""
        return []

    def view(self, number: int) -> list[Message]:
        """Return a frame. Raises UsageError if a picture of it is broken."""
        left, right = self._recorded.pair(number)
        frame = StereoFrame(
            stamp_ns=self.stamps_ns[number],
            frame=number,
            left=Array.of(_in_colour(left)),
            right=Array.of(_in_colour(right)),
            calibration=self._recorded.calibration,
        )
        return [frame]

    def town(self) -> TrueTown | None:
        """Return nothing: nobody surveyed what stood there."""
        return None


def euroc(folder: Path, config: Config) -> StereoFrames:
    """Open a EuRoC sequence. Raises UsageError."""
    return StereoFrames(read_euroc(folder))


def images(folder: Path, config: Config) -> StereoFrames:
    """Open a folder of images. Raises UsageError."""
    return StereoFrames(read_images(folder))


def kitti(folder: Path, config: Config) -> StereoFrames:
    """Open a KITTI sequence. Raises UsageError."""
    return StereoFrames(read_kitti(folder))


def _in_colour(image: Bytes) -> Bytes:
    """Return a picture as RGB, (h, w, 3)."""
    if image.ndim == 3:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB), np.uint8)
