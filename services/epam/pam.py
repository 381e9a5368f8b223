"""Objects and road recognised in a view (paper §5.1): PAM nodes over threshold become percepts.

Beyond the paper, a building of no known node gets one at the first sight, by what it looks like.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np

from schemas.array import Array
from schemas.sensing import Calibration, LearnedObject, Percept, Percepts, View
from services.epam.geometry import Place, locate
from services.epam.objects import Recogniser, Recognition
from services.epam.road import Roads
from services.epam.segments import Segment, Segmenter
from services.epam.settings import Config
from services.epam.view import Seen
from services.epam.walls import Walls, walls

NEW_LABEL = "new-building-{}"
OUTLINE_PX, BRIDGED_PX = 1.0, 9
LEAST_HEIGHT_M = 0.5


@dataclass(frozen=True, eq=False)
class Candidate:
    """A segment that stands somewhere, and what it was recognised as."""

    segment: Segment
    walls: Walls
    recognition: Recognition


class ExtendedPam:
    """Knows the nodes that were taught, and those learned since."""

    def __init__(self, config: Config, segmenter: Segmenter, recogniser: Recogniser, roads: Roads) -> None:
        self._config = config
        self._segmenter, self._recogniser, self._roads = segmenter, recogniser, roads

    def perceive(self, view: View, seen: Seen) -> tuple[Percepts, list[LearnedObject]]:
        """The percepts of `view`, and the nodes that it gave."""
        camera = view.calibration
        found, met = self._named(self.candidates(seen, camera))
        places = self._places(found, camera)
        objects = [self._percept(*pair, camera) for pair in zip(found, places, strict=True)]
        road_m, boundary_m = self._roads.project(self._roads.likelihood(seen.image), seen.depth_m, camera)
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
        embeddings = self._recogniser.embeddings(
            seen.image, seen.depth_m, [segment for segment, _ in wide], camera.fx_px
        )
        return [
            Candidate(segment, wall, self._recogniser.recognise(embedding))
            for (segment, wall), embedding in zip(wide, embeddings, strict=True)
        ]

    def recall(self, objects: Iterable[LearnedObject]) -> None:
        """Know these nodes again."""
        for known in objects:
            self._recogniser.learn(known.label, known.embedding.numpy().astype(np.float32))

    @property
    def learned(self) -> list[LearnedObject]:
        """Every node learned since the teaching."""
        return [LearnedObject(label=label, embedding=Array.of(vector)) for label, vector in self._recogniser.learned]

    def _named(self, candidates: list[Candidate]) -> tuple[list[Candidate], list[LearnedObject]]:
        """Those over threshold, of each node the largest, with new nodes for what has none, and these nodes."""
        largest: dict[str, Candidate] = {}
        met: list[LearnedObject] = []
        over = [candidate for candidate in candidates if self._total(candidate) > self._config.percept_threshold]
        for candidate in sorted(over, key=lambda one: -one.segment.area_px):
            label = candidate.recognition.label
            if not label and candidate.segment.area_px >= self._config.learned_share * candidate.segment.mask.size:
                label = NEW_LABEL.format(1 + len({known for known, _ in self._recogniser.learned}))
                embedding = candidate.recognition.embedding
                self._recogniser.learn(label, embedding)
                met.append(LearnedObject(label=label, embedding=Array.of(embedding)))
            if label:
                largest.setdefault(label, _called(candidate, label))
        return sorted(largest.values(), key=lambda one: one.walls.left), met

    def _total(self, candidate: Candidate) -> float:
        """Total activation: base level and current."""
        return min(1.0, self._config.base_level + candidate.recognition.activation)

    def _places(self, found: list[Candidate], camera: Calibration) -> list[Place]:
        """Where each stands: by its known size where that fits what is seen, else as of usual size."""
        fitting = [
            (number, candidate.walls.outline(candidate.recognition.size_m[:2]))
            for number, candidate in enumerate(found)
            if candidate.recognition.size_m is not None and (candidate.walls.left_true or candidate.walls.right_true)
        ]
        places = [candidate.walls.roughly(camera) for candidate in found]
        fitted = locate([outline for _, outline in fitting], camera)
        for (number, _), place in zip(fitting, fitted, strict=True):
            sure = place.range_sd_m <= self._config.worst_range_sd_share * place.range_m
            if sure and place.misfit <= self._config.worst_misfit:
                places[number] = place
        return places

    def _percept(self, candidate: Candidate, place: Place, camera: Calibration) -> Percept:
        segment, size_m = candidate.segment, candidate.recognition.size_m
        return Percept(
            label=candidate.recognition.label,
            activation=self._total(candidate),
            bearing_rad=place.bearing_rad,
            range_m=place.range_m,
            bearing_sd_rad=place.bearing_sd_rad,
            range_sd_m=place.range_sd_m,
            width_m=candidate.walls.width_m(camera) if size_m is None else sum(size_m[:2]) / 2,
            height_m=_height_m(candidate, camera) if size_m is None else size_m[2],
            whole=candidate.walls.whole,
            box_px=segment.box_px,
            outline_px=outline_px(segment),
        )


def outline_px(segment: Segment) -> list[tuple[int, int]]:
    """A polygon around the largest piece of `segment`, column and row of its corners; a lamp does not divide it."""
    closed = cv2.morphologyEx(segment.mask.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((1, BRIDGED_PX), np.uint8))
    pieces, _ = cv2.findContours(closed, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    largest = max(pieces, key=cv2.contourArea)
    corners = cv2.approxPolyDP(largest, OUTLINE_PX, True).reshape(-1, 2)
    return [(int(column), int(row)) for column, row in corners]


def _called(candidate: Candidate, label: str) -> Candidate:
    recognition = candidate.recognition
    named = Recognition(label, recognition.activation, recognition.embedding, recognition.size_m)
    return Candidate(candidate.segment, candidate.walls, named)


def _height_m(candidate: Candidate, camera: Calibration) -> float:
    """How high over the ground the top of what is seen is."""
    nearest_px = max(float(candidate.walls.disparity_px.max()), 1e-3)
    depth_m = camera.fx_px * camera.baseline_m / nearest_px
    top_m = camera.mount_height_m + (camera.cy_px - candidate.segment.box_px[1]) / camera.fy_px * depth_m
    return float(np.clip(top_m, LEAST_HEIGHT_M, 1e3))
