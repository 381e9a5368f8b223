"""Augmentation: other viewpoints, light and cameras, from images with labels."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from cogmap.geometry.arrays import Booleans, Bytes, Floats, Singles
from cogmap.services.epam.layout.road import HEIGHT_PX, WIDTH_PX

SIZE_PX = (WIDTH_PX, HEIGHT_PX)


@dataclass(frozen=True)
class Augmentation:
    """How much is varied. `zoom` is the smallest and the largest magnification, `shift` the largest
    translation, as a share of the image's size, and `turn_deg` the largest rotation; `contrast`,
    `cast` and `gamma` are factors about 1, given as natural logarithms; `noise` and `brightness`
    are in grey levels of 255; a shadow and a blur are given to shares of the images.

    `slope` is how far the corners of the image are moved at most, as a share of its size, half as
    far up and down; `saturation` is the largest share of its colour that is taken or added;
    `backlit_share` is that of images whose lower part gets another light than the upper, and
    `grey_share` that of images without colour. `stretch` is how much wider or narrower an image
    becomes, as a natural logarithm.

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
    stretch: float = 0.0
    grey_share: float = 0.0


@dataclass(frozen=True, eq=False)
class LabelledImage:
    """An image, uint8 (h, w, 3), and, uint8 (h, w) each, how much of a pixel is road, and how much
    of it is known.
    """

    image: Bytes
    road: Bytes
    known: Bytes

    @classmethod
    def of(
        cls,
        image: Bytes,
        road: Booleans,
        known: Booleans,
        size_px: tuple[int, int] = SIZE_PX,
    ) -> LabelledImage:
        """Return `image` with masks of the pixels (h, w) that show road, and of those for which
        that is known, at `size_px`: columns, rows.
        """
        masks = [255 * mask.astype(np.uint8) for mask in (road, known)]
        small = []
        for values in (image, *masks):
            resized = cv2.resize(values, size_px, interpolation=cv2.INTER_AREA)
            small.append(resized.astype(np.uint8, copy=False))
        return cls(*small)


def augmented(
    labelled: LabelledImage,
    how: Augmentation,
    rng: np.random.Generator,
    size_px: tuple[int, int] = SIZE_PX,
) -> LabelledImage:
    """Return a variation of `labelled`, at `size_px`: columns, rows."""
    matrix = _homography(labelled.image.shape[:2], how, rng, size_px)
    image = cv2.warpPerspective(labelled.image, matrix, size_px, borderMode=cv2.BORDER_REPLICATE)
    road = cv2.warpPerspective(labelled.road, matrix, size_px)
    known = cv2.warpPerspective(labelled.known, matrix, size_px)

    return LabelledImage(
        image=relit(image.astype(np.float32), how, rng),
        road=road.astype(np.uint8),
        known=known.astype(np.uint8),
    )


def augmented_classes(
    image: Bytes, label: Bytes, outside: int, how: Augmentation, rng: np.random.Generator
) -> tuple[Bytes, Bytes]:
    """Return a variation of an image (h, w, 3) and of the classes of its pixels (h, w), `outside`
    where the image shows nothing.
    """
    height, width = label.shape
    size_px = (width, height)
    matrix = _homography(label.shape, how, rng, size_px)
    moved = cv2.warpPerspective(image, matrix, size_px, borderMode=cv2.BORDER_REPLICATE)
    moved_label = cv2.warpPerspective(
        label, matrix, size_px, flags=cv2.INTER_NEAREST, borderValue=outside
    )
    return relit(moved.astype(np.float32), how, rng), moved_label.astype(np.uint8)


def _homography(
    size: tuple[int, ...],
    how: Augmentation,
    rng: np.random.Generator,
    new_size_px: tuple[int, int],
) -> Floats:
    """Draw the map, (3, 3), from pixels of an image of `size` (h, w) to those of its variation of
    that new size, columns and rows: seen by a turned camera, or one on a road that rises or falls,
    and then as by `_affine`.
    """
    height, width = size
    corners_px = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float32)
    moved = rng.uniform(-how.slope, how.slope, (4, 2)) * (width, height / 2)
    moved_px = (corners_px + moved).astype(np.float32)
    sloped = cv2.getPerspectiveTransform(corners_px, moved_px)
    return np.vstack([_affine(size, how, rng, new_size_px), [0, 0, 1]]) @ sloped


def _affine(
    size: tuple[int, ...],
    how: Augmentation,
    rng: np.random.Generator,
    new_size_px: tuple[int, int],
) -> Floats:
    """Draw the affine map, (2, 3), from pixels of an image of `size` (h, w) to those of its
    variation of that new size, columns and rows: zoomed, turned, shifted and perhaps mirrored.
    """
    new_width, new_height = new_size_px
    zoom = np.exp(rng.uniform(*np.log(how.zoom)))
    turn_rad = np.radians(rng.uniform(-how.turn_deg, how.turn_deg))
    mirror = rng.choice((-1.0, 1.0))

    height, width = size
    across = zoom * new_width / width
    down = zoom * new_height / height
    if how.stretch:
        stretch = np.exp(rng.uniform(-how.stretch, how.stretch) / 2)
        across *= stretch
        down /= stretch

    cos = np.cos(turn_rad)
    sin = np.sin(turn_rad)
    linear = np.array(
        [
            [mirror * across * cos, -down * sin],
            [mirror * across * sin, down * cos],
        ]
    )

    # About the middle of the image.
    shift_px = rng.uniform(-how.shift, how.shift, 2) * new_size_px
    middle_px = np.array([width - 1, height - 1]) / 2
    new_middle_px = np.array([new_width - 1, new_height - 1]) / 2
    return np.column_stack([linear, new_middle_px + shift_px - linear @ middle_px])


def relit(image: Singles, how: Augmentation, rng: np.random.Generator) -> Bytes:
    """Show `image` (h, w, 3) in another light, by another camera."""
    height, width, _ = image.shape
    if rng.random() < how.blur_share:
        blurred = cv2.GaussianBlur(image, (3, 3), rng.uniform(0.4, 1.0))
        image = blurred.astype(np.float32, copy=False)

    if how.saturation:
        grey = image.mean(axis=2, keepdims=True)
        added = np.float32(rng.uniform(-how.saturation, how.saturation))
        image = np.asarray(image + (image - grey) * added, np.float32)

    if how.grey_share and rng.random() < how.grey_share:
        image = image.mean(axis=2, keepdims=True).repeat(3, axis=2)

    if how.backlit_share and rng.random() < how.backlit_share:
        # The ground is darker than the sky, seldom brighter.
        rows = np.arange(height) / height
        horizon = rng.uniform(0.2, 0.55)
        softness = rng.uniform(0.03, 0.4)
        below = np.clip((rows - horizon) / softness, 0, 1)
        light = np.exp(rng.uniform(-1.3, 0.5) * below)
        image *= np.asarray(light, np.float32)[:, None, None]

    if rng.random() < how.shadow_share:
        image *= _shadow(height, width, rng)

    # The camera's response: the new level of each of 256 levels in each colour.
    contrast = rng.uniform(-how.contrast, how.contrast)
    gain = np.exp(contrast + rng.uniform(-how.cast, how.cast, 3))
    gamma = np.exp(rng.uniform(-how.gamma, how.gamma))
    offset = rng.uniform(-how.brightness, how.brightness)
    curve = 255 * (np.arange(256) / 255) ** gamma
    response = np.asarray(curve[:, None] * gain + offset, np.float32)
    levels = np.clip(image, 0, 255).astype(np.uint8)
    image = response[levels, np.arange(3)]

    noise = rng.standard_normal(image.shape, np.float32)
    image += noise * np.float32(rng.uniform(0, how.noise))
    return np.clip(image, 0, 255).astype(np.uint8)


def _shadow(height: int, width: int, rng: np.random.Generator) -> Singles:
    """Draw the share of light left in a straight band of shadow, (h, w, 1)."""
    rows, columns = np.indices((height, width), dtype=np.float32, sparse=True)
    direction_rad = rng.uniform(0, np.pi)
    right_px = np.cos(direction_rad) * (columns - width / 2)
    across_px = right_px + np.sin(direction_rad) * (rows - height / 2)

    # Drawn for images of WIDTH_PX.
    scale = width / WIDTH_PX
    middle_px = scale * rng.uniform(-80, 80)
    half_px = scale * rng.uniform(5, 60)
    edge_px = scale * rng.uniform(0.5, 4.0)
    inside_px = half_px - np.abs(across_px - middle_px)
    shade = np.clip(inside_px / edge_px + 0.5, 0, 1)

    light = 1 - rng.uniform(0.2, 0.65) * shade
    return np.asarray(light, np.float32)[..., None]
