"""Sensory memory and EPAM as they run, in one process: a stereo frame in, percepts out."""

from __future__ import annotations

import time
from dataclasses import dataclass

from cogmap.geometry.arrays import Booleans, Bytes
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import (
    Calibration,
    Learned,
    LearnedObject,
    Odometry,
    Percepts,
    StereoFrame,
    View,
)
from cogmap.services import registry
from cogmap.services.epam import module as epam
from cogmap.services.epam.layout import road
from cogmap.services.epam.pam import ExtendedPam
from cogmap.services.epam.recognition import objects, segments
from cogmap.services.epam.view import view_arrays

PERIOD_S = 0.2
PERIOD_NS = round(PERIOD_S * 1e9)


@dataclass(frozen=True, eq=False)
class Result:
    """What was made of one frame: view, percepts, objects learned, and the time taken."""

    view: View
    percepts: Percepts
    learned: list[LearnedObject]
    took_ms: float


class PerceptionPipeline:
    """Both modules, new: what they learn, they learn from the frames that they `process`."""

    def __init__(self, calibration: Calibration) -> None:
        self._calibration = calibration
        self._sensory = registry.build("sensory", {})
        self._epam = registry.build("epam", {})
        self._frame = 0

    def process(self, left: Bytes, right: Bytes, speed_m_s: float = 0.0) -> Result:
        """What sensory memory and then EPAM make of the next frame, PERIOD_S after the last."""
        frame = self._stereo(left, right)
        odometry = Odometry(
            stamp_ns=frame.stamp_ns,
            speed_m_s=speed_m_s,
            turn_rate_rad_s=0.0,
            dt_s=PERIOD_S,
        )
        self._sensory.feed(odometry)

        began_s = time.perf_counter()
        sensed = self._sensory.feed(frame)
        view = next(message for message in sensed if isinstance(message, View))
        recognised = self._epam.feed(view)
        took_ms = 1e3 * (time.perf_counter() - began_s)

        learned = []
        for message in recognised:
            if isinstance(message, Learned):
                learned += message.objects

        percepts = next(message for message in recognised if isinstance(message, Percepts))
        return Result(view, percepts, learned, took_ms)

    def _stereo(self, left: Bytes, right: Bytes) -> StereoFrame:
        number = self._frame
        self._frame += 1
        return StereoFrame(
            stamp_ns=self._frame * PERIOD_NS,
            frame=number,
            left=Array.of(left),
            right=Array.of(right),
            calibration=self._calibration,
        )


class CandidateProbe:
    """An extended PAM that gets the same views and learns the same.

    It gives its candidates of any activation, which the running one does not publish.
    """

    def __init__(self) -> None:
        self._pam = ExtendedPam(
            epam.Config(),
            segments.load(),
            objects.load(),
            road.load(),
        )

    def candidates(self, result: Result) -> list[tuple[str, float, Booleans]]:
        """Label, empty for none that it knows, activation, and pixels (h, w) of each.

        As they are before it learns from them.
        """
        found = self._pam.candidates(view_arrays(result.view), result.view.calibration)
        self._pam.restore(result.learned)
        candidates = []

        for candidate in found:
            label, activation = _likeliest(candidate.recognition)
            candidates.append((label, activation, candidate.segment.mask))

        return candidates


def _likeliest(recognition: objects.Recognition) -> tuple[str, float]:
    """The likeliest label, which may be that there is none, and the probability of that."""
    if recognition.known:
        return recognition.label, recognition.activation

    return "", recognition.unknown + recognition.background
