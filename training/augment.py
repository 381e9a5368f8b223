"""Augmentation: other viewpoints, light and cameras, from images with labels."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from cogmap.geometry.arrays import Bytes, Floats, Singles
from cogmap.services.epam.layout.road import HEIGHT_PX, WIDTH_PX


@dataclass(frozen=True)
class Augmentation:
    """How much is varied. `zoom` is the smallest and the largest magnification, `shift` the largest
    translation, as a share of the image's size, and `turn_deg` the largest rotation; `contrast`,
    `cast` and `gamma` are factors about 1, given as natural logarithms; `noise` and `brightness`
    are in grey levels of 255; a shadow and a blur are given to shares of the images.

    `slope` is how far the corners of the image are moved at most, as a share of its size, half as
    far up and down; `saturation` is the largest share of its colour that is taken or added;
    `backlit_share` is that of images whose lower part gets another light than the upper.

    The defaults vary little, for renderings, which have much of this variation themselves.
    """

    zoom: tuple[float, float] = (0.9, 1.15)
    shift: float = 0.05
    turn_deg: float = 2.0
    contrast: float = 0.15
    gamma: float = 0.1
    cast: float = 0.05
    brightness: float = 8.0
    noise: float = 4.0
    shadow_share: float = 0.15
    blur_share: float = 0.1
    slope: float = 0.0
    saturation: float = 0.0
    backlit_share: float = 0.0


@dataclass(frozen=True, eq=False)
class LabelledImage:
    """An image, uint8 (h, w, 3), and, uint8 (h, w) each, how much of a pixel is road and how much
    of it is known.
    """

    image: Bytes
    road: Bytes
    known: Bytes


def augmented(
    labelled: LabelledImage, how: Augmentation, rng: np.random.Generator
) -> LabelledImage:
    """Return a variation of `labelled`, HEIGHT_PX by WIDTH_PX."""
    if how.slope:
        labelled = _sloped(labelled, how.slope, rng)

    original_size = labelled.image.shape[:2]
    matrix = _affine(original_size, how, rng)
    size = (WIDTH_PX, HEIGHT_PX)
    image = cv2.warpAffine(
        labelled.image,
        matrix,
        size,
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    road = cv2.warpAffine(labelled.road, matrix, size, flags=cv2.INTER_LINEAR)
    known = cv2.warpAffine(labelled.known, matrix, size, flags=cv2.INTER_LINEAR)

    relit = _relit(image.astype(np.float32), how, rng)
    return LabelledImage(
        image=relit,
        road=road.astype(np.uint8),
        known=known.astype(np.uint8),
    )


def resized(labelled: LabelledImage) -> LabelledImage:
    """Return `labelled` unchanged but for its size, HEIGHT_PX by WIDTH_PX."""
    return LabelledImage(
        image=_resized(labelled.image),
        road=_resized(labelled.road),
        known=_resized(labelled.known),
    )


def _resized(image: Bytes) -> Bytes:
    size = (WIDTH_PX, HEIGHT_PX)
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    return small.astype(np.uint8, copy=False)


def _sloped(labelled: LabelledImage, slope: float, rng: np.random.Generator) -> LabelledImage:
    """`labelled` as a camera sees it that is turned, or on a road that rises or falls."""
    height, width = labelled.image.shape[:2]
    corners_px = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float32)
    moved = rng.uniform(-slope, slope, (4, 2)) * (width, height / 2)
    moved_px = (corners_px + moved).astype(np.float32)

    matrix = cv2.getPerspectiveTransform(corners_px, moved_px)
    size = (width, height)
    image = cv2.warpPerspective(labelled.image, matrix, size, borderMode=cv2.BORDER_REPLICATE)
    road = cv2.warpPerspective(labelled.road, matrix, size)
    known = cv2.warpPerspective(labelled.known, matrix, size)
    return LabelledImage(
        image=image.astype(np.uint8, copy=False),
        road=road.astype(np.uint8, copy=False),
        known=known.astype(np.uint8, copy=False),
    )


def _affine(size: tuple[int, ...], how: Augmentation, rng: np.random.Generator) -> Floats:
    """The affine map, (2, 3), from pixels of an image of `size` (h, w) to those of its variation,
    perhaps mirrored.
    """
    height, width = size
    linear = _linear(size, how, rng)
    shift = rng.uniform(-how.shift, how.shift, 2)
    shift_px = shift * (WIDTH_PX, HEIGHT_PX)

    centre_px = _centre_px(width, height)
    new_centre_px = _centre_px(WIDTH_PX, HEIGHT_PX)
    mapped_px = linear @ centre_px

    translation_px = new_centre_px + shift_px - mapped_px
    return np.column_stack([linear, translation_px])


def _linear(size: tuple[int, ...], how: Augmentation, rng: np.random.Generator) -> Floats:
    """The linear part (2, 2) of that map: zoom, turn and mirror."""
    log_zoom = rng.uniform(*np.log(how.zoom))
    zoom = np.exp(log_zoom)
    turn_deg = rng.uniform(-how.turn_deg, how.turn_deg)
    turn_rad = np.radians(turn_deg)
    mirror = rng.choice((-1.0, 1.0))

    height, width = size
    across = zoom * WIDTH_PX / width
    down = zoom * HEIGHT_PX / height

    cos = np.cos(turn_rad)
    sin = np.sin(turn_rad)

    top_row = [mirror * across * cos, -down * sin]
    bottom_row = [mirror * across * sin, down * cos]
    return np.array([top_row, bottom_row])


def _centre_px(width: int, height: int) -> Floats:
    """The column and row (2,) in the middle of an image of this size."""
    last_px = np.array([width - 1, height - 1])
    return np.asarray(last_px / 2)


def _relit(image: Singles, how: Augmentation, rng: np.random.Generator) -> Bytes:
    """`image` (HEIGHT_PX, WIDTH_PX, 3) in another light, by another camera."""
    if rng.random() < how.blur_share:
        blurred = cv2.GaussianBlur(image, (3, 3), rng.uniform(0.4, 1.0))
        image = blurred.astype(np.float32, copy=False)

    if how.saturation:
        image = _saturated(image, rng.uniform(-how.saturation, how.saturation))

    if how.backlit_share and rng.random() < how.backlit_share:
        image *= _backlight(rng)

    if rng.random() < how.shadow_share:
        image *= _shadow(rng)

    levels = np.clip(image, 0, 255).astype(np.uint8)
    response = _response(how, rng)
    image = response[levels, np.arange(3)]

    noise = rng.standard_normal(image.shape, np.float32)
    noise_sd = np.float32(rng.uniform(0, how.noise))
    image += noise * noise_sd

    limited = np.clip(image, 0, 255)
    return limited.astype(np.uint8)


def _saturated(image: Singles, added: float) -> Singles:
    """`image` with this share of its colour `added`, or taken where it is below 0."""
    grey = image.mean(axis=2, keepdims=True)
    saturated = image + (image - grey) * np.float32(added)
    return np.asarray(saturated, np.float32)


def _backlight(rng: np.random.Generator) -> Singles:
    """The share of light that each row has, (HEIGHT_PX, 1, 1): the ground is darker than the sky,
    seldom brighter.
    """
    rows = np.arange(HEIGHT_PX) / HEIGHT_PX
    horizon = rng.uniform(0.2, 0.55)
    softness = rng.uniform(0.03, 0.4)
    below = np.clip((rows - horizon) / softness, 0, 1)

    log_light = rng.uniform(-1.3, 0.5)
    light = np.exp(log_light * below)
    return np.asarray(light, np.float32)[:, None, None]


def _response(how: Augmentation, rng: np.random.Generator) -> Singles:
    """A camera's response: the new level of each of 256 levels in each colour, (256, 3)."""
    contrast = rng.uniform(-how.contrast, how.contrast)
    cast = rng.uniform(-how.cast, how.cast, 3)
    gain = np.exp(contrast + cast)

    log_gamma = rng.uniform(-how.gamma, how.gamma)
    gamma = np.exp(log_gamma)
    offset = rng.uniform(-how.brightness, how.brightness)

    share = np.arange(256) / 255
    curve = 255 * share**gamma

    response = curve[:, None] * gain + offset
    return np.asarray(response, np.float32)


def _shadow(rng: np.random.Generator) -> Singles:
    """The share of light that is left, (HEIGHT_PX, WIDTH_PX, 1), by a shadow in a straight band."""
    across_px = _across_px(rng.uniform(0, np.pi))
    middle_px = rng.uniform(-80, 80)
    half_px = rng.uniform(5, 60)
    edge_px = rng.uniform(0.5, 4.0)

    from_middle_px = np.abs(across_px - middle_px)
    inside_px = half_px - from_middle_px
    shade = np.clip(inside_px / edge_px + 0.5, 0, 1)

    darkness = rng.uniform(0.2, 0.65)
    light = 1 - darkness * shade
    return np.asarray(light, np.float32)[..., None]


def _across_px(direction_rad: float) -> Floats:
    """How far each pixel (HEIGHT_PX, WIDTH_PX) lies from the middle in that direction."""
    rows, columns = np.indices((HEIGHT_PX, WIDTH_PX), dtype=np.float32, sparse=True)
    right_px = columns - WIDTH_PX / 2
    down_px = rows - HEIGHT_PX / 2

    cos = np.cos(direction_rad)
    sin = np.sin(direction_rad)

    across_px: Floats = cos * right_px + sin * down_px
    return across_px
