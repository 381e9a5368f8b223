"""Pieces of one object are one candidate, and its outline holds what is seen of it."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from cogmap.services.epam.recognition.candidate import Candidate, joined, outline_px
from cogmap.services.epam.recognition.objects import Appearance, Recognition
from cogmap.services.epam.recognition.segments import Segment
from cogmap.services.epam.recognition.walls import walls

SIZE = (240, 320)


def _segment(mask: np.ndarray) -> Segment:
    return Segment(mask > 0, cv2.boundingRect(mask.astype(np.uint8)))


def _outlined(segment: Segment) -> np.ndarray:
    """Which pixels the outline of a segment holds."""
    held = np.zeros(SIZE, np.uint8)
    outline = np.array(outline_px(segment), np.int32)
    cv2.fillPoly(held, [outline], 1)
    return held > 0


def _filled(*blocks: tuple[int, int, int, int]) -> tuple[Segment, np.ndarray]:
    """A segment of blocks (left, top, wide, high), and what its outline holds."""
    mask = np.zeros(SIZE, np.bool_)
    for left, top, wide, high in blocks:
        mask[top : top + high, left : left + wide] = True

    segment = _segment(mask)
    return segment, _outlined(segment)


def test_an_outline_encloses_the_segment_and_no_more() -> None:
    segment, held = _filled((50, 60, 80, 40))

    assert (held == segment.mask).all()


def test_the_outline_follows_a_gable() -> None:
    gable = np.array([(100, 20), (110, 120), (90, 120)], np.int32)
    mask = np.zeros(SIZE, np.uint8)
    cv2.fillPoly(mask, [gable], 1)
    segment = _segment(mask)
    wrong = _outlined(segment) != segment.mask

    assert np.count_nonzero(wrong) < 0.05 * segment.area_px


@pytest.mark.parametrize("gap_px", [6, 20, 40])
def test_a_lamp_or_a_tree_before_a_building_does_not_divide_it(gap_px: int) -> None:
    left_part = (50, 60, 60, 40)
    right_part = (110 + gap_px, 60, 60, 40)
    segment, held = _filled(left_part, right_part)

    assert held[segment.mask].all()
    assert held.sum() == segment.area_px + gap_px * 40


def test_of_pieces_far_apart_the_largest_is_outlined() -> None:
    _, held = _filled((10, 60, 90, 40), (250, 60, 40, 40))

    assert held[60:100, 10:100].all()
    assert held.sum() == 90 * 40


def test_a_distant_speck_does_not_change_the_outline() -> None:
    _, held = _filled((10, 60, 90, 40), (250, 60, 4, 4))

    assert held.sum() == 90 * 40


def _candidates(*blocks: tuple[int, int, float]) -> tuple[list[Candidate], np.ndarray]:
    """Candidates of left side, width and disparity, and the disparities of their view."""
    disparity_px = np.ones(SIZE, np.float32)
    for left, wide, away_px in blocks:
        disparity_px[60:100, left : left + wide] = away_px

    appearance = Appearance(np.zeros(64, np.float32), 1, 1)
    recognition = Recognition("bakery", 0.9, 0.0, 0.9, 0.0, 0.1, appearance)
    found = []
    for left, wide, _ in blocks:
        segment, _ = _filled((left, 60, wide, 40))
        stands = walls(segment, disparity_px)
        assert stands is not None
        found.append(Candidate(segment, stands, recognition))

    return found, disparity_px


def test_adjacent_pieces_at_the_same_distance_are_one() -> None:
    pieces, disparity_px = _candidates((50, 60, 6.0), (115, 30, 6.5), (150, 20, 5.8))
    whole = joined(pieces, disparity_px)
    areas_px = [piece.segment.area_px for piece in pieces]

    assert whole.segment.area_px == sum(areas_px)
    assert whole.segment.box_px == (50, 60, 120, 40)
    assert whole.walls.left == 49.5
    assert whole.walls.right == 169.5
    assert whole.recognition == pieces[0].recognition


@pytest.mark.parametrize(
    "other",
    [(115, 30, 12.0), (115, 30, 3.0), (200, 30, 6.0)],
    ids=["nearer", "farther", "beside"],
)
def test_a_piece_elsewhere_with_the_same_label_is_left_out(other: tuple[int, int, float]) -> None:
    pieces, disparity_px = _candidates((50, 60, 6.0), other)
    whole = joined(pieces, disparity_px)

    assert whole.segment.box_px == (50, 60, 60, 40)
