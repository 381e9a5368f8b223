"""Variations of labelled images: the label moves with the image, and light changes what it may."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.training.augment import Augmentation, LabelledImage, augmented, augmented_classes

SIZE = (180, 240)
STILL = Augmentation(
    zoom=(1.0, 1.0),
    shift=0.0,
    turn_deg=0.0,
    contrast=0.0,
    gamma=0.0,
    cast=0.0,
    brightness=0.0,
    noise=0.0,
    shadow_share=0.0,
    blur_share=0.0,
)
SEEDS = range(8)


@pytest.fixture
def labelled() -> LabelledImage:
    """A bright road below a dark wall, all of it known."""
    road = np.zeros(SIZE, np.uint8)
    road[90:] = 255
    image = np.where(road[..., None] > 0, 200, 60).astype(np.uint8)
    known = np.full(SIZE, 255, np.uint8)
    return LabelledImage(image.repeat(3, axis=2), road, known)


def _varied(labelled: LabelledImage, how: Augmentation, seed: int) -> LabelledImage:
    return augmented(labelled, how, np.random.default_rng(seed))


@pytest.mark.parametrize("seed", SEEDS)
def test_on_a_slope_the_label_moves_with_the_image(labelled: LabelledImage, seed: int) -> None:
    sloped = _varied(labelled, Augmentation(**{**vars(STILL), "slope": 0.2}), seed)
    flat = _varied(labelled, STILL, seed)
    assert (sloped.road != flat.road).mean() > 0.01

    inside = sloped.known == 255
    is_bright = sloped.image[..., 0] > 130
    is_road = sloped.road > 127
    assert (is_bright == is_road)[inside].mean() > 0.99


def test_on_a_slope_what_was_not_in_the_image_is_not_known(labelled: LabelledImage) -> None:
    shares = []
    for seed in SEEDS:
        sloped = _varied(labelled, Augmentation(**{**vars(STILL), "slope": 0.2}), seed)
        shares.append((sloped.known < 255).mean())

    assert 0.02 < np.mean(shares) < 0.4


def test_backlight_changes_the_ground_and_leaves_the_sky(labelled: LabelledImage) -> None:
    how = Augmentation(**{**vars(STILL), "backlit_share": 1.0})
    ground = []
    for seed in SEEDS:
        lit = _varied(labelled, how, seed).image
        assert (lit[:20] == 60).all()
        ground.append(int(lit[-1, 0, 0]))

    assert min(ground) < 120
    assert len(set(ground)) > 4


def test_saturation_changes_colours_and_leaves_grey(labelled: LabelledImage) -> None:
    how = Augmentation(**{**vars(STILL), "saturation": 0.8})
    grey = _varied(labelled, how, 0).image
    assert np.array_equal(grey, _varied(labelled, STILL, 0).image)

    orange = np.full((*SIZE, 3), (180, 120, 60), np.uint8)
    coloured = LabelledImage(orange, labelled.road, labelled.known)
    spans = [np.ptp(_varied(coloured, how, seed).image[0, 0].astype(int)) for seed in SEEDS]
    assert min(spans) < 90
    assert max(spans) > 150


def test_a_grey_camera_shows_no_colour_and_the_same_brightness(labelled: LabelledImage) -> None:
    orange = np.full((*SIZE, 3), (180, 120, 60), np.uint8)
    coloured = LabelledImage(orange, labelled.road, labelled.known)
    varied = _varied(coloured, Augmentation(**{**vars(STILL), "grey_share": 1.0}), 0)

    assert (varied.image == 120).all()


def test_a_stretched_street_is_wider_or_narrower_than_it_was(labelled: LabelledImage) -> None:
    road = np.zeros(SIZE, np.uint8)
    road[60:120, 90:150] = 255
    square = LabelledImage(labelled.image, road, labelled.known)

    shapes = []
    for seed in SEEDS:
        how = Augmentation(**{**vars(STILL), "stretch": 0.8})
        varied = augmented(square, how, np.random.default_rng(seed), SIZE[::-1])
        is_road = varied.road > 127
        shapes.append(is_road.any(0).sum() / is_road.any(1).sum())

    assert min(shapes) < 0.75
    assert max(shapes) > 1.33


@pytest.mark.parametrize("seed", SEEDS)
def test_classes_move_with_the_image_and_are_unknown_outside(
    labelled: LabelledImage, seed: int
) -> None:
    how = Augmentation(**{**vars(STILL), "slope": 0.2, "zoom": (0.7, 0.8)})
    label = np.where(labelled.road > 0, 3, 1).astype(np.uint8)
    image, classes = augmented_classes(labelled.image, label, 11, how, np.random.default_rng(seed))

    assert set(np.unique(classes).tolist()) == {1, 3, 11}
    inside = classes != 11
    assert ((image[..., 0] > 130) == (classes == 3))[inside].mean() > 0.98
