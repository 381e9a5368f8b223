"""Sensory memory and EPAM as the running system has them, in one process: a stereo frame in,
percepts out.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from schemas.array import Array
from schemas.sensing import (
    Calibration,
    Learned,
    LearnedObject,
    Odometry,
    Percepts,
    StereoFrame,
    View,
)
from services.epam import module as epam
from services.epam.layout import road
from services.epam.pam import ExtendedPam
from services.epam.recognition import objects, segments
from services.epam.view import view_arrays
from services.sensory import module as sensory

PERIOD_S = 0.2
Bytes = npt.NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Result:
    """What was made of one frame: the view, the percepts, the objects learned from it, and how long
    it took.
    """

    view: View
    percepts: Percepts
    learned: list[LearnedObject]
    took_ms: float


class PerceptionPipeline:
    """Both modules, fresh: what they learn, they learn from the frames of `see`."""

    def __init__(self, calibration: Calibration) -> None:
        self._calibration = calibration
        self._sensory = sensory.build(sensory.Config(), "sensory")
        self._epam = epam.build(epam.Config(), "epam")
        self._frame = 0

    def see(self, left: Bytes, right: Bytes, speed_m_s: float = 0.0) -> Result:
        """What sensory memory and then EPAM make of the next frame, PERIOD_S after the last."""
        stamp_ns = round((self._frame + 1) * PERIOD_S * 1e9)
        odometry = Odometry(
            stamp_ns=stamp_ns, speed_m_s=speed_m_s, turn_rate_rad_s=0.0, dt_s=PERIOD_S
        )
        frame = StereoFrame(
            stamp_ns=stamp_ns,
            frame=self._frame,
            left=Array.of(left),
            right=Array.of(right),
            calibration=self._calibration,
        )
        self._frame += 1
        self._sensory.feed(odometry)
        began = time.perf_counter()
        view = next(message for message in self._sensory.feed(frame) if isinstance(message, View))
        said = self._epam.feed(view)
        took_ms = 1e3 * (time.perf_counter() - began)
        learned = [
            known for message in said if isinstance(message, Learned) for known in message.objects
        ]
        return Result(
            view,
            next(message for message in said if isinstance(message, Percepts)),
            learned,
            took_ms,
        )


class CandidateProbe:
    """An extended PAM that sees the same views, learns the same, and tells its candidates of any
    activation.
    """

    def __init__(self) -> None:
        self._pam = ExtendedPam(epam.Config(), segments.load(), objects.load(), road.load())

    def candidates(self, result: Result) -> list[tuple[str, float, npt.NDArray[np.bool_]]]:
        """Label, empty for none that it knows, activation, and pixels (h, w) of each, before it
        learns from them.
        """
        found = self._pam.candidates(view_arrays(result.view), result.view.calibration)
        self._pam.restore(result.learned)
        return [(*_said(each.recognition), each.segment.mask) for each in found]


def _said(recognition: objects.Recognition) -> tuple[str, float]:
    """The likeliest that it says, which may be that there is no name for it, and the probability of
    that.
    """
    if recognition.known:
        return recognition.label, recognition.activation
    return "", recognition.unknown + recognition.background
