"""Pictures of a stereo camera as stereo frames."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from functools import cached_property
from operator import attrgetter
from pathlib import Path

from cogmap.data.bags.odometry import Motions
from cogmap.data.bags.order import NS_PER_S
from cogmap.data.euroc import read_euroc
from cogmap.data.image_folder import read_images
from cogmap.data.kitti import read_kitti
from cogmap.data.stereo_recording import StereoPairs
from cogmap.runtime.config import Sections
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Odometry, Pose, StereoFrame, TrueTown
from cogmap.services.player.config import Config
from cogmap.services.player.recording import LEAD_NS, poses_of

_stamp_of = attrgetter("stamp_ns")
BY_VIEWS: Sections = {"sensory": {"self_motion": "views"}}
"""Nobody measured how wheels turned."""


class StereoFrames:
    """The frames of a camera, and `motions` of the wheels that end at each of them, if these were
    recorded.
    """

    def __init__(
        self,
        recorded: StereoPairs,
        motions: Motions | None = None,
        notes: Sequence[str] = (),
    ) -> None:
        self.settings = BY_VIEWS if motions is None else {}
        self.notes = notes
        self._recorded = recorded
        self._odometry = [] if motions is None else _odometry(motions, self._offset_ns)

    @cached_property
    def stamps_ns(self) -> list[int]:
        """Return the time of each frame."""
        stamps_ns: list[int] = (self._recorded.stamps_ns - self._offset_ns).tolist()
        return stamps_ns

    @cached_property
    def true_poses(self) -> list[Pose | None]:
        """Return where the camera's robot really was at each frame."""
        poses = self._recorded.true_poses
        if poses is None:
            return [None] * len(self.stamps_ns)

        return poses_of(poses)

    @property
    def _offset_ns(self) -> int:
        """Return by how much the recording's clock is ahead of the run's."""
        return int(self._recorded.stamps_ns[0]) - LEAD_NS

    def before(self, number: int) -> list[Message]:
        """Return how the wheels moved until a frame, as far as that was recorded."""
        after_ns = self.stamps_ns[number - 1] if number else -1
        first = bisect_right(self._odometry, after_ns, key=_stamp_of)
        end = bisect_right(self._odometry, self.stamps_ns[number], key=_stamp_of)
        return list(self._odometry[first:end])

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


def _odometry(motions: Motions, offset_ns: int) -> list[Odometry]:
    """Return motions as messages, from the beginning of the run on."""
    ends_ns = motions.stamps_ns - offset_ns
    moved = []
    for stamp_ns, row in zip(ends_ns.tolist(), motions.rows.tolist(), strict=True):
        speed_m_s, turn_rate_rad_s, dt_s = row
        if stamp_ns > 0:
            moved.append(
                Odometry(
                    stamp_ns=stamp_ns,
                    speed_m_s=speed_m_s,
                    turn_rate_rad_s=turn_rate_rad_s,
                    dt_s=min(dt_s, stamp_ns / NS_PER_S),
                )
            )
    return moved


def euroc(folder: Path, config: Config) -> StereoFrames:
    """Open a EuRoC sequence. Raises UsageError."""
    return StereoFrames(read_euroc(folder))


def images(folder: Path, config: Config) -> StereoFrames:
    """Open a folder of images. Raises UsageError."""
    return StereoFrames(read_images(folder))


def kitti(folder: Path, config: Config) -> StereoFrames:
    """Open a KITTI sequence. Raises UsageError."""
    return StereoFrames(read_kitti(folder))
