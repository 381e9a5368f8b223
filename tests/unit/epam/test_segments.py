"""Views divided into segments, and segments into columns of wall."""

from __future__ import annotations

import math
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from cogmap.services.epam.recognition.look import Window, network_input
from cogmap.services.epam.recognition.segments import (
    OFFSET_PX,
    Segment,
    divided,
    load,
    with_closer,
)
from cogmap.services.epam.recognition.walls import Walls, walls
from tests.support.world.blocks import CAMERA

SIZE = (240, 320)
HALF = (120, 160)
WALL_PX = 8.0
Box = tuple[int, int, int, int]


def _answer(*boxes: Box, peaks: list[tuple[int, int]]) -> np.ndarray:
    """Buildings in boxes (left, top, right, bottom), each pixel of which points to the peak
    (column, row), at half the view's resolution.
    """
    shown = np.zeros((4, *HALF), np.float32)
    shown[0] = -8.0
    rows, columns = np.indices(HALF)
    for (left, top, right, bottom), (column, row) in zip(boxes, peaks, strict=True):
        area = slice(top, bottom), slice(left, right)
        shown[0][area] = 8.0
        shown[1, row, column] = 0.9
        shown[2][area] = (column - columns[area]) / OFFSET_PX
        shown[3][area] = (row - rows[area]) / OFFSET_PX

    return shown


def _divided(shown: np.ndarray) -> list[Segment]:
    return divided(shown, SIZE)


def test_two_buildings_side_by_side_are_two_segments_from_left_to_right() -> None:
    right_box = (60, 30, 100, 60)
    left_box = (20, 20, 60, 60)
    left, right = _divided(_answer(right_box, left_box, peaks=[(80, 45), (40, 40)]))

    assert left.box_px[0] == pytest.approx(40, abs=1)
    assert right.box_px[0] == pytest.approx(120, abs=1)
    assert left.area_px == pytest.approx(80 * 80, rel=0.03)
    assert right.area_px == pytest.approx(80 * 60, rel=0.03)
    assert not (left.mask & right.mask).any()


def test_both_sides_of_what_a_lamp_hides_are_one_segment() -> None:
    left_box = (20, 20, 38, 60)
    right_box = (42, 20, 60, 60)
    (whole,) = _divided(_answer(left_box, right_box, peaks=[(40, 40), (40, 40)]))

    assert whole.box_px == pytest.approx((40, 40, 80, 80), abs=1)


def test_a_building_with_two_centres_is_one_segment_where_its_pixels_point_to_one_place() -> None:
    wide_box = (20, 20, 140, 100)
    shown = _answer(wide_box, peaks=[(60, 60)])
    shown[1, 60, 100] = 0.9
    columns = np.arange(20, 140)
    # From left to right, its pixels point to places ever more to the right, from one centre to the
    # other.
    pointed = 60 + (columns - 20) / 3
    shown[2, 20:100, 20:140] = (pointed - columns) / OFFSET_PX
    (whole,) = _divided(shown)

    assert whole.box_px == pytest.approx((40, 40, 240, 160), abs=1)


def test_a_building_that_points_to_no_centre_is_a_segment_of_its_own() -> None:
    left_box = (5, 20, 40, 60)
    right_box = (120, 20, 155, 60)
    shown = _answer(left_box, right_box, peaks=[(20, 40), (138, 40)])
    shown[1, 40, 138] = 0.0
    left, right = _divided(shown)

    assert left.box_px == pytest.approx((10, 40, 70, 80), abs=1)
    assert right.box_px == pytest.approx((240, 40, 70, 80), abs=1)


def test_without_any_centre_areas_that_hang_together_are_segments_unless_they_are_specks() -> None:
    building = (20, 20, 60, 60)
    speck = (100, 20, 105, 25)
    shown = _answer(building, speck, peaks=[(40, 40), (102, 22)])
    shown[1] = 0.0
    (alone,) = _divided(shown)

    assert alone.box_px == pytest.approx((40, 40, 80, 80), abs=1)


def test_buildings_that_touch_are_two_segments_where_their_pixels_point_apart() -> None:
    left_box = (20, 20, 80, 100)
    right_box = (80, 20, 140, 100)
    left, right = _divided(_answer(left_box, right_box, peaks=[(76, 60), (84, 60)]))

    assert left.box_px[2] == pytest.approx(120, abs=1)
    assert right.box_px[2] == pytest.approx(120, abs=1)


def test_a_speck_is_no_segment() -> None:
    speck = _answer((20, 20, 23, 23), peaks=[(21, 21)])

    assert _divided(speck) == []


@pytest.mark.parametrize("level", [0, 90], ids=["black", "grey"])
def test_an_image_without_contrast_has_no_segments(level: int) -> None:
    image = np.full((*SIZE, 3), level, np.uint8)
    depth_m = np.full(SIZE, 20.0, np.float32)

    assert load().segments(image, depth_m, CAMERA) == []


def test_the_network_receives_height_and_where_depth_is_unknown() -> None:
    small = np.zeros((*HALF, 3), np.uint8)
    depth_m = np.full(HALF, 20.0, np.float32)
    depth_m[:10] = 0.0
    values = network_input(small, depth_m, CAMERA, Window.whole(CAMERA))
    height = values[5]

    assert values[4, :10].max() == 0.0
    assert values[4, 10:].min() == 1.0
    assert not values[[3, 5], :10].any()

    horizon = round(CAMERA.cy_px / 2)
    assert height[horizon, 50] == pytest.approx(CAMERA.mount_height_m / 5, abs=0.02)
    assert height[20, 50] > height[100, 50]


def _box(left: int, top: int, right: int, bottom: int) -> Segment:
    mask = np.zeros(SIZE, np.bool_)
    mask[top:bottom, left:right] = True
    return Segment.of(mask)


def test_small_segments_about_the_horizon_are_those_of_the_closer_look() -> None:
    far = _box(100, 90, 140, 110)
    near = _box(200, 20, 300, 180)
    one_of_two = _box(100, 90, 119, 110)
    other_of_two = _box(121, 90, 140, 110)
    before_near = _box(250, 80, 270, 120)
    window = Window.far(CAMERA)
    closely = [one_of_two, other_of_two, before_near]

    found = with_closer([far, near], closely, window)
    assert {each.box_px for each in found} == {
        each.box_px for each in (near, one_of_two, other_of_two)
    }


def test_a_small_segment_that_leaves_the_closer_look_is_kept() -> None:
    window = Window.far(CAMERA)
    over_it = _box(100, window.top_px - 10, 120, window.top_px + 10)

    assert with_closer([over_it], [], window) == [over_it]
    assert with_closer([], [], window) == []


def test_the_closer_look_of_a_low_camera_image_is_all_of_it() -> None:
    low = msgspec.structs.replace(CAMERA, height_px=60, cy_px=30.0)

    assert Window.far(low) == Window.whole(low)
    assert Window.far(CAMERA).rows.stop <= CAMERA.height_px


def test_both_looks_see_a_pixel_at_the_same_height_and_place() -> None:
    image = np.zeros((*SIZE, 3), np.uint8)
    depth_m = np.full(SIZE, 20.0, np.float32)
    window = Window.far(CAMERA)
    rows = window.rows
    whole = network_input(image, depth_m, CAMERA, Window.whole(CAMERA))
    closely = network_input(image[rows], depth_m[rows], CAMERA, window)

    assert closely == pytest.approx(whole[:, rows], abs=1e-5)


def _segment(left: int, right: int) -> Segment:
    mask = np.zeros(SIZE, np.bool_)
    mask[80:130, left:right] = True
    return Segment(mask, (left, 80, right - left, 50))


def _scene(*slabs: tuple[int, int, float]) -> np.ndarray:
    """Disparity of walls (first column, last column + 1, pixels) before nothing."""
    disparity = np.zeros(SIZE, np.float32)
    for left, right, disparity_px in slabs:
        disparity[80:130, left:right] = disparity_px
    return disparity


def _walls(left: int, right: int, *others: tuple[int, int, float]) -> Walls:
    """The walls of a segment WALL_PX away, beside others."""
    found = walls(_segment(left, right), _scene((left, right, WALL_PX), *others))
    assert found is not None
    return found


def test_a_wall_before_something_farther_has_true_ends() -> None:
    scene = _scene((60, 220, 4.0), (100, 160, WALL_PX))
    wall = walls(_segment(100, 160), scene)

    assert wall is not None
    assert wall.whole
    assert wall.left == 99.5
    assert wall.right == 159.5
    assert set(wall.disparity_px.tolist()) == {WALL_PX}


@pytest.mark.parametrize(
    ("nearer", "sides"), [((60, 100, 12.0), (False, True)), ((160, 200, 12.0), (True, False))]
)
def test_a_wall_beside_something_nearer_has_no_true_end_there(
    nearer: tuple[int, int, float], sides: tuple[bool, bool]
) -> None:
    wall = _walls(100, 160, nearer)

    assert (wall.left_true, wall.right_true) == sides


def test_the_left_border_cuts_a_wall_as_many_columns_in_as_its_disparity() -> None:
    at_left = _walls(3, 60)
    at_right = _walls(280, 320)

    assert (at_left.left_true, at_left.right_true) == (False, True)
    assert (at_right.left_true, at_right.right_true) == (True, False)


def test_a_segment_without_depth_has_no_walls() -> None:
    segment = _segment(100, 160)
    unknown = np.zeros(SIZE, np.float32)

    assert walls(segment, unknown) is None


def test_a_building_of_unknown_size_is_placed_behind_its_visible_middle() -> None:
    wall = _walls(130, 190)
    wall_m = CAMERA.fx_px * CAMERA.baseline_m / WALL_PX
    place = wall.usual_pose(CAMERA)

    assert place.range_m == pytest.approx(wall_m + CAMERA.mount_forward_m + 4.5, abs=0.1)
    assert abs(place.bearing_rad) < 0.01
    assert place.range_sd_m > 1.0
    assert wall.width_m(CAMERA) == pytest.approx(60 / CAMERA.fx_px * wall_m, rel=0.01)
    assert math.isfinite(place.bearing_sd_rad)


def test_a_building_whose_ends_are_hidden_is_the_less_surely_placed_the_farther_it_is() -> None:
    near = _walls(130, 190).usual_pose(CAMERA)
    far = replace(_walls(130, 190), disparity_px=np.full(60, WALL_PX / 4)).usual_pose(CAMERA)

    assert far.range_sd_m > 1.5 * near.range_sd_m
