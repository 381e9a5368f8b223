"""Pictures of a stereo camera as stereo frames."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

from cogmap.data.euroc import read_euroc
from cogmap.data.image_folder import read_images
from cogmap.data.kitti import read_kitti
from cogmap.data.stereo_recording import StereoRecording
from cogmap.runtime.config import Sections
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Pose, StereoFrame, TrueTown
from cogmap.services.player.config import Config
from cogmap.services.player.recording import LEAD_NS, poses_of

BY_VIEWS: Sections = {"sensory": {"self_motion": "views"}}
"""Nobody measured how wheels turned."""


class StereoFrames:
    """The frames of a camera without wheels."""

    def __init__(self, recorded: StereoRecording) -> None:
        self.settings = BY_VIEWS
        self.notes: list[str] = []
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
            left=Array.of(left),
            right=Array.of(right),
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
