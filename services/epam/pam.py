"""Objects and road recognized in a view (paper section 5.1): PAM nodes over threshold become
percepts.

Which building it is, of those that look alike or have no name, is found where all that is known of
the town is: in the workspace. A percept says what its view shows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

from cogmap.geometry.arrays import Singles
from cogmap.schemas.sensing import Calibration, Percept
from cogmap.services.epam.association.prior import NOTHING_EXPECTED, Prior
from cogmap.services.epam.association.relations import NamedObject, beside
from cogmap.services.epam.config import Config
from cogmap.services.epam.layout.footprint_fit import ObjectPose, locate
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
)
from cogmap.services.epam.recognition.segments import Segment, Segmenter
from cogmap.services.epam.recognition.taught_share import TaughtShare
from cogmap.services.epam.recognition.walls import MAX_RANGE_M, Walls, walls
from cogmap.services.epam.view import ViewArrays

# Narrower segments are not recognized.
MIN_WIDTH_PX = 8
# Segments beside each other are pieces of one building if their looks have a higher cosine.
SAME_COSINE = 0.9
# How probable another name must be to be published.
MIN_EVIDENCE = 0.02
# The sides of a building whose size is not known, as the simulator's catalogue has them, with their
# standard deviations; and that of sides that were taught.
USUAL_SIDES_M = (9.5, 9.5)
USUAL_SIDES_SD_M = (2.2, 2.2)
TAUGHT_SIDES_SD_M = (0.02, 0.02)
# Beside the fit's own: the shape is not known to be a rectangle, nor an end to be the object's.
UNKNOWN_SHAPE_SD_M = 0.7
# A footprint whose sides were taught and that fits worse, in standard deviations, is of another
# building: one of the usual size.
MAX_MISFIT = 2.0
# A fit that knows the place no better than this share of the range says less than the walls do.
MAX_SD_SHARE = 0.5
# What no footprint fits is placed so many times worse than what has its ends hidden (chosen on 270
# views of three towns of blocks; of those whose fit was unsure, 44 % were beyond two standard
# deviations before).
UNFITTED_WIDER = 2.0


@dataclass(frozen=True, eq=False)
class Perceived:
    """The objects of a view, its road and the road's boundary as ground points in the robot's
    frame, float32 (n, 2).
    """

    objects: list[Percept]
    road_m: Singles
    road_boundary_m: Singles


class Standing(NamedTuple):
    """Segments of a view that may be buildings, the walls of each, and their embedding, which is
    being computed.
    """

    segments: list[Segment]
    walls: list[Walls]
    embedding: list[EmbeddingPass]


class ExtendedPam:
    """The PAM nodes that were taught, and how many of the buildings seen so far they stand for."""

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
        self.taught_share = TaughtShare(recognizer.taught_share)

    def perceive(
        self,
        view: ViewArrays,
        camera: Calibration,
        prior: Prior = NOTHING_EXPECTED,
        *,
        learning: bool = True,
    ) -> Perceived:
        """Return what is recognized in `view`, given what was expected by `prior`. Its buildings
        count for the share that was taught, if it is `learning`.
        """
        road = self._road_segmenter.begin(view.image)
        standing = self._standing(view, camera)

        likelihood = road.likelihood()
        road_m, road_boundary_m = project(likelihood, view.depth_m, camera)

        candidates = self._recognizable(standing)
        if learning:
            self.taught_share.add(candidate.recognition for candidate in candidates)
        found = self._found(candidates, view, prior)
        return Perceived(self._percepts(found, camera), road_m, road_boundary_m)

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

    def _found(
        self, candidates: list[Candidate], view: ViewArrays, prior: Prior
    ) -> list[Candidate]:
        """Return the candidates that are buildings, from left to right: pieces of one are joined.

        They are recognized in the order of their activation, so that of neighbours the likelier one
        is expected beside the other.
        """
        buildings: list[list[Candidate]] = []
        named: dict[str, NamedObject] = {}
        for first in sorted(candidates, key=lambda each: each.recognition.activation, reverse=True):
            expected = prior.where(beside(first.walls.middle, named))
            candidate = self._recognized(first, expected)
            recognition = candidate.recognition
            if 1 - recognition.background <= self._config.percept_threshold:
                continue

            whole = next((parts for parts in buildings if _is_piece(candidate, parts[0])), None)
            if whole is not None:
                whole.append(candidate)
                continue

            buildings.append([candidate])
            if recognition.known:
                middle = candidate.walls.middle
                named.setdefault(recognition.label, NamedObject(middle, recognition.evidence))

        found = [joined(parts, view.disparity_px) for parts in buildings]
        return sorted(found, key=lambda candidate: candidate.walls.left)

    def _recognized(self, candidate: Candidate, prior: Prior) -> Candidate:
        """Recognize `candidate` given what is expected."""
        log_prior = prior.log_ratio(self._recognizer.labels)
        appearance = candidate.recognition.appearance
        log_taught = self.taught_share.log_ratio
        recognition = self._recognizer.recognize(appearance, log_prior, log_taught)
        return replace(candidate, recognition=recognition)

    def _percepts(self, found: list[Candidate], camera: Calibration) -> list[Percept]:
        """Return the percept of each candidate, where it stands."""
        percepts = []
        for candidate, pose in zip(found, _poses(found, camera), strict=True):
            recognition = candidate.recognition
            top_m = height_m(candidate, camera)
            if recognition.size_m is not None:
                _, _, top_m = recognition.size_m

            # What has no name is as active as it is a building.
            name = recognition.label if recognition.known else ""
            activation = recognition.activation if name else 1 - recognition.background
            names = {
                each: value for each, value in recognition.names.items() if value > MIN_EVIDENCE
            }
            evidence = names.pop(name, 0.0)
            percepts.append(
                Percept(
                    name=name,
                    names=names,
                    appearance=self._recognizer.published(recognition.appearance),
                    activation=activation,
                    evidence=evidence,
                    bearing_rad=pose.bearing_rad,
                    range_m=pose.range_m,
                    bearing_sd_rad=pose.stated_bearing_sd_rad,
                    range_sd_m=pose.range_sd_m,
                    width_m=pose.width_m,
                    height_m=top_m,
                    whole=candidate.walls.whole,
                    box_px=candidate.segment.box_px,
                    outline_px=outline_px(candidate.segment),
                    function=function_of(name),
                )
            )

        return percepts


def _poses(found: list[Candidate], camera: Calibration) -> list[ObjectPose]:
    """Place each candidate by its known footprint if that fits what is seen, else by one of about
    the usual size, and by its walls alone if no true end of it is seen.
    """
    bounded = [
        number
        for number, candidate in enumerate(found)
        if candidate.walls.left_true or candidate.walls.right_true
    ]
    taught_m = {}
    for number in bounded:
        size_m = found[number].recognition.size_m
        if size_m is not None:
            taught_m[number] = size_m[:2]

    taught = _fitted(found, taught_m, TAUGHT_SIDES_SD_M, camera)
    poses = {number: pose for number, pose in taught.items() if pose.misfit <= MAX_MISFIT}

    usual_m = {number: USUAL_SIDES_M for number in bounded if number not in poses}
    for number, pose in _fitted(found, usual_m, USUAL_SIDES_SD_M, camera).items():
        fitted = pose.widened(max(1.0, pose.misfit)).blurred(UNKNOWN_SHAPE_SD_M)
        if fitted.range_m > MAX_RANGE_M or fitted.sd_m > MAX_SD_SHARE * fitted.range_m:
            fitted = found[number].walls.usual_pose(camera).widened(UNFITTED_WIDER)
        poses[number] = fitted

    return [
        poses[number] if number in poses else candidate.walls.usual_pose(camera)
        for number, candidate in enumerate(found)
    ]


def _fitted(
    found: list[Candidate],
    sides_m: Mapping[int, tuple[float, float]],
    sides_sd_m: tuple[float, float],
    camera: Calibration,
) -> dict[int, ObjectPose]:
    """Fit footprints of these sides to some of the candidates, by their number."""
    silhouettes = [
        found[number].walls.silhouette(each_m, sides_sd_m) for number, each_m in sides_m.items()
    ]
    return dict(zip(sides_m, locate(silhouettes, camera), strict=True))


def _is_piece(candidate: Candidate, whole: Candidate) -> bool:
    """Decide whether a candidate is another piece of a building: it stands beside it, and has its
    name or looks the same.
    """
    one = candidate.recognition
    other = whole.recognition
    cosine = float(one.appearance.embedding @ other.appearance.embedding)
    has_name = one.known and other.known and one.label == other.label
    return (has_name or cosine > SAME_COSINE) and is_beside(whole, candidate)
