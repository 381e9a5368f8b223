"""Self-motion between two views: by the wheels, by the views, or by both. Pure."""

from __future__ import annotations

import enum

from cogmap.geometry.arrays import Floats
from cogmap.services.sensory.self_motion.motion import Motion, Velocity
from cogmap.services.sensory.self_motion.visual_odometry import TrackedView, VisualOdometry
from cogmap.services.sensory.self_motion.wheels import (
    Scale,
    WheelDoubt,
    WheelNoise,
    contradict,
    fuse,
    spread,
)

FAR_TURNED_RAD = 0.35
"""Two views so far turned have three quarters of a usual camera's field in common at most."""

STILL = Motion(0.0, 0.0, 0.0, 0.0)


class Source(enum.StrEnum):
    """What measures self-motion."""

    WHEELS = "wheels"
    VIEWS = "views"
    BOTH = "both"


class SelfMotionSense:
    """Measures the motion since the last view.

    If the views show none, it goes on as the velocity before, with a doubt that grows with the
    time; wheels then measure it, with the doubt that the views have cast on them.
    """

    def __init__(self, source: Source, noise: WheelNoise) -> None:
        self._source = source
        self._noise = noise
        self._visual_odometry = VisualOdometry(has_wheels=source is Source.BOTH)
        self._velocity = Velocity()
        self._doubt = WheelDoubt()
        self._scale = Scale()

    @property
    def offset_px(self) -> float:
        """Return what must be added to disparities, as motion has shown: 0 while the calibration
        may be right.
        """
        return self._visual_odometry.offset.correction_px

    @property
    def slope(self) -> float:
        """Return by how much the robot's way leads down as the camera sees it, as a share of the
        way: how the camera is tilted against the ground. 0 until it has driven.
        """
        return self._visual_odometry.slope.mean

    def update(self, view: TrackedView | None, dt_s: float, rows: Floats) -> Floats:
        """Return the motion since the last view, `dt_s` before this one, or 0 if there is none:
        (n, 5) rows as in SelfMotion. `rows` (n, 3) are what the wheels measured since then: speed,
        turn rate, duration. `view` is None if this one is not of the left camera.
        """
        wheels = self._noise.total(rows)
        if self._source is Source.WHEELS:
            return fuse(rows, wheels, wheels)

        is_first = dt_s <= 0.0
        velocity = self._velocity if is_first else self._velocity.after(dt_s)
        expected = velocity.over(dt_s)
        guesses = [expected, STILL]
        if self._source is Source.BOTH:
            guesses.insert(0, wheels)
        seen = self._visual_odometry.update(view, expected, dt_s, guesses)
        if is_first:
            return fuse(rows, wheels, wheels)

        if self._source is Source.VIEWS:
            motion = expected if seen is None else seen
            self._velocity = velocity if seen is None else Velocity.of(seen, dt_s)
            return spread(motion, dt_s)

        # A slow machine skips views: of two that show little of the same, the tracks may agree on
        # a motion that was none.
        is_far_turned = abs(wheels.turn_rad) > FAR_TURNED_RAD
        if seen is not None and is_far_turned and contradict(wheels, seen):
            seen = None

        doubted = self._doubt.doubted(wheels, seen, dt_s)
        if seen is None:
            motion = doubted.combined(expected)
        else:
            motion = doubted.combined(self._scale.correct(seen, doubted))
        self._velocity = Velocity.of(motion, dt_s)
        return fuse(rows, motion, wheels)
