"""What percepts are of: segments matched to true buildings, and what is right about them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from schemas.sensing import Percept

MATCH_IOU = 0.5
LARGE_SHARE = 0.01
BINS = 15
Bools = npt.NDArray[np.bool_]
Bytes = npt.NDArray[np.uint8]
# Label, activation and pixels (h, w) of what is taken for a building.
Claim = tuple[str, float, Bools]


@dataclass(frozen=True)
class Building:
    """A true building in a view: which of the town's, of what kind, how much of the image it
    covers, how far it is.
    """

    number: int
    kind: str
    share: float
    range_m: float


@dataclass(frozen=True)
class Segment:
    """A claim: its name and activation, how much of the image it covers, which building it matches,
    if any, and which it shows: the one that half of its pixels are of.
    """

    label: str
    activation: float
    share: float
    building: Building | None
    shows: Building | None


@dataclass(frozen=True)
class Sight:
    """One view: the true buildings in it, and what was taken for one."""

    buildings: tuple[Building, ...]
    segments: tuple[Segment, ...]


def sight(
    claims: Sequence[Claim], label: Bytes, kinds: Sequence[str], range_m: Sequence[float]
) -> Sight:
    """What is claimed of a view against its true `label` (h, w): 0 or 1 + place in `kinds` and
    `range_m`.
    """
    numbers, counts = np.unique(label[label > 0], return_counts=True)
    buildings = tuple(
        Building(number - 1, kinds[number - 1], count / label.size, range_m[number - 1])
        for number, count in zip(numbers.tolist(), counts.tolist(), strict=True)
    )
    masks = [mask for _, _, mask in claims]
    matched = match(overlaps(masks, label, [building.number + 1 for building in buildings]))
    segments = []
    for (name, activation, mask), place in zip(claims, matched, strict=True):
        shown = np.bincount(label[mask], minlength=1)
        most = [
            each
            for each in buildings
            if each.number + 1 < len(shown) and 2 * shown[each.number + 1] >= mask.sum()
        ]
        matching = None if place is None else buildings[place]
        segments.append(
            Segment(name, activation, float(mask.mean()), matching, most[0] if most else None)
        )
    return Sight(buildings, tuple(segments))


def claims(percepts: Sequence[Percept], shape: tuple[int, ...]) -> list[Claim]:
    """What `percepts` of a view of that shape say: label, activation, pixels."""
    return [(percept.label, percept.activation, filled(percept, shape)) for percept in percepts]


def filled(percept: Percept, shape: tuple[int, ...]) -> Bools:
    """The pixels that the percept's outline holds, (h, w)."""
    mask = np.zeros(shape, np.uint8)
    if len(percept.outline_px) >= 3:
        cv2.fillPoly(mask, [np.array(percept.outline_px, np.int32)], 1)
    return mask > 0


def overlaps(
    found: Sequence[Bools], label: Bytes, numbers: Sequence[int]
) -> npt.NDArray[np.float64]:
    """Intersection over union of each mask with the pixels of each number in `label`, (masks,
    numbers).
    """
    iou = np.zeros((len(found), len(numbers)))
    for column, number in enumerate(numbers):
        true = label == number
        for row, mask in enumerate(found):
            either = np.count_nonzero(mask | true)
            iou[row, column] = np.count_nonzero(mask & true) / either if either else 0.0
    return iou


def match(iou: npt.NDArray[np.float64]) -> list[int | None]:
    """For each row the column that it matches at MATCH_IOU or better, the best pairs first, none
    twice.
    """
    matched: list[int | None] = [None] * iou.shape[0]
    left = iou.copy()
    while left.size and left.max() >= MATCH_IOU:
        row, column = np.unravel_index(left.argmax(), left.shape)
        matched[int(row)] = int(column)
        left[row] = left[:, column] = -1.0
    return matched


def named(
    sights: Iterable[Sight], trained: frozenset[str], least_m: float, most_m: float
) -> list[bool]:
    """Of each segment that matches a building of a trained kind so far away, whether its label is
    right.
    """
    return [
        segment.label == segment.building.kind
        for each in sights
        for segment in each.segments
        if segment.building
        and segment.building.kind in trained
        and least_m <= segment.building.range_m <= most_m
    ]


def detection(
    sights: Iterable[Sight], least_share: float = LARGE_SHARE
) -> tuple[int, int, int, int]:
    """Of large buildings how many were found, and how many there are; of large segments how many
    match, and all.
    """
    found = there = right = said = 0
    for each in sights:
        matched = {segment.building.number for segment in each.segments if segment.building}
        large = [building for building in each.buildings if building.share >= least_share]
        there += len(large)
        found += sum(building.number in matched for building in large)
        segments = [segment for segment in each.segments if segment.share >= least_share]
        said += len(segments)
        right += sum(segment.building is not None for segment in segments)
    return found, there, right, said


def right_or_not(
    candidates: Iterable[Sight], percepts: Iterable[Sight], trained: frozenset[str]
) -> list[tuple[float, bool]]:
    """Activation of each candidate, and whether its label is right, over the views of one pair of
    eyes in order.

    That of a trained class is right where the building is of that kind, that of a node that was
    learned where the building is the one whose percept it was first given to, and no label where
    there is no building, or one that has none yet.
    """
    owner: dict[str, int | None] = {}
    judged: list[tuple[float, bool]] = []
    for before, after in zip(candidates, percepts, strict=True):
        judged += [
            (segment.activation, _right(segment, owner, trained)) for segment in before.segments
        ]
        for segment in (each for each in after.segments if each.label not in trained):
            owner.setdefault(segment.label, segment.shows.number if segment.shows else None)
    return judged


def _right(segment: Segment, owner: dict[str, int | None], trained: frozenset[str]) -> bool:
    building = segment.shows
    if building is None:
        return not segment.label
    if segment.label in trained or building.kind in trained:
        return segment.label == building.kind
    if not segment.label:
        return building.number not in owner.values()
    return owner.get(segment.label) == building.number


def calibration_error(judged: Sequence[tuple[float, bool]]) -> float:
    """Expected calibration error (Naeini, Cooper and Hauskrecht 2015): BINS bins of equal width,
    NaN of nothing.
    """
    if not judged:
        return float("nan")
    sure, right = (np.asarray(values, np.float64) for values in zip(*judged, strict=True))
    which = np.minimum((sure * BINS).astype(int), BINS - 1)
    gaps = np.bincount(which, right - sure, minlength=BINS)
    return float(np.abs(gaps).sum() / len(sure))
