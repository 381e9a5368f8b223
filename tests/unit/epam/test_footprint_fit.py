"""The centre of a building does not depend on which of its walls are seen."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from cogmap.schemas.sensing import Percept
from cogmap.services.epam.layout.footprint_fit import ObjectPose, Silhouette, locate
from cogmap.testing import percept
from tests.support.world.blocks import CAMERA, Block

SIDES_M = (12.0, 8.0)
KNOWN_SD_M = (0.02, 0.02)


def _seen(
    x_m: float,
    y_m: float,
    turn_rad: float,
    *,
    window: tuple[int, int] = (0, 320),
    noise_px: float = 0.0,
    expected_m: tuple[float, float] = SIDES_M,
    expected_sd_m: tuple[float, float] = KNOWN_SD_M,
) -> Silhouette:
    """The outline of a block, as far as it is in the columns of `window`, and the sides that are
    expected of it.
    """
    columns = np.arange(CAMERA.width_px, dtype=float)
    slope = (columns - CAMERA.cx_px) / CAMERA.fx_px
    depth_m = Block(x_m, y_m, turn_rad, SIDES_M, 8.0, (0, 0, 0)).depth_m(slope)
    whole = np.flatnonzero(np.isfinite(depth_m))
    shown = whole[(whole >= window[0]) & (whole < window[1])]
    left, right = shown[[0, -1]]

    noise = np.random.default_rng(1).normal(0, noise_px, len(shown))
    disparity_px = CAMERA.fx_px * CAMERA.baseline_m / depth_m[shown]
    return Silhouette(
        columns=columns[shown],
        disparity_px=disparity_px + noise,
        left=left - 0.5,
        right=right + 0.5,
        left_true=bool(left == whole[0] and left > 0),
        right_true=bool(right == whole[-1] and right < CAMERA.width_px - 1),
        sides_m=expected_m,
        sides_sd_m=expected_sd_m,
    )


def _located(outline: Silhouette) -> ObjectPose:
    (place,) = locate([outline], CAMERA)
    return place


def _error_m(place: ObjectPose, x_m: float, y_m: float) -> float:
    found_x_m = place.range_m * math.cos(place.bearing_rad)
    found_y_m = place.range_m * math.sin(place.bearing_rad)
    return math.hypot(found_x_m - x_m, found_y_m - y_m)


@pytest.mark.parametrize("turn_rad", [0.0, 0.3, 0.8, 1.2, 1.57, 2.4])
@pytest.mark.parametrize(("x_m", "y_m"), [(20.0, 0.0), (22.0, 9.0), (30.0, -12.0)])
def test_the_centre_is_the_same_from_every_side(x_m: float, y_m: float, turn_rad: float) -> None:
    place = _located(_seen(x_m, y_m, turn_rad))

    assert _error_m(place, x_m, y_m) < 0.4
    assert place.misfit < 0.3


def test_errors_agree_with_the_standard_deviations() -> None:
    rng = np.random.default_rng(2)
    scores = []
    for _ in range(30):
        x_m = rng.uniform(18, 45)
        y_m = rng.uniform(-6, 6)
        turn_rad = rng.uniform(0, math.pi)
        place = _located(_seen(x_m, y_m, turn_rad, noise_px=0.12))
        error_m = place.range_m - math.hypot(x_m, y_m)
        scores.append(error_m / place.range_sd_m)

    root_mean_square = float(np.sqrt(np.mean(np.square(scores))))
    assert 0.2 < root_mean_square < 1.5


def test_a_partly_visible_building_has_larger_standard_deviations() -> None:
    whole = _located(_seen(20.0, 0.0, 0.4))
    cut = _located(_seen(20.0, 0.0, 0.4, window=(0, 130)))

    assert cut.range_sd_m > 1.5 * whole.range_sd_m
    assert cut.bearing_sd_rad > 2 * whole.bearing_sd_rad


def test_the_sides_of_a_building_are_found_where_two_walls_of_it_are_seen() -> None:
    outline = _seen(20.0, 0.0, 0.8, expected_m=(9.0, 9.0), expected_sd_m=(2.0, 2.0))
    place = _located(outline)

    assert place.width_m == pytest.approx(10.0, abs=0.5)
    assert _error_m(place, 20.0, 0.0) < 1.0


def test_a_building_whose_sides_are_unknown_is_placed_less_surely() -> None:
    known = _located(_seen(20.0, 0.0, 0.0))
    unknown = _located(_seen(20.0, 0.0, 0.0, expected_sd_m=(2.0, 2.0)))

    assert unknown.range_sd_m > 1.5 * known.range_sd_m


def test_several_objects_are_placed_as_each_alone_is() -> None:
    outlines = [_seen(20.0, 4.0, 0.2), _seen(35.0, -9.0, 1.0, noise_px=0.1)]
    together = locate(outlines, CAMERA)
    for place, outline in zip(together, outlines, strict=True):
        alone = _located(outline)
        assert place.bearing_rad == pytest.approx(alone.bearing_rad, abs=1e-9)
        assert place.range_m == pytest.approx(alone.range_m, abs=1e-9)

    assert together == locate(outlines, CAMERA)
    assert locate([], CAMERA) == []


def test_a_pose_that_is_widened_errs_by_so_many_times_more_and_stays_where_it_is() -> None:
    place = _located(_seen(20.0, 0.0, 0.3))
    wide = place.widened(3.0)

    assert (wide.range_m, wide.bearing_rad) == (place.range_m, place.bearing_rad)
    assert wide.range_sd_m == pytest.approx(3 * place.range_sd_m)
    assert wide.bearing_sd_rad == pytest.approx(3 * place.bearing_sd_rad)


def test_a_pose_at_the_camera_is_stated_as_a_percept_without_a_bearing() -> None:
    pose = ObjectPose(
        bearing_rad=0.0, range_m=0.5, bearing_sd_rad=9.0, range_sd_m=2.0, misfit=0.0, width_m=8.0
    )
    stated = percept("house", bearing_sd_rad=pose.stated_bearing_sd_rad)

    received = msgspec.convert(msgspec.to_builtins(stated), Percept)
    assert not received.has_bearing
    assert pose.widened(0.1).stated_bearing_sd_rad == pytest.approx(0.9)
