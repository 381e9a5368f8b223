"""Segments matched to the true buildings of a view, and whether their labels are right."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from cogmap.geometry.arrays import Booleans, Bytes, Floats
from cogmap.schemas.sensing import Percept

MATCH_IOU = 0.5
LARGE_SHARE = 0.01
BINS = 15
MAX_LABELS = 256
# Label, activation and pixels (h, w) of what is taken for a building.
Claim = tuple[str, float, Booleans]


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
    """Compare the claims of a view with its true `label` (h, w): 0 or 1 + place in `kinds` and
    `range_m`.
    """
    numbers, pixels = np.unique(label[label > 0], return_counts=True)
    buildings = []
    for number, count in zip(numbers.tolist(), pixels.tolist(), strict=True):
        place = number - 1
        buildings.append(
            Building(place, kinds[place], share=count / label.size, range_m=range_m[place])
        )

    masks = [mask for _, _, mask in claims]
    iou = overlaps(masks, label, numbers.tolist())
    segments = []
    for (name, activation, mask), matched in zip(claims, match(iou), strict=True):
        counts = np.bincount(label[mask], minlength=MAX_LABELS)
        shown = [each for each in buildings if counts[each.number + 1] >= mask.sum() / 2]
        segment = Segment(
            label=name,
            activation=activation,
            share=float(mask.mean()),
            building=None if matched is None else buildings[matched],
            shows=shown[0] if shown else None,
        )
        segments.append(segment)

    return Sight(tuple(buildings), tuple(segments))


def claims(percepts: Sequence[Percept], shape: tuple[int, ...]) -> list[Claim]:
    """Return the claims of the `percepts` of a view of that shape."""
    found = []
    for percept in percepts:
        pixels = filled(percept, shape)
        found.append((percept.name, percept.activation, pixels))

    return found


def filled(percept: Percept, shape: tuple[int, ...]) -> Booleans:
    """Mark the pixels that the percept's outline holds, (h, w)."""
    mask = np.zeros(shape, np.uint8)
    outline_px = np.array(percept.outline_px, np.int32)
    if len(outline_px) >= 3:
        cv2.fillPoly(mask, [outline_px], 1)

    return mask > 0


def overlaps(found: Sequence[Booleans], label: Bytes, numbers: Sequence[int]) -> Floats:
    """Compute intersection over union of each mask with the pixels of each number in `label`,
    (masks, numbers).
    """
    shape = (len(found), len(numbers))
    iou = np.zeros(shape)

    for column, number in enumerate(numbers):
        true = label == number
        for row, mask in enumerate(found):
            union = np.count_nonzero(mask | true)
            if union:
                iou[row, column] = np.count_nonzero(mask & true) / union

    return iou


def match(iou: Floats) -> list[int | None]:
    """Find for each row the column that it matches at MATCH_IOU or better, the best pairs first,
    none twice.
    """
    matched: list[int | None] = [None] * len(iou)
    left = iou.copy()

    while left.size and left.max() >= MATCH_IOU:
        best = int(left.argmax())
        row, column = divmod(best, left.shape[1])
        matched[row] = column

        left[row] = -1.0
        left[:, column] = -1.0

    return matched


def named(
    sights: Iterable[Sight], trained: frozenset[str], min_m: float, max_m: float
) -> list[bool]:
    """Decide for each segment that matches a building of a trained kind at that distance whether
    its label is right.
    """
    right = []

    for segment in (segment for view in sights for segment in view.segments):
        building = segment.building
        if building is None or building.kind not in trained:
            continue
        if min_m <= building.range_m <= max_m:
            right.append(segment.label == building.kind)

    return right


def detection(sights: Iterable[Sight], min_share: float = LARGE_SHARE) -> tuple[int, int, int, int]:
    """Count how many large buildings were found, and how many there are; how many large segments
    match, and all.
    """
    found = 0
    there = 0
    right = 0
    claimed = 0

    for view in sights:
        matched = {segment.building.number for segment in view.segments if segment.building}

        for building in view.buildings:
            if building.share >= min_share:
                there += 1
                found += building.number in matched

        for segment in view.segments:
            if segment.share >= min_share:
                claimed += 1
                right += segment.building is not None

    return found, there, right, claimed


def right_or_not(
    candidates: Iterable[Sight], percepts: Iterable[Sight], trained: frozenset[str]
) -> list[tuple[float, bool]]:
    """Return the activation of each candidate, and whether its label is right, over the views of
    one pipeline in order.

    The label of a trained class is right if the building is of that kind. The label of a node that
    was learned is right if the building is the one whose percept it was first given to. No label is
    right if there is no building, or one that has none yet.
    """
    owner: dict[str, int | None] = {}
    judged: list[tuple[float, bool]] = []

    for before, after in zip(candidates, percepts, strict=True):
        for segment in before.segments:
            building = segment.shows
            if building is None:
                is_right = not segment.label
            elif segment.label in trained or building.kind in trained:
                is_right = segment.label == building.kind
            elif not segment.label:
                is_right = building.number not in owner.values()
            else:
                is_right = owner.get(segment.label) == building.number

            judged.append((segment.activation, is_right))

        for segment in after.segments:
            if segment.label not in trained:
                shown = segment.shows.number if segment.shows else None
                owner.setdefault(segment.label, shown)

    return judged


def calibration_error(judged: Sequence[tuple[float, bool]]) -> float:
    """Compute the expected calibration error (Naeini, Cooper and Hauskrecht 2015): BINS bins of
    equal width, NaN of nothing.
    """
    if not judged:
        return float("nan")

    activation, right = np.array(judged, np.float64).T
    scaled = (activation * BINS).astype(int)
    bins = np.minimum(scaled, BINS - 1)

    gaps = np.bincount(bins, right - activation, minlength=BINS)
    total = np.abs(gaps).sum()
    return float(total) / len(activation)
