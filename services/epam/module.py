"""Extended PAM as a module: receives views, publishes percepts and what was learned from them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import cv2
import msgspec

from cogmap.runtime.module import Module
from cogmap.runtime.run import REAL_TIME, Run
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Broadcast, Competition
from cogmap.schemas.sensing import Learned, Percepts, View
from cogmap.services.epam import backbone
from cogmap.services.epam.association.memory import Primer
from cogmap.services.epam.backbone import Backbone
from cogmap.services.epam.config import Config
from cogmap.services.epam.layout import road
from cogmap.services.epam.network import WEIGHTS
from cogmap.services.epam.pam import ExtendedPam
from cogmap.services.epam.places import descriptor
from cogmap.services.epam.places.recognizer import PlaceRecognizer
from cogmap.services.epam.recognition import objects, segments
from cogmap.services.epam.view import view_arrays

__all__ = ["Config", "build"]

CAMVID = WEIGHTS / "camvid"
# Of each set of weights, the networks of segments and of the road.
BUILT_IN = {
    "rendered": (segments.DEFAULT_PATH, road.DEFAULT_PATH),
    "camvid": (CAMVID / "segments.onnx", CAMVID / "road.onnx"),
}


class Perception:
    """Turns each view into percepts. Between views it keeps what it learned: views to recognize
    places by, and what goes with what.
    """

    def __init__(
        self,
        pam: ExtendedPam,
        features: Backbone,
        places: PlaceRecognizer,
        primer: Primer,
        in_lockstep: bool,
    ) -> None:
        self._pam = pam
        self._backbone = features
        self._places = places
        self._primer = primer
        self._in_lockstep = in_lockstep
        self._waiting: View | None = None
        self._last_percepts: Percepts | None = None
        self._last_learned: Learned | None = None

    def on_view(self, view: View) -> list[Message]:
        """Return the percepts of `view`, perhaps empty ones, after what was learned from it.

        In lockstep a view waits for the competition that it is primed by. The last view may be
        published again, after another module or this one was restarted: its percepts are returned
        again, nothing is learned from it twice, and it waits for nothing. Raises MessageError if
        image, depth and calibration do not fit each other.
        """
        is_repeated = self._waiting is not None and _same_view(view, self._waiting)
        self._waiting = None
        if self._in_lockstep and not self._primer.is_ready and not is_repeated:
            self._waiting = view
            return []
        return self._perceive(view)

    def on_competition(self, competition: Competition) -> list[Message]:
        """Return the percepts of a view that has waited for this."""
        self._primer.on_competition(competition.stamp_ns)
        view = self._waiting
        if view is None or not self._primer.is_ready:
            return []

        self._waiting = None
        return self._perceive(view)

    def on_broadcast(self, broadcast: Broadcast) -> None:
        """Prime a later view by what was conscious."""
        self._primer.on_broadcast(broadcast)

    def _perceive(self, view: View) -> list[Message]:
        arrays = view_arrays(view)
        if self._last_percepts is not None and _same_view(view, self._last_percepts):
            return [msgspec.structs.replace(self._last_percepts)]

        learning = self._last_learned is None or not _same_view(view, self._last_learned)
        associations = self._primer.begin(view.stamp_ns)
        prior = self._primer.prior(view.stamp_ns)

        # The features are found beside the objects.
        shows_place = descriptor.shows_place(arrays.image, arrays.depth_m)
        features = self._backbone.begin(arrays.image) if shows_place else None
        perceived = self._pam.perceive(arrays, view.calibration, prior, learning=learning)
        code = None if features is None else descriptor.code(features.features())
        matches, remembered = self._places.observe(view.frame, view.stamp_ns, code, learning)
        percepts = Percepts(
            stamp_ns=view.stamp_ns,
            frame=view.frame,
            objects=[self._primer.felt(percept) for percept in perceived.objects],
            calibration=view.calibration,
            road_m=Array.of(perceived.road_m),
            road_boundary_m=Array.of(perceived.road_boundary_m),
            matches=matches,
        )
        self._last_percepts = percepts
        if not remembered and associations is None:
            return [percepts]

        self._last_learned = Learned(
            stamp_ns=view.stamp_ns,
            frame=view.frame,
            views=remembered,
            associations=associations,
            taught_share=self._pam.taught_share.published(),
        )
        return [self._last_learned, percepts]

    def restore(self, messages: Iterable[Message]) -> None:
        """Recognize again what was learned before a restart."""
        for message in messages:
            if isinstance(message, Learned):
                self._last_learned = message
                self._places.restore(message.views)
                if message.taught_share is not None:
                    self._pam.taught_share.restore(message.taught_share)
                if message.associations is not None:
                    self._primer.restore(message.associations)

    def snapshot(self) -> Learned:
        """Return all that was learned, as one message with the stamp of the last."""
        last = self._last_learned or Learned(frame=0)
        return Learned(
            stamp_ns=last.stamp_ns,
            frame=last.frame,
            views=list(self._places.all),
            associations=self._primer.published(),
            taught_share=self._pam.taught_share.published(),
        )


def build(config: Config, instance: str, run: Run = REAL_TIME) -> Module:
    """Build the extended PAM as a module. Raises ConfigError if its networks cannot be read."""
    cv2.setNumThreads(1)
    segments_default, road_default = BUILT_IN[config.weights]
    segments_path = Path(config.segments_weights or segments_default)
    objects_path = Path(config.object_weights or objects.DEFAULT_PATH)
    road_path = Path(config.road_weights or road_default)
    pam = ExtendedPam(
        config,
        segments.load(segments_path, config.processor),
        objects.load(objects_path, config.processor),
        road.load(road_path, config.processor),
    )
    primer = Primer(config.priming)
    features = backbone.load(processor=config.processor)
    perception = Perception(pam, features, PlaceRecognizer(), primer, run.lockstep)

    published = (topics.PERCEPTS, topics.LEARNED)
    return (
        Module("epam", instance)
        .on(topics.VIEW, perception.on_view, emits=published)
        .on(topics.COMPETITION, perception.on_competition, emits=published)
        .on(topics.BROADCAST, perception.on_broadcast)
        .journaling(
            topics.LEARNED, perception.restore, perception.snapshot, backfill=[topics.BROADCAST]
        )
    )


def _same_view(view: View, message: View | Percepts | Learned) -> bool:
    return (view.stamp_ns, view.frame) == (message.stamp_ns, message.frame)
