"""The road and its boundary on the ground, in metres, from a mask and depth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.services.epam.layout.ground import CELL_M, MAX_RANGE_M, project
from cogmap.services.epam.layout.ground_plane import fit
from tests.support.world.blocks import CAMERA, Block, painted

HALF_M = 4.0
FOCAL_BASELINE = CAMERA.fx_px * CAMERA.baseline_m
SIZE = (240, 320)
HORIZON = 121


@dataclass(frozen=True, eq=False)
class Street:
    """A straight street, HALF_M to both sides: which pixels show it, and true depth."""

    mask: np.ndarray
    depth_m: np.ndarray


def _street(*blocks: Block, height_m: float = CAMERA.mount_height_m) -> Street:
    _, painted_m, label = painted(list(blocks))
    on_ground = label == 0
    lower = np.float32(height_m / CAMERA.mount_height_m)
    depth_m = np.where(on_ground, painted_m * lower, painted_m)

    rows, _ = np.indices(SIZE)
    below_horizon = (rows > CAMERA.cy_px) & (depth_m > 0)
    in_street = np.abs(_left_m(depth_m)) < HALF_M
    return Street(in_street & on_ground & below_horizon, depth_m)


def _projected(street: Street, depth_m: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    likelihood = street.mask.astype(np.float32)
    return project(likelihood, street.depth_m if depth_m is None else depth_m, CAMERA)


def _edge_errors_m(boundary_m: np.ndarray) -> np.ndarray:
    """How far points of the boundary are from the two sides of the street."""
    aside_m = np.abs(boundary_m[:, 1])
    return np.abs(aside_m - HALF_M)


def test_a_straight_street_ends_at_its_two_sides_and_nowhere_else() -> None:
    road_m, boundary_m = _projected(_street())
    errors_m = _edge_errors_m(boundary_m)
    assert len(boundary_m) > 30
    assert np.quantile(errors_m, 0.9) < 0.1

    ahead_m, left_m = road_m.T
    assert (np.abs(left_m) < HALF_M).all()
    assert ahead_m.min() < 4.0
    assert ahead_m.max() > 14.0


def test_road_and_boundary_are_float32_with_one_point_a_cell_in_range() -> None:
    for points in _projected(_street()):
        assert points.dtype == np.float32
        assert np.hypot(*points.T).max() <= MAX_RANGE_M

        cells = np.floor(points / CELL_M)
        assert len(np.unique(cells, axis=0)) == len(cells)


def test_the_boundary_is_located_between_pixels() -> None:
    mask = np.zeros(SIZE, np.float32)
    mask[200:] = 1.0
    mask[199] = 0.4
    row = 199 + (0.5 - 0.4) / (1.0 - 0.4)
    depth_m = CAMERA.mount_height_m * CAMERA.fy_px / (row - CAMERA.cy_px)

    _, boundary_m = project(mask, _street().depth_m, CAMERA)

    expected_m = depth_m + CAMERA.mount_forward_m
    np.testing.assert_allclose(boundary_m[:, 0], expected_m, atol=0.01)


def test_the_ground_follows_depth_where_the_mounts_height_is_wrong() -> None:
    low = _street(height_m=1.4)
    _, boundary_m = _projected(low)

    assert np.median(_edge_errors_m(boundary_m)) < 0.05


def test_wrong_disparities_on_a_third_of_the_road_do_not_move_the_plane() -> None:
    street = _street()
    true_px = np.zeros(SIZE)
    np.divide(FOCAL_BASELINE, street.depth_m, out=true_px, where=street.depth_m > 0)

    rng = np.random.default_rng(1)
    is_wrong = rng.random(SIZE) < 0.3
    disparity_px = np.where(is_wrong, rng.uniform(1, 60, SIZE), true_px)
    plane = fit(street.mask, disparity_px, CAMERA)

    rows, columns = np.nonzero(street.mask)
    error_px = plane.disparity_px(rows, columns, CAMERA) - true_px[rows, columns]
    assert np.abs(error_px).max() < 0.5


def test_without_any_depth_the_camera_is_level_at_its_mount() -> None:
    street = _street()
    unknown = np.zeros_like(street.depth_m)
    _, boundary_m = _projected(street, unknown)

    assert np.quantile(_edge_errors_m(boundary_m), 0.9) < 0.1


def test_no_boundary_is_claimed_behind_something_upright() -> None:
    block = Block(9.0, 0.0, 0.0, (2.0, 2.0), 1.5, (200, 30, 30))
    street = _street(block)
    _, boundary_m = _projected(street)

    assert len(boundary_m) > 20
    assert (np.abs(boundary_m[:, 1]) > HALF_M - 0.4).all()


def test_no_boundary_is_claimed_where_the_image_ends() -> None:
    everywhere = np.ones(SIZE, np.float32)
    everywhere[:HORIZON] = 0.0

    road_m, boundary_m = project(everywhere, _street().depth_m, CAMERA)

    assert len(road_m) > 100
    assert boundary_m.shape == (0, 2)


def test_no_boundary_is_claimed_at_the_outermost_pixels() -> None:
    almost = np.zeros(SIZE, np.float32)
    almost[HORIZON:-2, 2:-2] = 1.0
    _, boundary_m = project(almost, _street().depth_m, CAMERA)

    assert boundary_m.shape == (0, 2)


def test_left_is_positive() -> None:
    street = _street()
    left_half = street.mask & (np.arange(320) < 160)
    likelihood = left_half.astype(np.float32)

    road_m, _ = project(likelihood, street.depth_m, CAMERA)
    left_m = road_m[:, 1]

    assert (left_m > -0.1).all()
    assert left_m.max() > 3.0


def _left_m(depth_m: np.ndarray) -> np.ndarray:
    """How far to the left of the camera each pixel of a depth image is."""
    _, columns = np.indices(SIZE)
    return (CAMERA.cx_px - columns) / CAMERA.fx_px * depth_m


def test_what_stands_on_the_road_is_no_road_though_it_is_in_the_mask() -> None:
    block = Block(8.0, 0.0, 0.0, (2.0, 3.0), 1.2, (90, 90, 90))
    street = _street(block)
    rows, _ = np.indices(SIZE)
    in_street = np.abs(_left_m(street.depth_m)) < HALF_M
    everything = (rows > CAMERA.cy_px) & in_street

    road_m, _ = project(everything.astype(np.float32), street.depth_m, CAMERA)

    ahead_m, left_m = road_m.T
    behind = (np.abs(left_m) < 1.0) & (ahead_m > 9.0)
    assert len(road_m) > 100
    assert not behind.any()


def test_no_road_in_the_image_is_no_road_on_the_ground() -> None:
    nowhere = np.zeros(SIZE, np.float32)

    for points in project(nowhere, _street().depth_m, CAMERA):
        assert points.shape == (0, 2)
        assert points.dtype == np.float32
