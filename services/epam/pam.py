"""Objects and road recognized in a view (paper section 5.1): PAM nodes over threshold become
percepts.

Beyond the paper, a building without a node gets one in the first encounter, by its appearance.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Singles
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import Calibration, LearnedObject, Percept
from cogmap.services.epam.association.prior import NOTHING_EXPECTED, Prior
from cogmap.services.epam.association.relations import Seen, beside
from cogmap.services.epam.config import Config
from cogmap.services.epam.layout.footprint_fit import ObjectPose, Silhouette, locate
from cogmap.services.epam.layout.ground import project
from cogmap.services.epam.layout.road import RoadSegmenter
from cogmap.services.epam.layout.walls import Walls, walls
from cogmap.services.epam.recognition.candidate import (
    Candidate,
    height_m,
    is_beside,
    joined,
    outline_px,
)
from cogmap.services.epam.recognition.functions import function_of
from cogmap.services.epam.recognition.objects import (
    Appearance,
    EmbeddingPass,
    ObjectRecognizer,
    Recognition,
)
from cogmap.services.epam.recognition.segments import Segment, Segmenter
from cogmap.services.epam.view import ViewArrays

NEW_LABEL = "new-building-{}"


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
        """Return what is recognized in `view`, where `prior` was expected; with `learning`, new
        buildings get nodes.
        """
        road = self._road_segmenter.begin(view.image)
        standing = self._standing(view, camera)

        likelihood = road.likelihood()
        road_m, road_boundary_m = project(likelihood, view.depth_m, camera)

        candidates = self._recognizable(standing)
        found, learned = self._labelled(candidates, view, learning, prior)
        objects = self._percepts(found, camera)
        return Perceived(
            objects=objects,
            road_m=road_m,
            road_boundary_m=road_boundary_m,
            learned=learned,
        )

    def candidates(self, view: ViewArrays, camera: Calibration) -> list[Candidate]:
        """Return every segment that is wide enough and has known depth, whatever its activation,
        from left to right.
        """
        return self._recognizable(self._standing(view, camera))

    def _standing(self, view: ViewArrays, camera: Calibration) -> Standing:
        """The segments that are wide enough and have known depth."""
        segments = []
        of_segments = []
        narrowest_px = self._config.narrowest_px

        for segment in self._segmenter.segments(view.image, view.depth_m, camera):
            _, _, width, _ = segment.box_px
            of_segment = walls(segment, view.disparity_px)
            if of_segment is not None and width >= narrowest_px:
                segments.append(segment)
                of_segments.append(of_segment)

        embedding = self._recognizer.begin(view.image, view.depth_m, segments, camera)
        return Standing(segments, of_segments, embedding)

    def _recognizable(self, standing: Standing) -> list[Candidate]:
        """What stands there, recognized without a prior."""
        appearances = self._recognizer.appearances(standing.embedding)

        candidates = []
        for segment, of_segment, appearance in zip(
            standing.segments, standing.walls, appearances, strict=True
        ):
            recognition = self._recognizer.recognize(appearance)
            candidates.append(Candidate(segment, of_segment, recognition))

        return candidates

    def restore(self, objects: Iterable[LearnedObject]) -> None:
        """Recognize these nodes again."""
        for known in objects:
            embedding = known.embedding.numpy().astype(np.float32)
            self._recognizer.learn(known.label, embedding)

    @property
    def learned(self) -> list[LearnedObject]:
        """Every node learned since the teaching."""
        nodes = []
        for label, embedding in self._recognizer.learned:
            nodes.append(_learned(label, embedding))

        return nodes

    def _labelled(
        self, candidates: list[Candidate], view: ViewArrays, learning: bool, prior: Prior
    ) -> tuple[list[Candidate], list[LearnedObject]]:
        """The percepts, at most one of each label, from left to right, and what was learned.

        Candidates are labelled in the order of their activation, so that of two with one label the
        likelier one has it.
        """
        pieces: dict[str, list[Candidate]] = {}
        learned: list[LearnedObject] = []

        for first in sorted(candidates, key=_activation, reverse=True):
            expected = prior.where(_relations(first, pieces))
            recognized = self._recognized(first, expected)
            candidate = self._in_one_place(recognized, pieces, expected)
            recognition = candidate.recognition
            if 1 - recognition.background <= self._config.percept_threshold:
                continue

            if learning and self._is_new(candidate):
                learned.append(self._learn(self._next_label(), recognition.appearance))
                candidate = self._recognized(candidate, expected)
            elif learning and recognition.label not in pieces and self._looks_new(recognition):
                learned.append(self._learn(recognition.label, recognition.appearance))

            pieces.setdefault(candidate.recognition.label, []).append(candidate)

        found = [joined(parts, view.disparity_px) for parts in pieces.values()]
        found.sort(key=lambda candidate: candidate.walls.left)
        return found, learned

    def _recognized(
        self, candidate: Candidate, prior: Prior, excluded: Container[str] = ()
    ) -> Candidate:
        """`candidate` recognized by all that is known by now, except by labels `excluded`."""
        log_prior = prior.log_ratio(self._recognizer.labels)
        appearance = candidate.recognition.appearance
        recognition = self._recognizer.recognize(appearance, excluded, log_prior)
        return replace(candidate, recognition=recognition)

    def _in_one_place(
        self, candidate: Candidate, pieces: Mapping[str, list[Candidate]], prior: Prior
    ) -> Candidate:
        """`candidate`, recognized as nothing that is elsewhere in the same view: no object is in
        two places.
        """
        same = pieces.get(candidate.recognition.label)
        if same is None or is_beside(same[0], candidate):
            return candidate

        return self._recognized(candidate, prior, excluded=pieces)

    def _is_new(self, candidate: Candidate) -> bool:
        """Whether it is well visible, and recognized as nothing with enough activation."""
        segment = candidate.segment
        min_area_px = self._config.learned_share * segment.mask.size
        if segment.area_px < min_area_px:
            return False

        recognition = candidate.recognition
        if recognition.appearance.whole <= self._config.percept_threshold:
            return False
        is_taught = self._recognizer.is_taught(recognition.label)
        familiar = self._config.familiar if is_taught else self._config.familiar_learned
        return recognition.activation <= familiar

    def _looks_new(self, recognition: Recognition) -> bool:
        """Whether it is likely a learned building, in an appearance that was not learned."""
        whole = recognition.appearance.whole
        certainty = min(recognition.evidence, whole)
        if certainty <= self._config.sure:
            return False
        return self._recognizer.is_new_appearance(recognition)

    def _next_label(self) -> str:
        learned = self._recognizer.learned
        labels = {label for label, _ in learned}

        number = 1 + len(labels)
        return NEW_LABEL.format(number)

    def _learn(self, label: str, appearance: Appearance) -> LearnedObject:
        self._recognizer.learn(label, appearance.embedding)
        return _learned(label, appearance.embedding)

    def _percepts(self, found: list[Candidate], camera: Calibration) -> list[Percept]:
        poses = self._poses(found, camera)

        percepts = []
        for candidate, pose in zip(found, poses, strict=True):
            percepts.append(self._percept(candidate, pose, camera))

        return percepts

    def _poses(self, found: list[Candidate], camera: Calibration) -> list[ObjectPose]:
        """The pose of each: by its known footprint if that fits what is seen, else as a building of
        the usual size.
        """
        silhouettes = [_silhouette(candidate) for candidate in found]
        located = [each for each in silhouettes if each is not None]
        remaining = iter(locate(located, camera))

        poses = []
        for candidate, silhouette in zip(found, silhouettes, strict=True):
            pose = next(remaining) if silhouette is not None else None
            if pose is None or not self._is_credible(pose):
                pose = candidate.walls.usual_pose(camera)
            poses.append(pose)

        return poses

    def _is_credible(self, pose: ObjectPose) -> bool:
        max_range_sd_m = self._config.worst_range_sd_share * pose.range_m
        if pose.range_sd_m > max_range_sd_m:
            return False
        return pose.misfit <= self._config.worst_misfit

    def _percept(self, candidate: Candidate, pose: ObjectPose, camera: Calibration) -> Percept:
        recognition = candidate.recognition
        width_m, top_m = _width_and_height_m(candidate, camera)

        return Percept(
            label=recognition.label,
            activation=min(1.0, self._config.base_level + recognition.activation),
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


def _width_and_height_m(candidate: Candidate, camera: Calibration) -> tuple[float, float]:
    """By the known size, the width being the mean of both sides; else by what is seen."""
    size_m = candidate.recognition.size_m
    if size_m is None:
        return candidate.walls.width_m(camera), height_m(candidate, camera)

    longer_m, shorter_m, top_m = size_m
    return (longer_m + shorter_m) / 2, top_m


def _activation(candidate: Candidate) -> float:
    return candidate.recognition.activation


def _relations(candidate: Candidate, pieces: Mapping[str, list[Candidate]]) -> dict[str, float]:
    """The relations in which a candidate stands to those that have a label, with the activation
    that these relations have by the evidence of the view.
    """
    named = {}
    for label, same in pieces.items():
        first = same[0]
        named[label] = Seen(_column(first), first.recognition.evidence)

    return beside(_column(candidate), named)


def _column(candidate: Candidate) -> float:
    """The middle column of what is seen of it."""
    return (candidate.walls.left + candidate.walls.right) / 2


def _silhouette(candidate: Candidate) -> Silhouette | None:
    """None unless the size is known and at least one true end is seen."""
    size_m = candidate.recognition.size_m
    if size_m is None:
        return None

    seen = candidate.walls
    if not seen.left_true and not seen.right_true:
        return None

    longer_m, shorter_m, _ = size_m
    return seen.silhouette((longer_m, shorter_m))


def _learned(label: str, embedding: Singles) -> LearnedObject:
    return LearnedObject(label=label, embedding=Array.of(embedding))
