"""Candidates for percepts: segments that stand somewhere, joined where they are pieces of one
object.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from schemas.sensing import Calibration
from services.epam.layout.walls import Disparity, Walls, walls
from services.epam.recognition.objects import Recognition
from services.epam.recognition.segments import Image, Mask, Segment

OUTLINE_PX = 1.0
BRIDGED_PX = (9, 25, 65)
MOST_OF_IT = 0.9
AS_FAR = 1.3
LEAST_HEIGHT_M = 0.5


@dataclass(frozen=True, eq=False)
class Candidate:
    """A segment that stands somewhere, and what it was recognised as."""

    segment: Segment
    walls: Walls
    recognition: Recognition


def joined(pieces: Sequence[Candidate], disparity_px: Disparity) -> Candidate:
    """What was recognised as one object as one candidate: the first of `pieces`, with all that lie
    beside it as far away. What goes by the same name elsewhere is mistaken for it, and left out.
    """
    whole = pieces[0]
    for piece in pieces[1:]:
        if beside(whole, piece):
            mask = whole.segment.mask | piece.segment.mask
            left, top, wide, high = cv2.boundingRect(mask.astype(np.uint8))
            segment = Segment(mask, (left, top, wide, high))
            whole = replace(
                whole, segment=segment, walls=walls(segment, disparity_px) or whole.walls
            )
    return whole


def beside(one: Candidate, other: Candidate) -> bool:
    """Whether they may be pieces of one object: hardly a gap between them, and as far away."""
    far, near = sorted(float(np.median(each.walls.disparity_px)) for each in (one, other))
    gap_px = max(one.walls.left, other.walls.left) - min(one.walls.right, other.walls.right)
    return gap_px <= BRIDGED_PX[-1] and near <= AS_FAR * far


def outline_px(segment: Segment) -> list[tuple[int, int]]:
    """A polygon around `segment`, column and row of its corners: a lamp or a tree before it does
    not divide it.

    Where it is in pieces farther apart than that, the polygon is around the largest.
    """
    left, top, wide, high = segment.box_px
    shown = segment.mask[top : top + high, left : left + wide].astype(np.uint8)
    for bridged in BRIDGED_PX:
        piece = _largest_piece(shown, bridged)
        if shown[piece].sum() >= MOST_OF_IT * shown.sum():
            break
    else:
        piece = _largest_piece(shown, BRIDGED_PX[0])
    pieces, _ = cv2.findContours(piece.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    corners = cv2.approxPolyDP(max(pieces, key=len), OUTLINE_PX, True).reshape(-1, 2)
    return [(left + int(column), top + int(row)) for column, row in corners]


def _largest_piece(shown: Image, bridged_px: int) -> Mask:
    """The largest connected piece of `shown` (h, w) where gaps of less than `bridged_px` columns
    count as its own.
    """
    # At a border, closing would fill what lies between it and the segment.
    around = cv2.copyMakeBorder(shown, 0, 0, bridged_px, bridged_px, cv2.BORDER_CONSTANT, value=0)
    closed = cv2.morphologyEx(around, cv2.MORPH_CLOSE, np.ones((1, bridged_px), np.uint8))
    _, number, stats, _ = cv2.connectedComponentsWithStats(closed[:, bridged_px:-bridged_px])
    return np.asarray(number == 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax()))


def height_m(candidate: Candidate, camera: Calibration) -> float:
    """How high over the ground the top of what is seen is."""
    nearest_px = max(float(candidate.walls.disparity_px.max()), 1e-3)
    depth_m = camera.fx_px * camera.baseline_m / nearest_px
    top_m = (
        camera.mount_height_m
        + (camera.cy_px - candidate.segment.box_px[1]) / camera.fy_px * depth_m
    )
    return float(np.clip(top_m, LEAST_HEIGHT_M, 1e3))
