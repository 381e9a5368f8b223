"""Candidate objects in a view, separated by discontinuities of colour and depth.

A fully-convolutional network receives colour, depth and height. For each pixel it predicts whether
it shows a building, how likely the centre of one is there, and the offset to the centre of its own
building; each pixel then belongs to the centre that it points to (as in Cheng et al. 2020,
Panoptic-DeepLab). Of a building that fills much of the view several centres may be found: pieces
whose pixels point to the same place where they meet are one. It is class-agnostic: any building is
a candidate.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Booleans, Bytes, Floats, Singles
from cogmap.schemas.sensing import Calibration
from cogmap.services.epam.config import Processor
from cogmap.services.epam.network import WEIGHTS, Network, Shape

DEFAULT_PATH = WEIGHTS / "segments.onnx"
# Half the camera's sides, and rows above and below: the default weights are trained for them.
# Others may take any size, and have outputs at half of it.
WIDTH_PX = 160
HEIGHT_PX = 120
PADDING_PX = 4
CHANNELS = 8
INPUT_SHAPE = (1, CHANNELS, HEIGHT_PX + 2 * PADDING_PX, WIDTH_PX)
OUTPUT_SHAPES: dict[str, Shape] = {"shown": (1, 4, None, None)}
# Unit of the network's offsets, as in training.
OFFSET_PX = 32.0
# Least probabilities of a centre and of a building; a centre is the likeliest in a square of so
# many pixels a side; fewer than MIN_PIXELS are no segment.
MIN_CENTRE = 0.3
MIN_BUILDING = 0.5
PEAK_PX = 9
MIN_PIXELS = 12
# A pixel that points to a place farther than this from every centre belongs to none of them: such
# pixels are segments where they hang together, if they are at least so many. A quarter of the
# view's width, and half a hundredth of its area.
MAX_MISS_PX = 40.0
MIN_ALONE_PIXELS = 100
# Grey levels: an image with a smaller standard deviation shows nothing.
MIN_CONTRAST = 3.0
# Pieces of one building: where they meet, both point to places nearer to each other than this
# share of the square root of their area.
SAME_CENTRE = 0.04


@dataclass(frozen=True, eq=False)
class Segment:
    """The visible part of one object: `mask` (h, w) of the whole view, and its bounding box
    `box_px`: left, top, width, height.
    """

    mask: Booleans
    box_px: tuple[int, int, int, int]

    @classmethod
    def of(cls, mask: Booleans) -> Segment:
        """Return the segment of `mask`, in which at least one pixel is set."""
        left, top, width, height = cv2.boundingRect(mask.astype(np.uint8))
        return cls(mask, (left, top, width, height))

    @property
    def area_px(self) -> int:
        """Return the number of its pixels."""
        return int(self.mask.sum())


class Segmenter:
    """Divides views into segments, with the network described above."""

    def __init__(self, network: Network) -> None:
        self._network = network

    def segments(self, image: Bytes, depth_m: Singles, camera: Calibration) -> list[Segment]:
        """Return the candidates in an RGB image (h, w, 3) with depth (h, w), 0 unknown, from left
        to right.

        An image without any contrast, such as a black one, has none.
        """
        size = self._network.view_size(depth_m.shape, PADDING_PX)
        small_size = (size.width_px, size.height_px)
        resized = cv2.resize(image, small_size, interpolation=cv2.INTER_AREA)
        small = resized.astype(np.uint8, copy=False)
        if small.std() < MIN_CONTRAST:
            return []

        resized_m = cv2.resize(depth_m, small_size, interpolation=cv2.INTER_NEAREST)
        small_depth_m = np.asarray(resized_m, np.float32)
        values = padded(network_input(small, small_depth_m, camera), size.padding_px)

        (output,) = self._network(values[None])
        rows = output.shape[2]
        unpadded = output[0, :, size.padding_px : rows - size.padding_px]
        return divided(unpadded, depth_m.shape)


def load(path: Path = DEFAULT_PATH, processor: Processor = "cpu") -> Segmenter:
    """Load the segmentation network in the file at `path`. Raises ConfigError if it holds no such
    network, or there is no such processor.
    """
    input_shape = (1, CHANNELS, None, None)
    return Segmenter(Network(path, input_shape, OUTPUT_SHAPES, processor))


def network_input(small: Bytes, depth_m: Singles, camera: Calibration) -> Singles:
    """Return the network's input, float32 (CHANNELS, h, w), of an image (h, w, 3) and its depth
    (h, w), scaled from the `camera`'s.

    Channels are three colours, the logarithm of depth, whether depth is known, the height over the
    ground, and the pixel's row and column, from -1 to 1.
    """
    height, width = depth_m.shape
    values = np.empty((CHANNELS, height, width), np.float32)

    colours = values[:3]
    colours[:] = small.transpose(2, 0, 1)
    colours[:] = colours / 64.0 - 2.0

    known = depth_m > 0
    values[3] = np.log(np.clip(depth_m, 1.0, 100.0)) / 2.0 - 1.0
    values[4] = known

    row = np.arange(height, dtype=np.float32) * camera.height_px / height
    below = (row[:, None] - np.float32(camera.cy_px)) / np.float32(camera.fy_px)
    height_m = np.asarray(camera.mount_height_m - below * depth_m)
    values[5] = np.clip(height_m / 5.0, -1.0, 3.0)

    values[3][~known] = 0.0
    values[5][~known] = 0.0

    down = np.linspace(-1, 1, height, dtype=np.float32)
    across = np.linspace(-1, 1, width, dtype=np.float32)
    values[6] = down[:, None]
    values[7] = across
    return values


def padded(values: Singles, padding_px: int = PADDING_PX) -> Singles:
    """Return `values` (..., h, w) with rows above and below, so that the network can halve them
    often enough.
    """
    leading = [(0, 0)] * (values.ndim - 2)
    return np.pad(values, [*leading, (padding_px, padding_px), (0, 0)], mode="edge")


def divided(output: Singles, size: tuple[int, ...]) -> list[Segment]:
    """Return the segments of a view of `size` (h, w), from left to right, by the network's output,
    float32 (4, h', w'), at any resolution: log odds of a building, probability of a centre, and
    its offset to the right and downwards, in units of OFFSET_PX.
    """
    height, width = size
    numbers = _instances(output)
    enlarged_odds = cv2.resize(output[0], (width, height), interpolation=cv2.INTER_LINEAR)
    building = enlarged_odds > 0

    segments: list[Segment] = []
    for number in range(numbers.max() + 1):
        small = (numbers == number).astype(np.float32)
        if np.count_nonzero(small) < MIN_PIXELS:
            continue

        share = cv2.resize(small, (width, height), interpolation=cv2.INTER_LINEAR)
        mask = np.asarray((share > 0.5) & building)
        if mask.any():
            segments.append(Segment.of(mask))

    return sorted(segments, key=lambda segment: segment.box_px[0] + segment.box_px[2] / 2)


def _instances(output: Singles) -> npt.NDArray[np.intp]:
    """Number the object at each pixel, -1 for none, by the network's output (4, h, w)."""
    log_odds, centre, right, down = output
    numbers = np.full(log_odds.shape, -1, np.intp)
    building = log_odds > np.log(MIN_BUILDING / (1 - MIN_BUILDING))
    rows, columns = np.nonzero(building)

    # Centres are the local maxima over MIN_CENTRE.
    highest = cv2.dilate(centre, np.ones((PEAK_PX, PEAK_PX), np.uint8))
    centres = np.argwhere((centre == highest) & (centre > MIN_CENTRE))
    if not len(rows):
        return numbers
    if not len(centres):
        return _alone(building, 0)

    pointed_row = rows + OFFSET_PX * down[building]
    pointed_column = columns + OFFSET_PX * right[building]
    pointed_at = np.stack([pointed_row, pointed_column], 1)

    # The nearest centre: the squared distance, less what is the same for all centres.
    compared_px2 = (centres**2).sum(1) - 2 * (pointed_at @ centres.T)
    numbers[building] = compared_px2.argmin(1)
    missed_px2 = compared_px2.min(1) + (pointed_at**2).sum(1)
    misses = np.zeros_like(building)
    misses[building] = missed_px2 > MAX_MISS_PX**2
    numbers[misses] = -1
    if len(centres) > 1 and not misses[building].all():
        pointed = np.zeros((*log_odds.shape, 2))
        pointed[building] = pointed_at
        numbers = _joined(numbers, pointed)

    return np.where(misses, _alone(misses, len(centres)), numbers)


def _alone(mask: Booleans, first: int) -> npt.NDArray[np.intp]:
    """Number the areas of `mask` (h, w) that hang together from `first` on, -1 elsewhere and for
    those with fewer than MIN_ALONE_PIXELS.
    """
    found = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    _, component, stats, _ = found
    is_large = stats[:, cv2.CC_STAT_AREA] >= MIN_ALONE_PIXELS
    is_large[0] = False
    return np.where(is_large[component], component - 1 + first, -1)


def _joined(numbers: npt.NDArray[np.intp], pointed_at: Floats) -> npt.NDArray[np.intp]:
    """Give pieces of one object the same number in `numbers` (h, w): those that point to the same
    row and column, `pointed_at` (h, w, 2), where they meet.
    """
    area_px = np.bincount(numbers[numbers >= 0])
    count = len(area_px)

    # At each border of two objects: the lower number times `count` plus the higher, and the
    # distance between the places that the pixels on both sides point to.
    pairs = []
    distances_px = []
    beside = (
        (numbers[:, :-1], numbers[:, 1:], pointed_at[:, :-1], pointed_at[:, 1:]),
        (numbers[:-1], numbers[1:], pointed_at[:-1], pointed_at[1:]),
    )
    for one_side, other_side, to_one, to_other in beside:
        is_border = (one_side != other_side) & (one_side >= 0) & (other_side >= 0)
        both = np.stack([one_side[is_border], other_side[is_border]])
        lower, higher = np.sort(both, axis=0)
        pairs.append(lower * count + higher)
        difference_px = to_one[is_border] - to_other[is_border]
        distances_px.append(np.hypot(*difference_px.T))

    pair = np.concatenate(pairs)
    apart_px = np.concatenate(distances_px)
    joined = np.arange(count)
    for each in np.unique(pair).tolist():
        one, other = divmod(each, count)
        size_px = np.sqrt(area_px[one] + area_px[other])
        median_px = np.median(apart_px[pair == each])
        if median_px < SAME_CENTRE * size_px:
            joined[joined == joined[other]] = joined[one]

    return np.where(numbers >= 0, joined[numbers], numbers)
