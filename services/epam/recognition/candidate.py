"""Candidates for percepts: segments with walls and a recognition, joined if they are pieces of one
object.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from cogmap.geometry.arrays import Booleans, Bytes, Singles
from cogmap.schemas.sensing import Calibration
from cogmap.services.epam.recognition.objects import Recognition
from cogmap.services.epam.recognition.segments import Segment
from cogmap.services.epam.recognition.walls import Walls, walls

# How far a polygon may be from the outline that it simplifies.
OUTLINE_TOLERANCE_PX = 1.0
# Gaps that are bridged, each only if with smaller ones no piece has this share of the segment.
BRIDGED_PX = (9, 25, 65)
MIN_OUTLINED_SHARE = 0.9
# Pieces whose distances differ by more are of two objects.
MAX_DISPARITY_RATIO = 1.3
# Limits of a height, since a wrong disparity gives any.
MIN_HEIGHT_M = 0.5
MAX_HEIGHT_M = 1e3


@dataclass(frozen=True, eq=False)
class Candidate:
    """A segment with its walls, and what it was recognized as."""

    segment: Segment
    walls: Walls
    recognition: Recognition


def joined(pieces: Sequence[Candidate], disparity_px: Singles) -> Candidate:
    """Return the first of `pieces` joined with all that lie beside it at the same distance.

    All were recognized as one object; the others are mistaken for it and left out.
    """
    whole = pieces[0]
    for piece in pieces[1:]:
        if is_beside(whole, piece):
            segment = Segment.of(whole.segment.mask | piece.segment.mask)
            joined_walls = walls(segment, disparity_px) or whole.walls
            whole = replace(whole, segment=segment, walls=joined_walls)

    return whole


def is_beside(one: Candidate, other: Candidate) -> bool:
    """Return true if both may be pieces of one object: hardly a gap between them, and at the same
    distance.
    """
    gap_px = max(one.walls.left, other.walls.left) - min(one.walls.right, other.walls.right)
    one_px = float(np.median(one.walls.disparity_px))
    other_px = float(np.median(other.walls.disparity_px))
    is_at_one_distance = max(one_px, other_px) <= MAX_DISPARITY_RATIO * min(one_px, other_px)
    return gap_px <= BRIDGED_PX[-1] and is_at_one_distance


def outline_px(segment: Segment) -> list[tuple[int, int]]:
    """Return a polygon around `segment`, column and row of each corner; a lamp or a tree before the
    object does not divide it.

    If its pieces are farther apart, the polygon is around the largest.
    """
    left, top, width, height = segment.box_px
    shown = segment.mask[top : top + height, left : left + width].astype(np.uint8)

    # The smallest gaps are bridged that make one piece nearly the whole, else only small ones.
    pieces = (_largest_piece(shown, bridged_px) for bridged_px in BRIDGED_PX)
    required_px = MIN_OUTLINED_SHARE * shown.sum()
    nearly_whole = (piece for piece in pieces if shown[piece].sum() >= required_px)
    piece = next(nearly_whole, None)
    if piece is None:
        piece = _largest_piece(shown, BRIDGED_PX[0])

    contours, _ = cv2.findContours(
        piece.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE
    )
    polygon = cv2.approxPolyDP(max(contours, key=len), OUTLINE_TOLERANCE_PX, True)
    return [(left + column, top + row) for column, row in polygon[:, 0].tolist()]


def _largest_piece(shown: Bytes, bridged_px: int) -> Booleans:
    """Find the largest connected piece of `shown` (h, w), to which gaps of fewer than `bridged_px`
    columns belong.
    """
    # At the image's border, closing would fill the space between it and the segment.
    border = (0, 0, bridged_px, bridged_px)
    bordered = cv2.copyMakeBorder(shown, *border, cv2.BORDER_CONSTANT, value=0)
    closed = cv2.morphologyEx(bordered, cv2.MORPH_CLOSE, np.ones((1, bridged_px), np.uint8))
    bridged = np.asarray(closed[:, bridged_px:-bridged_px], np.uint8)

    _, component, stats, _ = cv2.connectedComponentsWithStats(bridged)
    largest = 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
    return np.asarray(component == largest)


def height_m(candidate: Candidate, camera: Calibration) -> float:
    """Return the height over the ground of the highest visible point."""
    nearest_px = float(candidate.walls.disparity_px.max())
    depth_m = camera.fx_px * camera.baseline_m / max(nearest_px, 1e-3)

    _, top, _, _ = candidate.segment.box_px
    upward = (camera.cy_px - top) / camera.fy_px
    top_m = camera.mount_height_m + upward * depth_m
    return float(np.clip(top_m, MIN_HEIGHT_M, MAX_HEIGHT_M))
