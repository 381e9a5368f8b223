"""Other views, light and cameras from the images there are, so that a network learns what holds in
all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from services.epam.layout.road import HEIGHT_PX, WIDTH_PX

Bytes = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float32]


@dataclass(frozen=True)
class Augmentation:
    """How much is varied. `zoom` is the least and the greatest enlargement, `shift` the most that
    the image moves, as a share of its size, and `turn_deg` the most that it turns; `contrast`,
    `cast` and `gamma` are factors about 1, given as natural logarithms; `noise` and `brightness`
    are in grey levels of 255.

    By default little, for renderings, which vary much of this themselves.
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


@dataclass(frozen=True, eq=False)
class Sample:
    """An image, uint8 (h, w, 3), and, uint8 (h, w) each, how much of a pixel is road and how much
    of it is known.
    """

    image: Bytes
    road: Bytes
    known: Bytes


def varied(sample: Sample, how: Augmentation, rng: np.random.Generator) -> Sample:
    """`sample` as it might have been, HEIGHT_PX by WIDTH_PX."""
    matrix = _warp(sample.image.shape[:2], how, rng)
    size = (WIDTH_PX, HEIGHT_PX)
    image = cv2.warpAffine(
        sample.image, matrix, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    road = cv2.warpAffine(sample.road, matrix, size, flags=cv2.INTER_LINEAR)
    known = cv2.warpAffine(sample.known, matrix, size, flags=cv2.INTER_LINEAR)
    return Sample(
        _relit(image.astype(np.float32), how, rng), road.astype(np.uint8), known.astype(np.uint8)
    )


def plain(sample: Sample) -> Sample:
    """`sample` as it is, HEIGHT_PX by WIDTH_PX."""
    parts = (sample.image, sample.road, sample.known)
    scaled = (
        cv2.resize(part, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_AREA) for part in parts
    )
    image, road, known = (part.astype(np.uint8, copy=False) for part in scaled)
    return Sample(image, road, known)


def _warp(
    size: tuple[int, ...], how: Augmentation, rng: np.random.Generator
) -> npt.NDArray[np.float64]:
    """The affine map, (2, 3), from pixels of an image of `size` to those of its variation."""
    height, width = size
    zoom = np.exp(rng.uniform(*np.log(how.zoom)))
    turn = np.radians(rng.uniform(-how.turn_deg, how.turn_deg))
    mirror = rng.choice((-1.0, 1.0))
    across = zoom * WIDTH_PX / width
    down = zoom * HEIGHT_PX / height
    cos = np.cos(turn)
    sin = np.sin(turn)
    linear = np.array([[mirror * across * cos, -down * sin], [mirror * across * sin, down * cos]])
    moved = rng.uniform(-how.shift, how.shift, 2) * (WIDTH_PX, HEIGHT_PX)
    centre = np.array([width - 1, height - 1]) / 2
    to = np.array([WIDTH_PX - 1, HEIGHT_PX - 1]) / 2 + moved - linear @ centre
    return np.column_stack([linear, to])


def _relit(image: Floats, how: Augmentation, rng: np.random.Generator) -> Bytes:
    """Another light, another camera."""
    if rng.random() < how.blur_share:
        image = cv2.GaussianBlur(image, (3, 3), rng.uniform(0.4, 1.0)).astype(
            np.float32, copy=False
        )
    if rng.random() < how.shadow_share:
        image *= _shadow(rng)
    gain = np.exp(rng.uniform(-how.contrast, how.contrast) + rng.uniform(-how.cast, how.cast, 3))
    gamma = np.exp(rng.uniform(-how.gamma, how.gamma))
    offset = rng.uniform(-how.brightness, how.brightness)
    levels = (255 * (np.arange(256) / 255) ** gamma)[:, None] * gain + offset
    image = levels.astype(np.float32)[np.clip(image, 0, 255).astype(np.uint8), np.arange(3)]
    image += rng.standard_normal(image.shape, np.float32) * np.float32(rng.uniform(0, how.noise))
    return np.clip(image, 0, 255).astype(np.uint8)


def _shadow(rng: np.random.Generator) -> Floats:
    """The light that is left, (HEIGHT_PX, WIDTH_PX, 1), beside one edge or between two."""
    rows, columns = np.indices((HEIGHT_PX, WIDTH_PX), dtype=np.float32, sparse=True)
    direction = rng.uniform(0, np.pi)
    along = np.cos(direction) * (columns - WIDTH_PX / 2) + np.sin(direction) * (
        rows - HEIGHT_PX / 2
    )
    middle = rng.uniform(-80, 80)
    half = rng.uniform(5, 60)
    shade = np.clip((half - np.abs(along - middle)) / rng.uniform(0.5, 4.0) + 0.5, 0, 1)
    return np.asarray(1 - rng.uniform(0.2, 0.65) * shade, np.float32)[..., None]
