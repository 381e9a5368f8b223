"""A segment as the network receives it: itself, its surroundings, and the light."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from cogmap.services.epam.recognition.crop import CHANNELS, SIDE_PX, colours, crop, surroundings
from cogmap.services.epam.recognition.segments import Segment
from tests.support.world.blocks import CAMERA, painted

SIZE = (240, 320)
MIDDLE = SIDE_PX // 2
NOTHING = np.zeros(6, np.float32)
GREY = np.full((*SIZE, 3), 200, np.uint8)
FOCAL_LENGTH_PX = 200.0


def _segment(left: int, top: int) -> Segment:
    mask = np.zeros(SIZE, np.bool_)
    mask[top : top + 40, left : left + 80] = True
    return Segment(mask, (left, top, 80, 40))


def _crop(segment: Segment, depth_m: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """A segment of a grey image without surroundings, as the network receives it."""
    return crop(GREY, depth_m, segment, NOTHING, FOCAL_LENGTH_PX)


def test_a_crop_shows_the_segment_alone_and_its_size() -> None:
    segment = _segment(50, 100)
    near = _crop(segment, np.full(SIZE, 10.0, np.float32))
    far = _crop(segment, np.full(SIZE, 40.0, np.float32))

    assert near.shape == (CHANNELS, SIDE_PX, SIDE_PX)
    assert near[3, MIDDLE, MIDDLE] == 1.0
    assert not near[:4, :8].any()
    assert near[0, MIDDLE, MIDDLE] == pytest.approx(200 / 64 - 2)
    assert near[5, 0, 0] < far[5, 0, 0]


def test_a_crop_shows_what_is_farther_and_nearer_than_the_segment() -> None:
    depth_m = np.full(SIZE, 20.0, np.float32)
    depth_m[40:, :40] = 15.0
    depth_m[40:, 40:] = 40.0
    relief = _crop(_segment(0, 0), depth_m)[4]

    assert relief[MIDDLE, MIDDLE] == 0.0
    assert relief[-5, MIDDLE - 10] < -0.9
    assert relief[-5, MIDDLE + 10] > 0.9
    assert not relief[0].any()


def test_the_light_is_described_by_the_colours_of_ground_and_sky() -> None:
    image, depth_m, _ = painted([])
    around = surroundings(image, depth_m, CAMERA)
    sky = np.median(image[:60].reshape(-1, 3), axis=0)
    np.testing.assert_allclose(around[3:], colours(sky), atol=0.02)

    half_as_bright = (image * 0.5).astype(np.uint8)
    darker = surroundings(half_as_bright, depth_m, CAMERA)
    np.testing.assert_allclose(darker + 2, (around + 2) / 2, atol=0.02)

    shown = crop(image, depth_m, _segment(50, 100), around, FOCAL_LENGTH_PX)
    assert (shown[6:] == around[:, None, None]).all()


def test_what_is_not_in_view_has_no_colour() -> None:
    image, _, _ = painted([])
    behind_a_wall = surroundings(image, np.full(SIZE, 4.0, np.float32), CAMERA)
    too_near = surroundings(image, np.full(SIZE, 0.01, np.float32), CAMERA)

    assert not behind_a_wall[3:].any()
    assert not too_near.any()
