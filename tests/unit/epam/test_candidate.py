"""Pieces of one object are one candidate, and its outline holds what is seen of it."""

from __future__ import annotations

import cv2
import numpy as np

from services.epam.layout.walls import walls
from services.epam.recognition.candidate import Candidate, joined, outline_px
from services.epam.recognition.objects import Appearance, Recognition
from services.epam.recognition.segments import Segment


def _filled(*blocks: tuple[int, int, int, int]) -> tuple[Segment, np.ndarray]:
    """A segment of blocks (left, top, wide, high), and what its outline holds."""
    mask = np.zeros((240, 320), np.bool_)
    for left, top, wide, high in blocks:
        mask[top : top + high, left : left + wide] = True
    segment = Segment(mask, cv2.boundingRect(mask.astype(np.uint8)))
    held = np.zeros((240, 320), np.uint8)
    cv2.fillPoly(held, [np.array(outline_px(segment), np.int32)], 1)
    return segment, held > 0


def test_an_outline_encloses_the_segment_and_no_more() -> None:
    segment, held = _filled((50, 60, 80, 40))

    assert (held == segment.mask).all()


def test_the_outline_follows_a_gable() -> None:
    mask = np.zeros((240, 320), np.uint8)
    cv2.fillPoly(mask, [np.array([(100, 20), (110, 120), (90, 120)], np.int32)], 1)
    segment = Segment(mask > 0, cv2.boundingRect(mask))
    held = np.zeros((240, 320), np.uint8)
    cv2.fillPoly(held, [np.array(outline_px(segment), np.int32)], 1)

    assert np.count_nonzero(held != mask) < 0.05 * segment.area_px


def test_a_lamp_or_a_tree_before_a_building_does_not_divide_it() -> None:
    for gap in (6, 20, 40):
        segment, held = _filled((50, 60, 60, 40), (110 + gap, 60, 60, 40))
        assert held[segment.mask].all()
        assert held.sum() == segment.area_px + gap * 40


def test_of_pieces_far_apart_the_largest_is_outlined() -> None:
    _, held = _filled((10, 60, 90, 40), (250, 60, 40, 40))

    assert held[60:100, 10:100].all()
    assert held.sum() == 90 * 40


def test_a_distant_speck_does_not_change_the_outline() -> None:
    _, held = _filled((10, 60, 90, 40), (250, 60, 4, 4))

    assert held.sum() == 90 * 40


def _candidates(*blocks: tuple[int, int, float]) -> tuple[list[Candidate], np.ndarray]:
    """Candidates of left side, width and disparity, and the disparities of their view."""
    disparity_px = np.ones((240, 320), np.float32)
    found = []
    for left, wide, away_px in blocks:
        disparity_px[60:100, left : left + wide] = away_px
    for left, wide, _ in blocks:
        mask = np.zeros((240, 320), np.bool_)
        mask[60:100, left : left + wide] = True
        segment = Segment(mask, (left, 60, wide, 40))
        stands = walls(segment, disparity_px)
        assert stands is not None
        found.append(
            Candidate(
                segment,
                stands,
                Recognition("bakery", 0.9, 0.0, 0.1, Appearance(np.zeros(64, np.float32), 1, 1)),
            )
        )
    return found, disparity_px


def test_adjacent_pieces_at_the_same_distance_are_one() -> None:
    pieces, disparity_px = _candidates((50, 60, 6.0), (115, 30, 6.5), (150, 20, 5.8))
    whole = joined(pieces, disparity_px)

    assert whole.segment.area_px == sum(piece.segment.area_px for piece in pieces)
    assert whole.segment.box_px == (50, 60, 120, 40)
    assert (whole.walls.left, whole.walls.right) == (49.5, 169.5)
    assert whole.recognition == pieces[0].recognition


def test_a_piece_elsewhere_with_the_same_label_is_left_out() -> None:
    for other in ((115, 30, 12.0), (115, 30, 3.0), (200, 30, 6.0)):
        pieces, disparity_px = _candidates((50, 60, 6.0), other)
        assert joined(pieces, disparity_px).segment.box_px == (50, 60, 60, 40)
