"""Sensory memory: what the senses gave, held and made ready for perception (paper §4, §5.1)."""

from __future__ import annotations

from typing import Annotated

import cv2
import msgspec
import numpy as np

from cogmap.runtime.module import Module
from schemas import topics
from schemas.array import Array
from schemas.base import Message
from schemas.sensing import Calibration, Odometry, RangeScan, SelfMotion, StereoFrame, View
from services.sensory.disparity import DepthFromStereo
from services.sensory.image import colour_image
from services.sensory.motion import OdometryBuffer
from services.sensory.rectify import rectification
from services.sensory.scan import scan as range_scan
from services.sensory.visual_odometry import VisualMotion
from services.sensory.wheels import WheelNoise, fuse

Share = Annotated[float, msgspec.Meta(ge=0, le=1)]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """`nearest_m` is the least depth that is looked for; a stamp more than `longest_gap_s` ahead is
    not believed.

    The wheels' noise multiplies both speeds (paper §5.4); wheels that differ a little also drift
    with the way.
    """

    nearest_m: Annotated[float, msgspec.Meta(ge=0.1, le=100)] = 2.5
    scan_sectors: Annotated[int, msgspec.Meta(ge=1, le=1024)] = 32
    longest_gap_s: Annotated[float, msgspec.Meta(gt=0, le=3600)] = 60.0
    speed_noise: Share = 0.1
    turn_noise: Share = 0.1
    drift_rad_per_sqrt_m: Share = 0.02


class SensoryMemory:
    """Turns stereo frames and odometry into self-motion, range scans and views, in step.

    A frame waits until the odometry up to its stamp has come, whichever of the two comes first, so
    what is said does not depend on how they interleave. A newer frame takes the place of a waiting
    one; the motion then covers both, so none is lost.
    """

    def __init__(self, config: Config) -> None:
        cv2.setNumThreads(1)
        self._config = config
        self._odometry = OdometryBuffer(config.longest_gap_s)
        self._waiting: StereoFrame | None = None
        self._last_ns: int | None = None
        self._noise = WheelNoise(config.speed_noise, config.turn_noise, config.drift_rad_per_sqrt_m)
        self._flow = VisualMotion()
        self._depth: tuple[Calibration, DepthFromStereo] | None = None

    def see(self, frame: StereoFrame) -> list[Message]:
        """Take in a frame. Raises MessageError where its images and its calibration do not fit
        together.
        """
        colour_image(frame.left, frame.calibration, "left")
        colour_image(frame.right, frame.calibration, "right")
        rectification(frame.calibration)
        self._odometry.check_near(frame.stamp_ns, "frame")
        if self._last_ns is not None and frame.stamp_ns <= self._last_ns:
            return []
        if self._waiting is None or frame.stamp_ns > self._waiting.stamp_ns:
            self._waiting = frame
        return self._emit()

    def roll(self, odometry: Odometry) -> list[Message]:
        """Take in odometry. Raises MessageError where it is senseless."""
        self._odometry.add(odometry)
        return self._emit()

    def _emit(self) -> list[Message]:
        frame = self._waiting
        if frame is None or not self._odometry.covers(frame.stamp_ns):
            return []
        self._waiting = None
        scan, view = self._views(frame)
        return [self._motion(frame, view), scan, view]

    def _motion(self, frame: StereoFrame, view: View) -> SelfMotion:
        began_ns, motions = self._odometry.take(frame.stamp_ns)
        if self._last_ns is None:
            self._last_ns = frame.stamp_ns if began_ns is None else began_ns
        since_ns = self._last_ns
        self._last_ns = frame.stamp_ns
        image = view.image.numpy().astype(np.uint8, copy=False)
        depth_m = view.depth_m.numpy().astype(np.float32)
        wheels = self._noise.total(motions)
        fused = fuse(motions, self._flow.fuse(image, depth_m, view.calibration, wheels), wheels)
        return SelfMotion(
            stamp_ns=frame.stamp_ns, frame=frame.frame, since_ns=since_ns, motions=Array.of(fused)
        )

    def _views(self, frame: StereoFrame) -> tuple[RangeScan, View]:
        rectified = rectification(frame.calibration)
        left, right = rectified.apply(
            colour_image(frame.left, frame.calibration, "left"),
            colour_image(frame.right, frame.calibration, "right"),
        )
        calibration = rectified.calibration
        depth_m = self._matcher(calibration).depth_m(left, right)
        bearing_rad, range_m = range_scan(depth_m, calibration, self._config.scan_sectors)
        ranges = RangeScan(
            frame=frame.frame, bearing_rad=Array.of(bearing_rad), range_m=Array.of(range_m)
        )
        view = View(
            frame=frame.frame,
            image=Array.of(left),
            depth_m=Array.of(depth_m),
            calibration=calibration,
        )
        ranges.stamp_ns = view.stamp_ns = frame.stamp_ns
        return ranges, view

    def _matcher(self, calibration: Calibration) -> DepthFromStereo:
        if self._depth is None or self._depth[0] != calibration:
            self._depth = (calibration, DepthFromStereo(calibration, self._config.nearest_m))
        return self._depth[1]


def build(config: Config, instance: str) -> Module:
    """The sensory memory as a module."""
    memory = SensoryMemory(config)
    says = (topics.SELF_MOTION, topics.SCAN, topics.VIEW)
    module = Module("sensory", instance)
    return module.on(topics.STEREO, memory.see, emits=says).on(
        topics.ODOMETRY, memory.roll, emits=says
    )
