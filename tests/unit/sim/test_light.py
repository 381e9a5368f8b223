"""Light, shadow and the camera's way of taking them."""

from __future__ import annotations

import math

import numpy as np

from cogmap.services.sim.rendering.light import (
    Light,
    brightness,
    expose,
    relief,
    shadow_top,
    some_light,
)

TOWER = ((-2.0, -2.0, 2.0, 2.0), 10.0)
EVENING = Light(sun_azimuth_rad=0.0, sun_elevation_rad=math.radians(45), shade=0.5)
DOWN = np.array([0.0, 0.0, -1.0], np.float32)
SIDE_PX = 8
ABOVE_M = 100.0


def _bright(points_m: list[tuple[float, float, float]], light: Light = EVENING) -> list[float]:
    """How bright points are, each seen from far above and filling a picture of its own."""
    top_m = shadow_top(relief([TOWER]), light)
    rays = np.broadcast_to(DOWN, (SIDE_PX, SIDE_PX, 3))
    depth_m = np.full((SIDE_PX, SIDE_PX), ABOVE_M, np.float32)

    found = []
    for x, y, z in points_m:
        eye_m = np.array([x, y, z + ABOVE_M])
        picture = brightness(depth_m, rays, eye_m, top_m, light)
        found.append(float(picture[4, 4]))

    return found


def _lights() -> list[Light]:
    lights = []
    for seed in range(50):
        rng = np.random.default_rng(seed)
        lights.append(some_light(rng))
    return lights


def test_a_tower_throws_its_shadow_away_from_the_sun_as_far_as_it_is_high() -> None:
    behind = (-6, 0, 0)
    beyond = (-14, 0, 0)
    before = (6, 0, 0)
    aside = (-6, 6, 0)

    assert _bright([behind, beyond, before, aside]) == [0.5, 1.0, 1.0, 1.0]


def test_what_is_higher_than_the_shadow_is_lit() -> None:
    low = (-6, 0, 2)
    high = (-6, 0, 8)

    assert _bright([low, high]) == [0.5, 1.0]


def test_under_a_clouded_sky_there_is_no_shadow() -> None:
    clouded = Light(sun_azimuth_rad=0.0, sun_elevation_rad=math.radians(45))
    behind = (-6, 0, 0)

    assert _bright([behind], clouded) == [1.0]


def test_the_camera_takes_brightness_colour_gain_and_noise() -> None:
    grey = np.full((60, 80, 3), 100, np.uint8)
    lit = np.ones((60, 80), np.float32)
    rng = np.random.default_rng(1)

    warm = expose(grey, lit, Light(0.0, 1.0, cast=(1.2, 1.0, 0.8)), rng)
    assert warm[0, 0].tolist() == [120, 100, 80]

    dim = expose(grey, 0.5 * lit, Light(0.0, 1.0, gain=0.8), rng)
    assert dim[0, 0].tolist() == [40, 40, 40]

    noisy = expose(grey, lit, Light(0.0, 1.0, noise=4.0), rng)
    assert abs(noisy.mean() - 100) < 0.5
    assert 2.0 < noisy.std() < 4.5


def test_a_seed_gives_its_light_again_and_the_sun_is_always_up() -> None:
    lights = _lights()
    gains = {light.gain for light in lights}

    assert lights == _lights()
    assert len(gains) == len(lights)
    assert all(light.sun[2] > 0.2 for light in lights)
