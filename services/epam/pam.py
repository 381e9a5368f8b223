"""Objects and road recognised in a view (paper §5.1): PAM nodes over threshold become percepts.

Beyond the paper, a building of no known node gets one at the first sight, by what it looks like.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from dataclasses import replace

import numpy as np

from schemas.array import Array
from schemas.sensing import Calibration, LearnedObject, Percept, Percepts, View
from services.epam.config import Config
from services.epam.layout.footprint_fit import Place, locate
from services.epam.layout.road import Roads
from services.epam.layout.walls import walls
from services.epam.recognition.candidate import Candidate, beside, height_m, joined, outline_px
from services.epam.recognition.objects import Look, Recogniser
from services.epam.recognition.segments import Segmenter
from services.epam.view import Seen

NEW_LABEL = "new-building-{}"
LIKELIER_THAN_NOT = 0.5


class ExtendedPam:
    """Knows the nodes that were taught, and those learned since."""

    def __init__(
        self, config: Config, segmenter: Segmenter, recogniser: Recogniser, roads: Roads
    ) -> None:
        self._config = config
        self._segmenter = segmenter
        self._recogniser = recogniser
        self._roads = roads

    def perceive(self, view: View, seen: Seen) -> tuple[Percepts, list[LearnedObject]]:
        """The percepts of `view`, and the nodes that it gave."""
        camera = view.calibration
        found, met = self._named(self.candidates(seen, camera), seen)
        places = self._places(found, camera)
        objects = [self._percept(*pair, camera) for pair in zip(found, places, strict=True)]
        road_m, boundary_m = self._roads.project(
            self._roads.likelihood(seen.image), seen.depth_m, camera
        )
        percepts = Percepts(
            stamp_ns=view.stamp_ns,
            frame=view.frame,
            objects=objects,
            road_m=Array.of(road_m),
            road_boundary_m=Array.of(boundary_m),
        )
        return percepts, met

    def candidates(self, seen: Seen, camera: Calibration) -> list[Candidate]:
        """Every segment wide enough, whatever its activation, from left to right."""
        segments = self._segmenter.segments(seen.image, seen.depth_m, camera)
        standing = [(segment, walls(segment, seen.disparity_px)) for segment in segments]
        wide = [
            (segment, wall)
            for segment, wall in standing
            if wall is not None and segment.box_px[2] >= self._config.narrowest_px
        ]
        looks = self._recogniser.looks(
            seen.image, seen.depth_m, [segment for segment, _ in wide], camera
        )
        return [
            Candidate(segment, wall, self._recogniser.recognise(look))
            for (segment, wall), look in zip(wide, looks, strict=True)
        ]

    def recall(self, objects: Iterable[LearnedObject]) -> None:
        """Know these nodes again."""
        for known in objects:
            self._recogniser.learn(known.label, known.embedding.numpy().astype(np.float32))

    @property
    def learned(self) -> list[LearnedObject]:
        """Every node learned since the teaching."""
        return [
            LearnedObject(label=label, embedding=Array.of(vector))
            for label, vector in self._recogniser.learned
        ]

    def _named(
        self, candidates: list[Candidate], seen: Seen
    ) -> tuple[list[Candidate], list[LearnedObject]]:
        """What is surely a building, one of each node, with new nodes for what has none, and what
        was learned.
        """
        pieces: dict[str, list[Candidate]] = {}
        met: list[LearnedObject] = []
        for first in sorted(candidates, key=lambda one: -one.recognition.activation):
            candidate = self._apart(self._again(first), pieces)
            recognition = candidate.recognition
            if 1 - recognition.nothing <= self._config.percept_threshold:
                continue
            if self._is_new(candidate):
                label = NEW_LABEL.format(1 + len({known for known, _ in self._recogniser.learned}))
                met.append(self._learn(label, recognition.look))
                candidate = self._again(candidate)
            elif recognition.label not in pieces and self._is_another_look(candidate):
                met.append(self._learn(recognition.label, recognition.look))
            pieces.setdefault(candidate.recognition.label, []).append(candidate)
        found = [joined(some, seen.disparity_px) for some in pieces.values()]
        return sorted(found, key=lambda one: one.walls.left), met

    def _again(self, candidate: Candidate, apart_from: Container[str] = ()) -> Candidate:
        """Recognised by all that is known by now, except by those names."""
        return replace(
            candidate,
            recognition=self._recogniser.recognise(candidate.recognition.look, apart_from),
        )

    def _apart(self, candidate: Candidate, pieces: Mapping[str, list[Candidate]]) -> Candidate:
        """Recognised as none of those seen elsewhere in the same view: nothing is in two places."""
        there = pieces.get(candidate.recognition.label, [candidate])
        return candidate if beside(there[0], candidate) else self._again(candidate, pieces)

    def _is_new(self, candidate: Candidate) -> bool:
        """Whether it is seen well, and likelier a building that is none of those known than all
        else together.
        """
        recognition = candidate.recognition
        segment = candidate.segment
        large = segment.area_px >= self._config.learned_share * segment.mask.size
        whole = recognition.look.whole > self._config.percept_threshold
        return large and whole and recognition.new > LIKELIER_THAN_NOT

    def _is_another_look(self, candidate: Candidate) -> bool:
        """Whether it is surely a building that was learned, as it was not seen before."""
        recognition = candidate.recognition
        sure = min(recognition.activation, recognition.look.whole) > self._config.sure
        return sure and self._recogniser.is_another(recognition)

    def _learn(self, label: str, look: Look) -> LearnedObject:
        self._recogniser.learn(label, look.embedding)
        return LearnedObject(label=label, embedding=Array.of(look.embedding))

    def _total(self, candidate: Candidate) -> float:
        """Total activation: base level and current."""
        return min(1.0, self._config.base_level + candidate.recognition.activation)

    def _places(self, found: list[Candidate], camera: Calibration) -> list[Place]:
        """Where each stands: by its known size where that fits what is seen, else as of usual size."""
        fitting = [
            (number, candidate.walls.outline(candidate.recognition.size_m[:2]))
            for number, candidate in enumerate(found)
            if candidate.recognition.size_m is not None
            and (candidate.walls.left_true or candidate.walls.right_true)
        ]
        places = [candidate.walls.roughly(camera) for candidate in found]
        fitted = locate([outline for _, outline in fitting], camera)
        for (number, _), place in zip(fitting, fitted, strict=True):
            sure = place.range_sd_m <= self._config.worst_range_sd_share * place.range_m
            if sure and place.misfit <= self._config.worst_misfit:
                places[number] = place
        return places

    def _percept(self, candidate: Candidate, place: Place, camera: Calibration) -> Percept:
        segment = candidate.segment
        size_m = candidate.recognition.size_m
        return Percept(
            label=candidate.recognition.label,
            activation=self._total(candidate),
            bearing_rad=place.bearing_rad,
            range_m=place.range_m,
            bearing_sd_rad=place.bearing_sd_rad,
            range_sd_m=place.range_sd_m,
            width_m=candidate.walls.width_m(camera) if size_m is None else sum(size_m[:2]) / 2,
            height_m=height_m(candidate, camera) if size_m is None else size_m[2],
            whole=candidate.walls.whole,
            box_px=segment.box_px,
            outline_px=outline_px(segment),
        )
