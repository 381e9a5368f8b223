"""Sensory memory: holds what the sensors measured, ready for perception (paper §4, §5.1)."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterable, Iterator

import cv2
import numpy as np

from cogmap.geometry.arrays import Bytes, Singles
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Calibration, Odometry, RangeScan, SelfMotion, StereoFrame, View
from cogmap.services.sensory.config import Config
from cogmap.services.sensory.disparity import MIN_DISPARITY_PX, DepthFromStereo
from cogmap.services.sensory.image import (
    check_image,
    colour_image,
    grey_image,
    working_calibration,
)
from cogmap.services.sensory.pair_check import PairCheck, PairFault, is_clipped
from cogmap.services.sensory.rectify import rectification
from cogmap.services.sensory.scan import scan
from cogmap.services.sensory.self_motion.odometry_buffer import NS_PER_S, OdometryBuffer
from cogmap.services.sensory.self_motion.sense import SelfMotionSense, Source
from cogmap.services.sensory.self_motion.tracks import corners
from cogmap.services.sensory.self_motion.visual_odometry import TrackedView
from cogmap.services.sensory.self_motion.wheels import WheelNoise

__all__ = ["Config", "SensoryMemory", "build"]

# OpenCV divides an image in the same way for any number of threads, so results do not depend on it.
# All other modules wait while a view is made.
THREADS = 2
OFFSET_NOTE = (
    "near and far things contradict each other as the robot moves, unless {:+.1f} px are added to "
    "disparities, which is done: calibrate the cameras again"
)
log = logging.getLogger("cogmap")


class SensoryMemory:
    """Turns stereo frames and odometry into self-motion, range scans and views, in step.

    Unless views alone measure self-motion, a frame waits until the odometry up to its stamp has
    come, whichever of the two comes first, so the output does not depend on how they interleave. A
    newer frame replaces a waiting one; the motion then covers both, so none is lost. The view comes
    first: perception begins with it while the motion is still being measured. The last frame,
    published again, gets the same answer again. An older one is ignored, but two in succession show
    that time has gone back.
    """

    def __init__(self, config: Config) -> None:
        cv2.setNumThreads(THREADS)
        self._config = config
        self._has_wheels = config.self_motion is not Source.VIEWS
        self._odometry = OdometryBuffer()
        noise = WheelNoise(config.speed_noise, config.turn_noise, config.drift_rad_per_sqrt_m)
        self._self_motion = SelfMotionSense(config.self_motion, noise)
        self._camera: Camera | None = None
        self._check = PairCheck()
        self._faults: Counter[PairFault] = Counter()
        self._fault = PairFault.NONE
        self._offset_px = 0.0
        self._waiting: StereoFrame | None = None
        self._last_ns: int | None = None
        self._last_frame_ns: int | None = None
        self._was_older = False
        self._answer: list[Message] = []

    def on_frame(self, frame: StereoFrame) -> Iterable[Message]:
        """Receive a frame. Raises MessageError if its images do not fit its calibration."""
        check_image(frame.left, frame.calibration, "left")
        check_image(frame.right, frame.calibration, "right")
        rectification(frame.calibration)
        self._odometry.check_near(frame.stamp_ns, "frame")

        if frame.stamp_ns == self._last_ns:
            return self._answer

        is_older = self._last_ns is not None and frame.stamp_ns < self._last_ns
        is_back = is_older and self._was_older
        self._was_older = is_older
        if is_back:
            self._last_ns = None
            self._last_frame_ns = None
        elif is_older:
            return []

        self._waiting = frame
        return self._emit()

    def on_odometry(self, odometry: Odometry) -> Iterable[Message]:
        """Receive odometry. Raises MessageError if no wheels turn so fast or its stamp is far
        ahead.
        """
        if not self._has_wheels:
            return ()
        self._odometry.add(odometry)
        return self._emit()

    def notes(self) -> list[str]:
        """Return how many pairs had which fault, and whether the calibration is wrong."""
        notes = [f"{number} stereo pairs: {fault}" for fault, number in self._faults.items()]
        if self._offset_px:
            notes.append(OFFSET_NOTE.format(self._offset_px))
        return notes

    def _emit(self) -> Iterator[Message]:
        frame = self._waiting
        if frame is None or (self._has_wheels and not self._odometry.covers(frame.stamp_ns)):
            return

        self._waiting = None
        self._answer = []
        tracked, view = self._view(frame)
        yield view

        depth_m = view.depth_m.numpy().astype(np.float32, copy=False)
        bearing_rad, range_m = scan(depth_m, view.calibration, self._self_motion.slope)
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

        last_frame_ns = frame.stamp_ns if self._last_frame_ns is None else self._last_frame_ns
        self._last_frame_ns = frame.stamp_ns
        dt_s = (frame.stamp_ns - last_frame_ns) / NS_PER_S
        motion = SelfMotion(
            stamp_ns=frame.stamp_ns,
            frame=frame.frame,
            since_ns=since_ns,
            motions=Array.of(self._self_motion.update(tracked, dt_s, rows)),
        )
        self._answer = [view, ranges, motion]
        yield motion

    def _view(self, frame: StereoFrame) -> tuple[TrackedView | None, View]:
        camera = self._camera
        if camera is None or camera.given != frame.calibration:
            camera = Camera(frame.calibration, self._config)
            self._camera = camera
        left, right = camera.pair(frame)
        left_grey = grey_image(left)
        right_grey = grey_image(right)

        disparity_px = self._corrected(camera.depth.disparity_px(left, right))
        disparity_px[is_clipped(left_grey)] = 0.0
        corners_px = corners(left_grey)
        fault = self._check.fault(
            left_grey,
            right_grey,
            corners_px,
            disparity_px,
            lambda: camera.depth.disparity_px(right, left, refine=False),
        )
        self._count(fault)
        if fault:
            disparity_px[:] = 0.0

        tracked: TrackedView | None = None
        if fault is not PairFault.SWAPPED:
            tracked = TrackedView(left_grey, disparity_px, corners_px, camera.working)
        view = View(
            stamp_ns=frame.stamp_ns,
            frame=frame.frame,
            image=Array.of(left),
            depth_m=Array.of(camera.depth.depth_of(disparity_px)),
            calibration=camera.working,
        )
        return tracked, view

    def _corrected(self, disparity_px: Singles) -> Singles:
        """Return disparities (h, w) without the offset that motion has shown."""
        offset_px = self._self_motion.offset_px
        if offset_px and not self._offset_px:
            log.warning("%s: %s", topics.STEREO.name, OFFSET_NOTE.format(offset_px))
        self._offset_px = offset_px
        if not offset_px:
            return disparity_px

        corrected_px = disparity_px + np.float32(offset_px)
        corrected_px[(disparity_px <= 0) | (corrected_px < MIN_DISPARITY_PX)] = 0.0
        return corrected_px

    def _count(self, fault: PairFault) -> None:
        """Count a pair's fault, and log it if it is another one than that of the pair before."""
        if fault:
            self._faults[fault] += 1
        if fault != self._fault:
            if fault:
                log.warning("%s: %s; its depth is left out", topics.STEREO.name, fault)
            else:
                log.warning("%s: left and right belong together again", topics.STEREO.name)
        self._fault = fault


class Camera:
    """What frames of one calibration need: their rectification and matcher, at the size that they
    are worked at.
    """

    def __init__(self, given: Calibration, config: Config) -> None:
        self.given = given
        self._smaller = working_calibration(given, config.max_pixels)
        self._rectification = rectification(self._smaller)
        self.working = self._rectification.calibration
        self.depth = DepthFromStereo(self.working, config.nearest_m)
        log.info(
            "views are %d x %d, the camera's images %d x %d",
            self.working.width_px,
            self.working.height_px,
            given.width_px,
            given.height_px,
        )

    def pair(self, frame: StereoFrame) -> tuple[Bytes, Bytes]:
        """Return the rectified images, RGB (h, w, 3)."""
        left = colour_image(frame.left, self.given, "left", self._smaller)
        right = colour_image(frame.right, self.given, "right", self._smaller)
        return self._rectification.apply(left, right)


def build(config: Config, instance: str) -> Module:
    """Build the module `sensory`."""
    memory = SensoryMemory(config)
    emits = (topics.SELF_MOTION, topics.SCAN, topics.VIEW)
    return (
        Module("sensory", instance, notes=memory.notes)
        .on(topics.STEREO, memory.on_frame, emits=emits)
        .on(topics.ODOMETRY, memory.on_odometry, emits=emits)
    )
