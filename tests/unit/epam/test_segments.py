"""Views divided into segments, and segments into columns of wall."""

from __future__ import annotations

import math

import numpy as np
import pytest

from services.epam.layout.walls import walls
from services.epam.recognition.segments import (
    HEIGHT_PX,
    OFFSET_PX,
    WIDTH_PX,
    Segment,
    divided,
    load,
    network_input,
)
from tests.support.blocks import CAMERA


def _answer(*boxes: tuple[int, int, int, int], peaks: list[tuple[int, int]]) -> np.ndarray:
    """Buildings in boxes (left, top, right, bottom), each pixel of which points to the peak
    (column, row).
    """
    shown = np.zeros((4, HEIGHT_PX, WIDTH_PX), np.float32)
    shown[0] = -8.0
    rows, columns = np.indices((HEIGHT_PX, WIDTH_PX))
    for (left, top, right, bottom), (column, row) in zip(boxes, peaks, strict=True):
        area = slice(top, bottom), slice(left, right)
        shown[0][area] = 8.0
        shown[2][area] = (column - columns[area]) / OFFSET_PX
        shown[3][area] = (row - rows[area]) / OFFSET_PX
        shown[1, row, column] = 0.9
    return shown


def _divided(shown: np.ndarray) -> list[Segment]:
    return divided(shown, (240, 320))


def test_two_buildings_side_by_side_are_two_segments_from_left_to_right() -> None:
    found = _divided(_answer((60, 30, 100, 60), (20, 20, 60, 60), peaks=[(80, 45), (40, 40)]))

    assert [segment.box_px[0] for segment in found] == pytest.approx([40, 120], abs=1)
    assert [segment.area_px for segment in found] == pytest.approx([80 * 80, 80 * 60], rel=0.03)
    assert not (found[0].mask & found[1].mask).any()


def test_both_sides_of_what_a_lamp_hides_are_one_segment() -> None:
    found = _divided(_answer((20, 20, 38, 60), (42, 20, 60, 60), peaks=[(40, 40), (40, 40)]))

    assert len(found) == 1
    assert found[0].box_px == pytest.approx((40, 40, 80, 80), abs=1)


def test_neither_a_speck_nor_a_building_without_a_centre_is_a_segment() -> None:
    assert _divided(_answer((20, 20, 23, 23), peaks=[(21, 21)])) == []

    without = _answer((20, 20, 60, 60), peaks=[(40, 40)])
    without[1] = 0.0
    assert _divided(without) == []


def test_a_black_image_and_one_without_contrast_have_no_segments() -> None:
    segmenter = load()
    depth_m = np.full((240, 320), 20.0, np.float32)

    assert segmenter.segments(np.zeros((240, 320, 3), np.uint8), depth_m, CAMERA) == []
    assert segmenter.segments(np.full((240, 320, 3), 90, np.uint8), depth_m, CAMERA) == []


def test_the_network_receives_height_and_where_depth_is_unknown() -> None:
    small = np.zeros((HEIGHT_PX, WIDTH_PX, 3), np.uint8)
    depth_m = np.full((HEIGHT_PX, WIDTH_PX), 20.0, np.float32)
    depth_m[:10] = 0.0
    values = network_input(small, depth_m, CAMERA)

    assert values[4, :10].max() == 0.0
    assert values[4, 10:].min() == 1.0
    assert not values[[3, 5], :10].any()

    horizon = round(CAMERA.cy_px / 2)
    assert values[5, horizon, 50] == pytest.approx(CAMERA.mount_height_m / 5, abs=0.02)
    assert values[5, 20, 50] > values[5, 100, 50]


def _segment(left: int, right: int) -> Segment:
    mask = np.zeros((240, 320), np.bool_)
    mask[80:130, left:right] = True
    return Segment(mask, (left, 80, right - left, 50))


def _scene(*slabs: tuple[int, int, float]) -> np.ndarray:
    """Disparity of walls (first column, last column + 1, pixels) before nothing."""
    disparity = np.zeros((240, 320), np.float32)
    for left, right, disparity_px in slabs:
        disparity[80:130, left:right] = disparity_px
    return disparity


def test_a_wall_before_something_farther_has_true_ends() -> None:
    wall = walls(_segment(100, 160), _scene((60, 220, 4.0), (100, 160, 8.0)))

    assert wall is not None
    assert wall.whole
    assert (wall.left, wall.right) == (99.5, 159.5)
    assert set(wall.disparity_px.tolist()) == {8.0}


@pytest.mark.parametrize(
    ("nearer", "sides"), [((60, 100, 12.0), (False, True)), ((160, 200, 12.0), (True, False))]
)
def test_a_wall_beside_something_nearer_has_no_true_end_there(
    nearer: tuple[int, int, float], sides: tuple[bool, bool]
) -> None:
    wall = walls(_segment(100, 160), _scene((100, 160, 8.0), nearer))

    assert wall is not None
    assert (wall.left_true, wall.right_true) == sides


def test_the_left_border_cuts_a_wall_as_many_columns_in_as_its_disparity() -> None:
    cut = walls(_segment(3, 60), _scene((3, 60, 8.0)))
    right = walls(_segment(280, 320), _scene((280, 320, 8.0)))

    assert cut is not None
    assert right is not None
    assert (cut.left_true, cut.right_true) == (False, True)
    assert (right.left_true, right.right_true) == (True, False)


def test_a_segment_without_depth_has_no_walls() -> None:
    assert walls(_segment(100, 160), np.zeros((240, 320), np.float32)) is None


def test_a_building_of_unknown_size_is_placed_behind_its_visible_middle() -> None:
    wall = walls(_segment(130, 190), _scene((130, 190, 8.0)))
    assert wall is not None

    place = wall.usual_pose(CAMERA)
    assert place.range_m == pytest.approx(208 * 0.5 / 8.0 + CAMERA.mount_forward_m + 4.5, abs=0.1)
    assert abs(place.bearing_rad) < 0.01
    assert place.range_sd_m > 1.0
    assert wall.width_m(CAMERA) == pytest.approx(60 / 208 * 13.0, rel=0.01)
    assert math.isfinite(place.bearing_sd_rad)
