"""Objects and road recognized in a view (paper section 5.1): PAM nodes over threshold become
percepts.

Beyond the paper, a building without a node gets one in the first encounter, by its appearance.
"""

from __future__ import annotations

from collections.abc import Container, Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Singles
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import Calibration, LearnedObject, Percept
from cogmap.services.epam.association.prior import NOTHING_EXPECTED, Prior
from cogmap.services.epam.association.relations import NamedObject, beside
from cogmap.services.epam.config import Config
from cogmap.services.epam.layout.footprint_fit import Silhouette, locate
from cogmap.services.epam.layout.ground import project
from cogmap.services.epam.layout.road import RoadSegmenter
from cogmap.services.epam.recognition.candidate import (
    Candidate,
    height_m,
    is_beside,
    joined,
    outline_px,
)
from cogmap.services.epam.recognition.functions import function_of
from cogmap.services.epam.recognition.objects import (
    EmbeddingPass,
    ObjectRecognizer,
    Recognition,
)
from cogmap.services.epam.recognition.segments import Segment, Segmenter
from cogmap.services.epam.recognition.walls import Walls, walls
from cogmap.services.epam.view import ViewArrays

NEW_LABEL = "new-building-{}"
# Narrower segments are not recognized.
MIN_WIDTH_PX = 8
# An unknown building gets a PAM node if it covers at least this share of the view's pixels.
MIN_LEARNED_SHARE = 0.15
# A learned object gets another appearance if it is recognized with a higher evidence, and likelier
# than this shows most of the building.
SURE = 0.65
# A footprint's fit with a larger misfit, in standard deviations, or a larger standard deviation of
# its range, as a share of the range, is rejected: the object is placed as one of the usual size.
MAX_MISFIT = 2.0
MAX_RANGE_SD_SHARE = 0.15


@dataclass(frozen=True, eq=False)
class Perceived:
    """The objects of a view, its road and the road's boundary as ground points in the robot's
    frame, float32 (n, 2), and the nodes learned from it.
    """

    objects: list[Percept]
    road_m: Singles
    road_boundary_m: Singles
    learned: list[LearnedObject]


class Standing(NamedTuple):
    """Segments of a view that may be buildings, the walls of each, and their embedding, which is
    being computed.
    """

    segments: list[Segment]
    walls: list[Walls]
    embedding: list[EmbeddingPass]


class ExtendedPam:
    """The PAM nodes that were taught, and those learned since."""

    def __init__(
        self,
        config: Config,
        segmenter: Segmenter,
        recognizer: ObjectRecognizer,
        road_segmenter: RoadSegmenter,
    ) -> None:
        self._config = config
        self._segmenter = segmenter
        self._recognizer = recognizer
        self._road_segmenter = road_segmenter

    def perceive(
        self,
        view: ViewArrays,
        camera: Calibration,
        learning: bool = True,
        prior: Prior = NOTHING_EXPECTED,
    ) -> Perceived:
        """Return what is recognized in `view`, given what was expected by `prior`; with `learning`,
        new buildings get nodes.
        """
        road = self._road_segmenter.begin(view.image)
        standing = self._standing(view, camera)

        likelihood = road.likelihood()
        road_m, road_boundary_m = project(likelihood, view.depth_m, camera)

        candidates = self._recognizable(standing)
        found, learned = self._labelled(candidates, view, learning, prior)
        return Perceived(_percepts(found, camera), road_m, road_boundary_m, learned)

    def candidates(self, view: ViewArrays, camera: Calibration) -> list[Candidate]:
        """Return every segment that is wide enough and has known depth, whatever its activation,
        from left to right.
        """
        return self._recognizable(self._standing(view, camera))

    def _standing(self, view: ViewArrays, camera: Calibration) -> Standing:
        """Find the segments that are wide enough and have known depth."""
        segments = []
        of_segments = []
        for segment in self._segmenter.segments(view.image, view.depth_m, camera):
            _, _, width, _ = segment.box_px
            of_segment = walls(segment, view.disparity_px)
            if of_segment is not None and width >= MIN_WIDTH_PX:
                segments.append(segment)
                of_segments.append(of_segment)

        embedding = self._recognizer.begin(view.image, view.depth_m, segments, camera)
        return Standing(segments, of_segments, embedding)

    def _recognizable(self, standing: Standing) -> list[Candidate]:
        """Recognize the candidates of these segments, without a prior."""
        appearances = self._recognizer.appearances(standing.embedding)
        return [
            Candidate(segment, of_segment, self._recognizer.recognize(appearance))
            for segment, of_segment, appearance in zip(
                standing.segments, standing.walls, appearances, strict=True
            )
        ]

    def restore(self, objects: Iterable[LearnedObject]) -> None:
        """Recognize these nodes again."""
        for known in objects:
            embedding = known.embedding.numpy().astype(np.float32)
            self._recognizer.learn(known.label, embedding)

    @property
    def learned(self) -> list[LearnedObject]:
        """Return every node learned since the teaching."""
        return [
            LearnedObject(label=label, embedding=Array.of(embedding))
            for label, embedding in self._recognizer.learned
        ]

    def _labelled(
        self, candidates: list[Candidate], view: ViewArrays, learning: bool, prior: Prior
    ) -> tuple[list[Candidate], list[LearnedObject]]:
        """Return the percepts, at most one a label, from left to right, and what was learned.

        Candidates are labelled in the order of their activation, so that of two with one label the
        likelier one has it.
        """
        pieces: dict[str, list[Candidate]] = {}
        learned: list[LearnedObject] = []

        for first in sorted(candidates, key=lambda each: each.recognition.activation, reverse=True):
            named = {
                label: NamedObject(same[0].walls.middle, same[0].recognition.evidence)
                for label, same in pieces.items()
            }
            expected = prior.where(beside(first.walls.middle, named))
            candidate = self._recognized(first, expected)

            # No object is in two places.
            same = pieces.get(candidate.recognition.label)
            if same is not None and not is_beside(same[0], candidate):
                candidate = self._recognized(candidate, expected, excluded=pieces)

            recognition = candidate.recognition
            if 1 - recognition.background <= self._config.percept_threshold:
                continue

            # New: well visible, and recognized as nothing with enough activation.
            segment = candidate.segment
            is_taught = self._recognizer.is_taught(recognition.label)
            is_new = (
                segment.area_px >= MIN_LEARNED_SHARE * segment.mask.size
                and recognition.appearance.whole > self._config.percept_threshold
                and recognition.activation
                <= (self._config.familiar if is_taught else self._config.familiar_learned)
            )
            if learning and is_new:
                number = 1 + len({label for label, _ in self._recognizer.learned})
                learned.append(self._learn(NEW_LABEL.format(number), recognition))
                candidate = self._recognized(candidate, expected)
            elif (
                learning
                and recognition.label not in pieces
                and min(recognition.evidence, recognition.appearance.whole) > SURE
                and self._recognizer.is_new_appearance(recognition)
            ):
                learned.append(self._learn(recognition.label, recognition))

            pieces.setdefault(candidate.recognition.label, []).append(candidate)

        found = [joined(parts, view.disparity_px) for parts in pieces.values()]
        found.sort(key=lambda candidate: candidate.walls.left)
        return found, learned

    def _recognized(
        self, candidate: Candidate, prior: Prior, excluded: Container[str] = ()
    ) -> Candidate:
        """Recognize `candidate` by all that is known by now, except by labels `excluded`."""
        log_prior = prior.log_ratio(self._recognizer.labels)
        appearance = candidate.recognition.appearance
        recognition = self._recognizer.recognize(appearance, excluded, log_prior)
        return replace(candidate, recognition=recognition)

    def _learn(self, label: str, recognition: Recognition) -> LearnedObject:
        embedding = recognition.appearance.embedding
        self._recognizer.learn(label, embedding)
        return LearnedObject(label=label, embedding=Array.of(embedding))


def _percepts(found: list[Candidate], camera: Calibration) -> list[Percept]:
    """Place each percept by its known footprint if that fits what is seen, else as a building of
    the usual size.
    """
    # Those whose size is known, and of which at least one true end is seen.
    silhouettes: list[Silhouette | None] = []
    for candidate in found:
        size_m = candidate.recognition.size_m
        seen = candidate.walls
        if size_m is not None and (seen.left_true or seen.right_true):
            silhouettes.append(seen.silhouette(size_m[:2]))
        else:
            silhouettes.append(None)
    located = iter(locate([each for each in silhouettes if each is not None], camera))

    percepts = []
    for candidate, silhouette in zip(found, silhouettes, strict=True):
        pose = next(located) if silhouette is not None else None
        if (
            pose is None
            or pose.range_sd_m > MAX_RANGE_SD_SHARE * pose.range_m
            or pose.misfit > MAX_MISFIT
        ):
            pose = candidate.walls.usual_pose(camera)

        recognition = candidate.recognition
        if recognition.size_m is None:
            width_m, top_m = candidate.walls.width_m(camera), height_m(candidate, camera)
        else:
            longer_m, shorter_m, top_m = recognition.size_m
            width_m = (longer_m + shorter_m) / 2

        percepts.append(
            Percept(
                label=recognition.label,
                activation=recognition.activation,
                evidence=recognition.evidence,
                bearing_rad=pose.bearing_rad,
                range_m=pose.range_m,
                bearing_sd_rad=pose.bearing_sd_rad,
                range_sd_m=pose.range_sd_m,
                width_m=width_m,
                height_m=top_m,
                whole=candidate.walls.whole,
                box_px=candidate.segment.box_px,
                outline_px=outline_px(candidate.segment),
                function=function_of(recognition.label),
            )
        )

    return percepts
