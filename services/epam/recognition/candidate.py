"""Candidates for percepts: segments with walls and a recognition, joined where they are pieces of
one object.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from cogmap.geometry.arrays import Booleans, Bytes, Singles
from cogmap.schemas.sensing import Calibration
from cogmap.services.epam.layout.walls import Walls, walls
from cogmap.services.epam.recognition.objects import Recognition
from cogmap.services.epam.recognition.segments import Segment

OUTLINE_TOLERANCE_PX = 1.0
BRIDGED_PX = (9, 25, 65)
MIN_OUTLINED_SHARE = 0.9
MAX_DISPARITY_RATIO = 1.3
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

    All were recognized as one object; what lies elsewhere is mistaken for it and left out.
    """
    whole = pieces[0]
    for piece in pieces[1:]:
        if not is_beside(whole, piece):
            continue
        mask = whole.segment.mask | piece.segment.mask
        segment = Segment.of(mask)
        joined_walls = walls(segment, disparity_px) or whole.walls
        whole = replace(whole, segment=segment, walls=joined_walls)

    return whole


def is_beside(one: Candidate, other: Candidate) -> bool:
    """Return whether both may be pieces of one object: hardly a gap between them, and at the same
    distance.
    """
    gap_px = _gap_px(one.walls, other.walls)
    if gap_px > BRIDGED_PX[-1]:
        return False

    one_px = float(np.median(one.walls.disparity_px))
    other_px = float(np.median(other.walls.disparity_px))

    near_px = max(one_px, other_px)
    far_px = min(one_px, other_px)
    return near_px <= MAX_DISPARITY_RATIO * far_px


def _gap_px(one: Walls, other: Walls) -> float:
    """The columns between both, negative where they overlap."""
    begin = max(one.left, other.left)
    end = min(one.right, other.right)
    return begin - end


def outline_px(segment: Segment) -> list[tuple[int, int]]:
    """Return a polygon around `segment`, column and row of each corner; a lamp or a tree before the
    object does not divide it.

    If its pieces are farther apart, the polygon is around the largest.
    """
    left, top, width, height = segment.box_px
    rows = slice(top, top + height)
    columns = slice(left, left + width)
    boxed = segment.mask[rows, columns]

    piece = _main_piece(boxed.astype(np.uint8))
    polygon = _polygon(piece.astype(np.uint8))

    corners = []
    for column, row in polygon:
        corners.append((left + column, top + row))

    return corners


def _polygon(piece: Bytes) -> list[list[int]]:
    """Column and row of each corner of the outline of `piece` (h, w)."""
    contours, _ = cv2.findContours(piece, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    longest = max(contours, key=len)
    polygon = cv2.approxPolyDP(longest, OUTLINE_TOLERANCE_PX, True)

    corners: list[list[int]] = polygon[:, 0].tolist()
    return corners


def _main_piece(shown: Bytes) -> Booleans:
    """The piece of `shown` (h, w) to outline, with the smallest gaps bridged that make it nearly
    the whole, else with small gaps bridged.
    """
    required_px = MIN_OUTLINED_SHARE * shown.sum()
    for bridged_px in BRIDGED_PX:
        piece = _largest_piece(shown, bridged_px)
        if shown[piece].sum() >= required_px:
            return piece

    return _largest_piece(shown, BRIDGED_PX[0])


def _largest_piece(shown: Bytes, bridged_px: int) -> Booleans:
    """The largest connected piece of `shown` (h, w), to which gaps of fewer than `bridged_px`
    columns belong.
    """
    bridged = _bridged(shown, bridged_px)
    _, component, stats, _ = cv2.connectedComponentsWithStats(bridged)

    area_px = stats[1:, cv2.CC_STAT_AREA]
    largest = 1 + int(area_px.argmax())
    return np.asarray(component == largest)


def _bridged(shown: Bytes, bridged_px: int) -> Bytes:
    """`shown` (h, w) with gaps of fewer than `bridged_px` columns closed."""
    # At a border, closing would fill what lies between it and the segment.
    border = (0, 0, bridged_px, bridged_px)
    bordered = cv2.copyMakeBorder(shown, *border, cv2.BORDER_CONSTANT, value=0)

    kernel = np.ones((1, bridged_px), np.uint8)
    closed = cv2.morphologyEx(bordered, cv2.MORPH_CLOSE, kernel)
    inside = closed[:, bridged_px:-bridged_px]
    return np.asarray(inside, np.uint8)


def height_m(candidate: Candidate, camera: Calibration) -> float:
    """Return the height over the ground of the top of what is seen."""
    nearest_px = float(candidate.walls.disparity_px.max())
    safe_px = max(nearest_px, 1e-3)
    focal_baseline = camera.fx_px * camera.baseline_m
    depth_m = focal_baseline / safe_px

    _, top, _, _ = candidate.segment.box_px
    above_px = camera.cy_px - top
    upward = above_px / camera.fy_px
    above_m = upward * depth_m

    top_m = camera.mount_height_m + above_m
    return float(np.clip(top_m, MIN_HEIGHT_M, MAX_HEIGHT_M))
