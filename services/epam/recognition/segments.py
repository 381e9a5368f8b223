"""Candidate objects in a view, by discontinuities of colour and depth.

A fully-convolutional network sees colour, depth and height, and tells for each pixel whether it
shows a building, how likely the middle of one is there, and which way the middle of its own
building lies; each pixel then belongs to the middle that it points to (as in Cheng et al. 2020,
Panoptic-DeepLab). It knows no names: any building is a candidate.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from schemas.sensing import Calibration
from services.epam.network import WEIGHTS, Network, Tensor

Image = npt.NDArray[np.uint8]
Depth = npt.NDArray[np.float32]
Mask = npt.NDArray[np.bool_]

DEFAULT_PATH = WEIGHTS / "segments.onnx"
WIDTH_PX = 160
HEIGHT_PX = 120
PADDING_PX = 4
CHANNELS = 8
TAKES = (1, CHANNELS, HEIGHT_PX + 2 * PADDING_PX, WIDTH_PX)
GIVES = {"shown": (1, 4, HEIGHT_PX + 2 * PADDING_PX, WIDTH_PX)}
OFFSET_PX = 32.0
LEAST_MIDDLE = 0.3
LEAST_BUILDING = 0.5
PEAK_PX = 9
FEWEST_PIXELS = 12
LEAST_CONTRAST = 3.0


@dataclass(frozen=True, eq=False)
class Segment:
    """What is seen of one object: `mask` (h, w) of the whole view, and `box_px`: left, top, width,
    height.
    """

    mask: Mask
    box_px: tuple[int, int, int, int]

    @property
    def area_px(self) -> int:
        """How many pixels it has."""
        return int(self.mask.sum())


class Segmenter:
    """Divides views into segments, with a network as this file says above."""

    def __init__(self, network: Network) -> None:
        self._network = network

    def segments(self, image: Image, depth_m: Depth, camera: Calibration) -> list[Segment]:
        """The candidates in an RGB image (h, w, 3) with depth (h, w), 0 unknown, from left to
        right.

        An image without any contrast, such as a black one, has none.
        """
        small = cv2.resize(image, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_AREA).astype(
            np.uint8, copy=False
        )
        if small.std() < LEAST_CONTRAST:
            return []
        depth = cv2.resize(depth_m, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_NEAREST)
        values = channels(small, np.asarray(depth, np.float32), camera)
        shown = self._network(padded(values)[None])[0][0, :, PADDING_PX:-PADDING_PX]
        return divided(shown, depth_m.shape)


def load(path: Path = DEFAULT_PATH) -> Segmenter:
    """A segmenter by the network in the file at `path`. Raises ConfigError where it holds no such
    network.
    """
    return Segmenter(Network(path, TAKES, GIVES))


def channels(small: Image, depth_m: Depth, camera: Calibration) -> Tensor:
    """What the network sees, float32 (CHANNELS, HEIGHT_PX, WIDTH_PX): three colours, the logarithm
    of depth, whether it is known, the height over the ground, and where in the view the pixel is.
    """
    values = np.empty((CHANNELS, HEIGHT_PX, WIDTH_PX), np.float32)
    values[:3] = small.transpose(2, 0, 1)
    values[:3] = values[:3] / 64.0 - 2.0
    known = depth_m > 0
    values[3] = np.log(np.clip(depth_m, 1.0, 100.0)) / 2.0 - 1.0
    values[4] = known
    row = np.arange(HEIGHT_PX, dtype=np.float32) * camera.height_px / HEIGHT_PX
    down = (row[:, None] - np.float32(camera.cy_px)) / np.float32(camera.fy_px)
    values[5] = np.clip((camera.mount_height_m - down * depth_m) / 5.0, -1.0, 3.0)
    values[3][~known] = values[5][~known] = 0.0
    values[6] = np.linspace(-1, 1, HEIGHT_PX, dtype=np.float32)[:, None]
    values[7] = np.linspace(-1, 1, WIDTH_PX, dtype=np.float32)
    return values


def padded(values: Tensor) -> Tensor:
    """`values` (…, HEIGHT_PX, WIDTH_PX) with rows above and below, so that the network can halve
    them often enough.
    """
    around = [(0, 0)] * (values.ndim - 2) + [(PADDING_PX, PADDING_PX), (0, 0)]
    return np.pad(values, around, mode="edge")


def divided(shown: Tensor, size: tuple[int, ...]) -> list[Segment]:
    """The segments of a view of size (h, w), from left to right, by the network's answer, float32
    (4, HEIGHT_PX, WIDTH_PX): log odds of building, how likely a middle is, and how far right and
    down it is, in OFFSET_PX.
    """
    return _enlarged(_instances(shown), shown[0], size)


def _instances(shown: Tensor) -> npt.NDArray[np.intp]:
    """The number of the object at each pixel, -1 for none, from the network's answer (4, h, w)."""
    numbers = np.full(shown.shape[1:], -1, np.intp)
    building = shown[0] > np.log(LEAST_BUILDING / (1 - LEAST_BUILDING))
    middle = shown[1]
    highest = cv2.dilate(middle, np.ones((PEAK_PX, PEAK_PX), np.uint8))
    peaks = np.argwhere((middle == highest) & (middle > LEAST_MIDDLE))
    rows, columns = np.nonzero(building)
    if not len(peaks) or not len(rows):
        return numbers
    pointed = np.stack(
        [rows + OFFSET_PX * shown[3, rows, columns], columns + OFFSET_PX * shown[2, rows, columns]],
        1,
    )
    squared = ((pointed[:, None] - peaks[None]) ** 2).sum(2)
    numbers[rows, columns] = squared.argmin(1)
    return numbers


def _enlarged(
    numbers: npt.NDArray[np.intp], log_odds: Tensor, size: tuple[int, ...]
) -> list[Segment]:
    """The segments at the size (h, w) of the view, from left to right."""
    height, width = size
    building = cv2.resize(log_odds, (width, height), interpolation=cv2.INTER_LINEAR) > 0
    found: list[tuple[float, Segment]] = []
    for number in range(numbers.max() + 1):
        small = (numbers == number).astype(np.uint8)
        if small.sum() < FEWEST_PIXELS:
            continue
        near = (
            cv2.resize(small.astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR)
            > 0.5
        )
        mask = np.asarray(near & building)
        if mask.any():
            left, top, wide, high = cv2.boundingRect(mask.astype(np.uint8))
            found.append((left + wide / 2, Segment(mask, (left, top, wide, high))))
    return [segment for _, segment in sorted(found, key=lambda item: item[0])]
