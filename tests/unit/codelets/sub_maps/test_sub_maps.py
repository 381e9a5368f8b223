"""Sub-maps of objects: how many there are, what separates them, and what they are called."""

import numpy as np
import pytest

from cogmap.experiments.map_structure.boundaries import Boundaries
from cogmap.services.codelets.sub_maps.config import Config
from cogmap.services.codelets.sub_maps.sub_maps import SubMaps

SHOP, HOME = 0, 1
KINDS = 2
SPACING_M = 15.0


def spread_objects(columns, rows, x_m=0.0, *, spacing_m=SPACING_M, seed=1):
    """(n, 2) objects spread evenly over a rectangle, somewhat irregularly."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)
    offset = rng.uniform(-0.2, 0.2, grid.shape)
    return np.array([x_m, 0.0]) + spacing_m * (grid + offset)


def wall(*corners_m):
    corners = np.array(corners_m, float)
    return np.stack([corners[:-1], corners[1:]], axis=1)


def objects(positions_m, functions=HOME, walls_m=None, settled=True, **weights):
    segments_m = np.zeros((0, 2, 2)) if walls_m is None else walls_m
    codes = np.broadcast_to(functions, len(positions_m)).copy()
    sub_maps = SubMaps(positions_m, codes, Boundaries(segments_m), Config(**weights), kinds=KINDS)
    if settled:
        sub_maps.settle()

    return sub_maps


def count(sub_maps):
    return len(np.unique(sub_maps.labels))


def test_objects_that_nothing_separates_are_one_sub_map():
    assert count(objects(spread_objects(12, 6))) == 1


def test_a_wall_through_evenly_spread_objects_parts_them():
    positions_m = spread_objects(12, 6)
    middle_m = 5.5 * SPACING_M

    sub_maps = objects(positions_m, walls_m=wall((middle_m, -50), (middle_m, 150)))

    is_left = positions_m[:, 0] < middle_m
    assert count(sub_maps) == 2
    assert len(set(sub_maps.labels[is_left])) == len(set(sub_maps.labels[~is_left])) == 1


def test_a_wall_that_ends_among_objects_does_not_part_them():
    middle_m = 5.5 * SPACING_M

    sub_maps = objects(spread_objects(12, 6), walls_m=wall((middle_m, 50), (middle_m, 80)))

    assert count(sub_maps) == 1


def test_a_wall_of_no_weight_parts_nothing():
    middle_m = 5.5 * SPACING_M
    walls_m = wall((middle_m, -50), (middle_m, 150))

    sub_maps = objects(spread_objects(12, 6), walls_m=walls_m, boundary_weight=0.0)

    assert count(sub_maps) == 1


def test_a_crossing_through_a_wall_leaves_two_sub_maps():
    middle_m = 9.5 * SPACING_M
    below_m = wall((middle_m, -50), (middle_m, 60))
    above_m = wall((middle_m, 75), (middle_m, 250))

    sub_maps = objects(spread_objects(20, 12), walls_m=np.concatenate([below_m, above_m]))

    assert count(sub_maps) == 2


def test_objects_of_different_function_side_by_side_are_two_sub_maps():
    positions_m = spread_objects(12, 6)
    is_left = positions_m[:, 0] < 5.5 * SPACING_M

    sub_maps = objects(positions_m, np.where(is_left, SHOP, HOME))

    assert count(sub_maps) == 2
    assert len(set(sub_maps.labels[is_left])) == 1


def test_functions_that_are_mixed_everywhere_part_nothing():
    positions_m = spread_objects(12, 6)
    functions = np.random.default_rng(3).integers(0, KINDS, len(positions_m))

    assert count(objects(positions_m, functions)) == 1


def test_unknown_functions_part_nothing():
    positions_m = spread_objects(12, 6)
    is_left = positions_m[:, 0] < 5.5 * SPACING_M

    assert count(objects(positions_m, np.where(is_left, -1, HOME))) == 1


def test_objects_that_stand_closer_are_a_sub_map_of_their_own():
    sparse_m = spread_objects(8, 8, spacing_m=30)
    dense_m = spread_objects(16, 16, x_m=8 * 30, spacing_m=15)

    sub_maps = objects(np.vstack([sparse_m, dense_m]))

    assert count(sub_maps) == 2


@pytest.mark.parametrize("groups", [1, 2, 4, 7])
def test_the_number_of_sub_maps_follows_from_the_objects(groups):
    apart_m = 400.0
    each_m = [spread_objects(6, 5, x_m=apart_m * group, seed=group) for group in range(groups)]

    assert count(objects(np.vstack(each_m))) == groups


@pytest.mark.parametrize("number", [0, 1, 2])
def test_hardly_any_objects_need_no_boundary_to_be_clustered(number):
    sub_maps = objects(spread_objects(number, 1))

    assert len(sub_maps.labels) == number
    assert count(sub_maps) == min(1, number)


def test_objects_at_one_place_are_one_sub_map():
    assert count(objects(np.zeros((9, 2)))) == 1


def test_the_same_objects_always_give_the_same_labels():
    positions_m = np.random.default_rng(5).uniform(0, 500, (300, 2))
    functions = np.random.default_rng(6).integers(0, KINDS, 300)

    first = objects(positions_m, functions)
    second = objects(positions_m, functions)

    assert first.labels.tolist() == second.labels.tolist()


def test_an_object_that_arrives_joins_the_sub_map_around_it():
    positions_m = spread_objects(12, 6)
    middle_m = 5.5 * SPACING_M
    sub_maps = objects(positions_m, walls_m=wall((middle_m, -50), (middle_m, 150)))
    left, right = sub_maps.labels[0], sub_maps.labels[11]

    assert sub_maps.add(np.array([20.0, 25.0]), HOME) == left
    assert sub_maps.add(np.array([middle_m + 20, 25.0]), HOME) == right


def test_an_object_far_from_all_others_begins_a_sub_map():
    sub_maps = objects(spread_objects(6, 6))

    label = sub_maps.add(np.array([5000.0, 5000.0]), HOME)

    assert label == 1
    assert set(sub_maps.labels[:-1]) == {0}


def test_labels_are_kept_as_objects_arrive():
    positions_m = spread_objects(12, 8)
    middle_m = 5.5 * SPACING_M
    first, later = positions_m[::2], positions_m[1::2]
    sub_maps = objects(first, walls_m=wall((middle_m, -50), (middle_m, 150)))
    before = sub_maps.labels.copy()

    for position_m in later:
        sub_maps.add(position_m, HOME)

    assert sub_maps.labels[: len(first)].tolist() == before.tolist()
    assert count(sub_maps) == 2


def test_sub_maps_that_objects_between_them_join_become_one():
    left_m = spread_objects(6, 6)
    right_m = spread_objects(6, 6, x_m=14 * SPACING_M)
    between_m = spread_objects(8, 6, x_m=6 * SPACING_M)
    sub_maps = objects(np.vstack([left_m, right_m]))
    assert count(sub_maps) == 2

    for position_m in between_m:
        sub_maps.add(position_m, HOME)

    assert count(sub_maps) == 1
    assert sub_maps.labels[0] in (0, 1)


def test_a_sub_map_is_parted_once_a_quarter_of_another_function_has_arrived():
    homes_m = spread_objects(8, 8)
    shops_m = spread_objects(8, 8, x_m=8 * SPACING_M)
    sub_maps = objects(homes_m, HOME)

    for position_m in shops_m:
        sub_maps.add(position_m, SHOP)

    assert count(sub_maps) == 2
    assert set(sub_maps.labels[: len(homes_m)]) == {0}


def test_settling_again_keeps_the_labels():
    middle_m = 5.5 * SPACING_M
    sub_maps = objects(spread_objects(12, 6), walls_m=wall((middle_m, -50), (middle_m, 150)))
    before = sub_maps.labels.copy()

    sub_maps.settle()

    assert sub_maps.labels.tolist() == before.tolist()


def test_a_boundary_at_an_object_is_its_own_outline_and_separates_nothing():
    positions_m = spread_objects(12, 6)
    half_m = 3.0
    around_m = []
    for x_m, y_m in positions_m:
        west, east = x_m - half_m, x_m + half_m
        south, north = y_m - half_m, y_m + half_m
        corners = (west, south), (east, south), (east, north), (west, north), (west, south)
        around_m.append(wall(*corners))

    sub_maps = SubMaps(
        positions_m,
        np.full(len(positions_m), HOME),
        Boundaries(np.concatenate(around_m)),
        Config(),
        kinds=KINDS,
        clear_m=np.full(len(positions_m), 4.5),
    )
    sub_maps.settle()

    assert count(sub_maps) == 1
