"""The centre of a building does not depend on which of its walls are seen."""

from __future__ import annotations

import math

import numpy as np
import pytest

from services.epam.layout.footprint_fit import ObjectPose, Silhouette, locate
from tests.support.blocks import CAMERA, Block

SIDES_M = (12.0, 8.0)


def _seen(
    x_m: float,
    y_m: float,
    turn_rad: float,
    window: tuple[int, int] = (0, 320),
    noise_px: float = 0.0,
) -> Silhouette:
    """The outline of a block, as far as it is in the columns of `window`."""
    columns = np.arange(CAMERA.width_px, dtype=float)
    depth = Block(x_m, y_m, turn_rad, SIDES_M, 8.0, (0, 0, 0)).depth_m(
        (columns - CAMERA.cx_px) / CAMERA.fx_px
    )
    whole = np.flatnonzero(np.isfinite(depth))
    shown = whole[(whole >= window[0]) & (whole < window[1])]
    disparity = CAMERA.fx_px * CAMERA.baseline_m / depth[shown]
    return Silhouette(
        columns=columns[shown],
        disparity_px=disparity + np.random.default_rng(1).normal(0, noise_px, len(shown)),
        left=shown[0] - 0.5,
        right=shown[-1] + 0.5,
        left_true=bool(shown[0] == whole[0] and shown[0] > 0),
        right_true=bool(shown[-1] == whole[-1] and shown[-1] < CAMERA.width_px - 1),
        sides_m=SIDES_M,
    )


def _error_m(place: ObjectPose, x_m: float, y_m: float) -> float:
    return math.hypot(
        place.range_m * math.cos(place.bearing_rad) - x_m,
        place.range_m * math.sin(place.bearing_rad) - y_m,
    )


@pytest.mark.parametrize("turn_rad", [0.0, 0.3, 0.8, 1.2, 1.57, 2.4])
@pytest.mark.parametrize(("x_m", "y_m"), [(20.0, 0.0), (22.0, 9.0), (30.0, -12.0)])
def test_the_centre_is_the_same_from_every_side(x_m: float, y_m: float, turn_rad: float) -> None:
    place = locate([_seen(x_m, y_m, turn_rad)], CAMERA)[0]

    assert _error_m(place, x_m, y_m) < 0.4
    assert place.misfit < 0.3


def test_errors_agree_with_the_standard_deviations() -> None:
    rng = np.random.default_rng(2)
    scores = []
    for _ in range(30):
        x_m = rng.uniform(18, 45)
        y_m = rng.uniform(-6, 6)
        turn_rad = rng.uniform(0, math.pi)
        place = locate([_seen(x_m, y_m, turn_rad, noise_px=0.12)], CAMERA)[0]
        scores.append((place.range_m - math.hypot(x_m, y_m)) / place.range_sd_m)

    assert 0.2 < float(np.sqrt(np.mean(np.square(scores)))) < 1.5


def test_a_partly_visible_building_has_larger_standard_deviations() -> None:
    whole = locate([_seen(20.0, 0.0, 0.4)], CAMERA)[0]
    cut = locate([_seen(20.0, 0.0, 0.4, window=(0, 130))], CAMERA)[0]

    assert cut.range_sd_m > 1.5 * whole.range_sd_m
    assert cut.bearing_sd_rad > 2 * whole.bearing_sd_rad


def test_several_objects_are_placed_as_each_alone_is() -> None:
    outlines = [_seen(20.0, 4.0, 0.2), _seen(35.0, -9.0, 1.0, noise_px=0.1)]
    together = locate(outlines, CAMERA)
    for place, outline in zip(together, outlines, strict=True):
        alone = locate([outline], CAMERA)[0]
        assert (place.bearing_rad, place.range_m) == pytest.approx(
            (alone.bearing_rad, alone.range_m), abs=1e-9
        )

    assert together == locate(outlines, CAMERA)
    assert locate([], CAMERA) == []
