"""Sensory memory: holds what the sensors measured, ready for perception (paper §4, §5.1)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import cv2
import numpy as np

from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Calibration, Odometry, RangeScan, SelfMotion, StereoFrame, View
from cogmap.services.sensory.config import Config
from cogmap.services.sensory.disparity import DepthFromStereo
from cogmap.services.sensory.image import colour_image
from cogmap.services.sensory.odometry_buffer import OdometryBuffer
from cogmap.services.sensory.rectify import rectification
from cogmap.services.sensory.scan import scan
from cogmap.services.sensory.visual_odometry import VisualOdometry
from cogmap.services.sensory.wheels import WheelNoise, fuse

__all__ = ["Config", "SensoryMemory", "build"]

# OpenCV divides an image in the same way for any number of threads, so results do not depend on it.
# All other modules wait while a view is made.
THREADS = 2
# Of the range scan: 2.3 degrees each of the simulated camera's 75.
SCAN_SECTORS = 32


class SensoryMemory:
    """Turns stereo frames and odometry into self-motion, range scans and views, in step.

    A frame waits until the odometry up to its stamp has come, whichever of the two comes first, so
    the output does not depend on how they interleave. A newer frame replaces a waiting one; the
    motion then covers both, so none is lost. The view comes first: perception begins with it while
    the motion is still being measured. The last frame, published again, gets the same answer again.
    """

    def __init__(self, config: Config) -> None:
        cv2.setNumThreads(THREADS)
        self._config = config
        self._odometry = OdometryBuffer()
        self._noise = WheelNoise(config.speed_noise, config.turn_noise, config.drift_rad_per_sqrt_m)
        self._visual_odometry = VisualOdometry()
        self._depth: tuple[Calibration, DepthFromStereo] | None = None
        self._waiting: StereoFrame | None = None
        self._last_ns: int | None = None
        self._answer: list[Message] = []

    def on_frame(self, frame: StereoFrame) -> Iterable[Message]:
        """Receive a frame. Raises MessageError if its images do not fit its calibration."""
        colour_image(frame.left, frame.calibration, "left")
        colour_image(frame.right, frame.calibration, "right")
        rectification(frame.calibration)
        self._odometry.check_near(frame.stamp_ns, "frame")

        if self._last_ns is not None and frame.stamp_ns <= self._last_ns:
            return self._answer if frame.stamp_ns == self._last_ns else []

        if self._waiting is None or frame.stamp_ns > self._waiting.stamp_ns:
            self._waiting = frame

        return self._emit()

    def on_odometry(self, odometry: Odometry) -> Iterable[Message]:
        """Receive odometry. Raises MessageError if no wheels turn so fast or its stamp is far
        ahead.
        """
        self._odometry.add(odometry)
        return self._emit()

    def _emit(self) -> Iterator[Message]:
        frame = self._waiting
        if frame is None or not self._odometry.covers(frame.stamp_ns):
            return

        self._waiting = None
        self._answer = []
        view = self._view(frame)
        yield view

        depth_m = view.depth_m.numpy().astype(np.float32, copy=False)
        bearing_rad, range_m = scan(depth_m, view.calibration, SCAN_SECTORS)
        ranges = RangeScan(
            stamp_ns=view.stamp_ns,
            frame=view.frame,
            bearing_rad=Array.of(bearing_rad),
            range_m=Array.of(range_m),
        )
        yield ranges

        began_ns, rows = self._odometry.take(frame.stamp_ns)
        if self._last_ns is None:
            self._last_ns = frame.stamp_ns if began_ns is None else began_ns
        since_ns = self._last_ns
        self._last_ns = frame.stamp_ns

        image = view.image.numpy().astype(np.uint8, copy=False)
        wheels = self._noise.total(rows)
        seen = self._visual_odometry.update(image, depth_m, view.calibration, wheels)
        motion = SelfMotion(
            stamp_ns=frame.stamp_ns,
            frame=frame.frame,
            since_ns=since_ns,
            motions=Array.of(fuse(rows, seen, wheels)),
        )
        self._answer = [view, ranges, motion]
        yield motion

    def _view(self, frame: StereoFrame) -> View:
        rectified = rectification(frame.calibration)
        calibration = rectified.calibration
        left, right = rectified.apply(
            colour_image(frame.left, frame.calibration, "left"),
            colour_image(frame.right, frame.calibration, "right"),
        )

        if self._depth is None or self._depth[0] != calibration:
            self._depth = (calibration, DepthFromStereo(calibration, self._config.nearest_m))
        _, matcher = self._depth
        depth_m = matcher.depth_m(left, right)
        return View(
            stamp_ns=frame.stamp_ns,
            frame=frame.frame,
            image=Array.of(left),
            depth_m=Array.of(depth_m),
            calibration=calibration,
        )


def build(config: Config, instance: str) -> Module:
    """Build the module `sensory`."""
    memory = SensoryMemory(config)
    emits = (topics.SELF_MOTION, topics.SCAN, topics.VIEW)
    return (
        Module("sensory", instance)
        .on(topics.STEREO, memory.on_frame, emits=emits)
        .on(topics.ODOMETRY, memory.on_odometry, emits=emits)
    )
