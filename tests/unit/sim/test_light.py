"""Light, shadow and the camera's way of taking them."""

from __future__ import annotations

import math

import numpy as np

from services.sim.rendering.light import Light, brightness, expose, relief, shadow_top, some_light

TOWER = ((-2.0, -2.0, 2.0, 2.0), 10.0)
EVENING = Light(sun_azimuth_rad=0.0, sun_elevation_rad=math.radians(45), shade=0.5)


def _bright(points_m: list[tuple[float, float, float]], light: Light = EVENING) -> list[float]:
    """How bright points are, each seen from far above and filling a picture of its own."""
    top_m = shadow_top(relief([TOWER]), light)
    found = []
    for x, y, z in points_m:
        rays = np.broadcast_to(np.array([0.0, 0.0, -1.0], np.float32), (8, 8, 3))
        depth_m = np.full((8, 8), 100.0, np.float32)
        found.append(
            float(brightness(depth_m, rays, np.array([x, y, z + 100.0]), top_m, light)[4, 4])
        )

    return found


def test_a_tower_throws_its_shadow_away_from_the_sun_as_far_as_it_is_high() -> None:
    behind, beyond, before, aside = _bright([(-6, 0, 0), (-14, 0, 0), (6, 0, 0), (-6, 6, 0)])

    assert (behind, beyond, before, aside) == (0.5, 1.0, 1.0, 1.0)


def test_what_is_higher_than_the_shadow_is_lit() -> None:
    assert _bright([(-6, 0, 2), (-6, 0, 8)]) == [0.5, 1.0]


def test_under_a_clouded_sky_there_is_no_shadow() -> None:
    clouded = Light(sun_azimuth_rad=0.0, sun_elevation_rad=math.radians(45))

    assert _bright([(-6, 0, 0)], clouded) == [1.0]


def test_the_camera_takes_brightness_colour_gain_and_noise() -> None:
    grey = np.full((60, 80, 3), 100, np.uint8)
    lit = np.ones((60, 80), np.float32)
    rng = np.random.default_rng(1)
    warm = expose(grey, lit, Light(0.0, 1.0, cast=(1.2, 1.0, 0.8)), rng)
    dim = expose(grey, 0.5 * lit, Light(0.0, 1.0, gain=0.8), rng)
    noisy = expose(grey, lit, Light(0.0, 1.0, noise=4.0), rng)

    assert warm[0, 0].tolist() == [120, 100, 80]
    assert dim[0, 0].tolist() == [40, 40, 40]
    assert abs(noisy.mean() - 100) < 0.5
    assert 2.0 < noisy.std() < 4.5


def test_a_seed_gives_its_light_again_and_the_sun_is_always_up() -> None:
    lights = [some_light(np.random.default_rng(seed)) for seed in range(50)]

    assert lights == [some_light(np.random.default_rng(seed)) for seed in range(50)]
    assert all(light.sun[2] > 0.2 for light in lights)
    assert len({light.gain for light in lights}) == 50
