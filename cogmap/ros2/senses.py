"""What a robot senses as messages of ours. Pure."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from cogmap.data.bags.mount import STATIC, TRANSFORMS, steps_of
from cogmap.data.bags.odometry import pose_of, speeds_of
from cogmap.data.bags.order import stamp_ns_of
from cogmap.data.bags.topics import CAMERA_INFO, LASER_SCAN
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats
from cogmap.recording.exporting.ros_drive import FRAMES, Frames
from cogmap.ros2.cameras import SIDES, StereoStream
from cogmap.ros2.encoders import Encoders, WheelJoints
from cogmap.ros2.graph import Chosen
from cogmap.ros2.lasers import ScanStream
from cogmap.ros2.rmw.keys import LATCHED, SENSOR, USUAL, Quality
from cogmap.ros2.stamps import Stamps
from cogmap.ros2.wheels import OdometryStream
from cogmap.schemas.base import Message
from cogmap.schemas.process import Playback

NUMBER = re.compile(r"\b\d[\d.]*\b")
"""What differs between reasons of one kind."""

Receive = Callable[[Any, int], list[Message]]
"""Receive a message of ROS at a monotonic time of the wall, in ns."""


class Wanted(NamedTuple):
    """A subscription, and what receives its messages."""

    topic: str
    kind: str
    quality: Quality
    receive: Receive


class Senses:
    """Turns the messages of `chosen` topics, with types as in `kinds`, into views and what was
    sensed between them. What cannot be used is left out: `skip` counts that.
    """

    def __init__(
        self,
        chosen: Chosen,
        kinds: Mapping[str, str],
        height_m: float,
        period_ns: int,
        joints: WheelJoints | None = None,
    ) -> None:
        self.stamps = Stamps()
        self.odometry: OdometryStream | None = None
        if chosen.odometry:
            self.odometry = OdometryStream(chosen.odometry, kinds[chosen.odometry])
        # A frame of odometry is the robot's own if nobody publishes another one.
        self.frames = FRAMES._replace(odometry=FRAMES.robot)
        self._has_frame = False
        self._encoders = None if joints is None else Encoders(joints)
        self.views = 0
        self._skipped: Counter[str] = Counter()
        self._chosen = chosen
        self._kinds = kinds
        self._transforms: dict[str, Any] = {}
        self._cameras = StereoStream(chosen.images, chosen.infos, height_m, period_ns)
        self._scans = ScanStream(period_ns)
        self._reasons: list[str] = []

    def wanted(self) -> list[Wanted]:
        """Return what to subscribe to."""
        chosen = self._chosen
        wanted = [Wanted(STATIC, TRANSFORMS, LATCHED._replace(depth=100), self._on_transforms)]
        if chosen.odometry:
            is_ticks = self._encoders is not None
            receive = self._on_joints if is_ticks else self._on_odometry
            kind = self._kinds[chosen.odometry]
            wanted.append(Wanted(chosen.odometry, kind, Quality(depth=100), receive))
        if chosen.scan:
            wanted.append(Wanted(chosen.scan, LASER_SCAN, SENSOR, self._on_scan))
            return wanted

        for side in SIDES:
            info = partial(self._on_info, side)
            image = partial(self._on_image, side)
            name = chosen.images[side]
            wanted += [
                Wanted(chosen.infos[side], CAMERA_INFO, USUAL, info),
                Wanted(name, self._kinds[name], USUAL, image),
            ]
        return wanted

    def pose_in_odometry(self, stamp_ns: int) -> Floats:
        """Return the pose (3,) of the robot in the frame of its odometry, at a time of the run."""
        if self.odometry is None or not self._has_frame:
            return np.zeros(3)
        return self.odometry.pose_at(stamp_ns)

    def played(self, wall_ns: int, name: str) -> Playback:
        """Return how many views there were of the robot `name`, and why others were left out."""
        reasons, self._reasons = self._reasons, []
        return Playback(
            stamp_ns=self.stamps.now_ns(wall_ns),
            recording=name,
            views=self.views,
            skipped=self._skipped.total(),
            progress=0.0,
            reasons=reasons,
        )

    def skip(self, reason: str) -> bool:
        """Count what is left out. Returns whether it is the first time for such a reason."""
        kind = NUMBER.sub("#", reason)
        is_first = kind not in self._skipped
        self._skipped[kind] += 1
        if is_first:
            self._reasons.append(reason)
        return is_first

    def _stamp_ns(self, message: Any, wall_ns: int) -> int:
        """Return when a message was measured. Raises UsageError if it does not say so."""
        robot_ns = stamp_ns_of(message)
        if not robot_ns:
            raise UsageError(
                f"a {message.__msgtype__} has no stamp: have its driver set header.stamp"
            )
        return self.stamps.of(robot_ns, wall_ns)

    def _on_transforms(self, message: Any, wall_ns: int) -> list[Message]:
        self._transforms.update(steps_of(message))
        self._cameras.on_mount()
        return []

    def _on_info(self, side: int, message: Any, wall_ns: int) -> list[Message]:
        self._cameras.on_info(side, message)
        return []

    def _on_odometry(self, message: Any, wall_ns: int) -> list[Message]:
        assert self.odometry is not None
        stamp_ns = self._stamp_ns(message, wall_ns)
        pose = np.array(pose_of(message.pose.pose))
        self.odometry.on_pose(stamp_ns, pose, np.array(speeds_of(message.twist.twist)))
        odometry = message.header.frame_id.removeprefix("/") or FRAMES.odometry
        robot = message.child_frame_id.removeprefix("/") or FRAMES.robot
        self.frames = Frames(odometry=odometry, robot=robot)
        self._has_frame = True
        return []

    def _on_joints(self, message: Any, wall_ns: int) -> list[Message]:
        assert self.odometry is not None
        assert self._encoders is not None
        stamp_ns = self._stamp_ns(message, wall_ns)
        rolled = self._encoders.on_joints(stamp_ns, message)
        if rolled is not None:
            self.odometry.on_pose(stamp_ns, *rolled)
        return []

    def _on_image(self, side: int, message: Any, wall_ns: int) -> list[Message]:
        stamp_ns = self._stamp_ns(message, wall_ns)
        pair = self._cameras.on_image(side, stamp_ns, message)
        if pair is None:
            return []

        view_ns, left, right = pair
        frame = self._cameras.frame(self.views, view_ns, left, right, self._transforms)
        moved = [] if self.odometry is None else self.odometry.until(view_ns)
        self.views += 1
        return [*moved, frame]

    def _on_scan(self, message: Any, wall_ns: int) -> list[Message]:
        assert self.odometry is not None
        stamp_ns = self._stamp_ns(message, wall_ns)
        if not self._scans.is_due(stamp_ns):
            return []

        moved = self.odometry.until(stamp_ns)
        view = self._scans.view(self.views, stamp_ns, message, moved, self._transforms)
        self.views += 1
        return view
