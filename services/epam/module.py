"""Extended PAM as a module: views in, percepts out, and what was learned from them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import cv2

from cogmap.runtime.module import Module
from schemas import topics
from schemas.base import Message
from schemas.sensing import Learned, View
from services.epam.config import Config
from services.epam.layout import road
from services.epam.pam import ExtendedPam
from services.epam.places.recognizer import PlaceMemory
from services.epam.recognition import objects, segments
from services.epam.view import pixels

__all__ = ["Config", "build"]


class Perception:
    """Turns each view into percepts. Between views it keeps what it learned: new buildings, and
    ways that it went.
    """

    def __init__(self, config: Config, pam: ExtendedPam, places: PlaceMemory) -> None:
        self._pam = pam
        self._places = places
        self._frame = 0
        self._stamp_ns = 0

    def see(self, view: View) -> list[Message]:
        """What is in `view`, perhaps nothing, after what was learned from it.

        Raises MessageError where image, depth and calibration do not fit.
        """
        seen = pixels(view)
        percepts, met = self._pam.perceive(view, seen)
        matches, remembered = self._places.see(view.frame, view.stamp_ns, seen.image, seen.depth_m)
        percepts.matches = matches
        if not met and not remembered:
            return [percepts]
        self._stamp_ns = view.stamp_ns
        self._frame = view.frame
        return [
            Learned(stamp_ns=view.stamp_ns, frame=view.frame, objects=met, views=remembered),
            percepts,
        ]

    def recall(self, past: Iterable[Message]) -> None:
        """Know again what was learned before a restart."""
        for message in past:
            if isinstance(message, Learned):
                self._stamp_ns = message.stamp_ns
                self._frame = message.frame
                self._pam.recall(message.objects)
                self._places.recall(message.views)

    def everything(self) -> Learned:
        """All that was learned, as one message."""
        return Learned(
            stamp_ns=self._stamp_ns,
            frame=self._frame,
            objects=self._pam.learned,
            views=list(self._places.all),
        )


def build(config: Config, instance: str) -> Module:
    """The extended PAM as a module. Raises ConfigError where its networks cannot be read."""
    cv2.setNumThreads(1)
    pam = ExtendedPam(
        config,
        segments.load(_path(config.segments_weights, segments.DEFAULT_PATH)),
        objects.load(_path(config.object_weights, objects.DEFAULT_PATH)),
        road.load(_path(config.road_weights, road.DEFAULT_PATH)),
    )
    perception = Perception(config, pam, PlaceMemory())
    module = Module("epam", instance).on(
        topics.VIEW, perception.see, emits=(topics.PERCEPTS, topics.LEARNED)
    )
    return module.journaling(topics.LEARNED, perception.recall, perception.everything)


def _path(given: str, default: Path) -> Path:
    return Path(given) if given else default
