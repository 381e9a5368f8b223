"""Sensory memory and EPAM as they run, in one process: a stereo frame in, percepts out."""

from __future__ import annotations

import time
from dataclasses import dataclass

from cogmap.geometry.arrays import Booleans, Bytes
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import (
    Calibration,
    Odometry,
    Percepts,
    StereoFrame,
    View,
)
from cogmap.services import registry
from cogmap.services.epam.public import (
    EpamConfig,
    ExtendedPam,
    objects,
    road,
    segments,
    view_arrays,
)

PERIOD_S = 0.2


@dataclass(frozen=True, eq=False)
class Result:
    """The view and percepts of one frame, and the time taken."""

    view: View
    percepts: Percepts
    took_ms: float


class SensoryPipeline:
    """Sensory memory, new: a view of each stereo pair, PERIOD_S after the last."""

    def __init__(self, calibration: Calibration, period_s: float = PERIOD_S) -> None:
        self._calibration = calibration
        self._period_s = period_s
        self._sensory = registry.build("sensory", {})
        self._frame = 0

    def next_frame(self, left: Bytes, right: Bytes, speed_m_s: float = 0.0) -> StereoFrame:
        """Return the frame of a pair; sensory memory gets the odometry up to it."""
        number = self._frame
        self._frame += 1
        stamp_ns = self._frame * round(self._period_s * 1e9)
        odometry = Odometry(
            stamp_ns=stamp_ns, speed_m_s=speed_m_s, turn_rate_rad_s=0.0, dt_s=self._period_s
        )
        self._sensory.feed(odometry)
        return StereoFrame(
            stamp_ns=stamp_ns,
            frame=number,
            left=Array.of(left),
            right=Array.of(right),
            calibration=self._calibration,
        )

    def view(self, frame: StereoFrame) -> View:
        """Return the view that sensory memory publishes of a frame."""
        return next(each for each in self._sensory.feed(frame) if isinstance(each, View))


class PerceptionPipeline:
    """Sensory memory and EPAM, new."""

    def __init__(self, calibration: Calibration) -> None:
        self._sensory = SensoryPipeline(calibration)
        self._epam = registry.build("epam", {})

    def process(self, left: Bytes, right: Bytes, speed_m_s: float = 0.0) -> Result:
        """Return the result of the next frame."""
        frame = self._sensory.next_frame(left, right, speed_m_s)

        began_s = time.perf_counter()
        view = self._sensory.view(frame)
        recognised = self._epam.feed(view)
        took_ms = 1e3 * (time.perf_counter() - began_s)

        percepts = next(message for message in recognised if isinstance(message, Percepts))
        return Result(view, percepts, took_ms)


class CandidateProbe:
    """An extended PAM that gets the same views.

    It gives its candidates of any activation, which the running one does not publish.
    """

    def __init__(self) -> None:
        self._pam = ExtendedPam(
            EpamConfig(),
            segments.load(),
            objects.load(),
            road.load(),
        )

    def candidates(self, result: Result) -> list[tuple[str, float, Booleans]]:
        """Return the likeliest label, empty for none that it knows, its probability, and pixels
        (h, w) of each.
        """
        found = self._pam.candidates(view_arrays(result.view), result.view.calibration)
        candidates = []

        for candidate in found:
            label = ""
            activation = candidate.recognition.unknown + candidate.recognition.background
            if candidate.recognition.known:
                label = candidate.recognition.label
                activation = candidate.recognition.activation
            candidates.append((label, activation, candidate.segment.mask))

        return candidates
