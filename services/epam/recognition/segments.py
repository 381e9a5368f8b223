"""Candidate objects in a view, separated by discontinuities of colour and depth.

A fully-convolutional network receives colour, depth and height. For each pixel it predicts whether
it shows a building, how likely the centre of one is there, and the offset to the centre of its own
building; each pixel then belongs to the centre that it points to (as in Cheng et al. 2020,
Panoptic-DeepLab). Of a building that fills much of the view several centres may be found: pieces
whose pixels point to the same place where they meet are one. It is class-agnostic: any building is
a candidate.

The view is looked at twice: all of it at half its resolution, which shows large buildings whole,
and the rows about the horizon at all of it, which tells far ones apart.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Booleans, Bytes, Singles
from cogmap.schemas.sensing import Calibration
from cogmap.services.epam.config import Processor
from cogmap.services.epam.network import WEIGHTS, Network, Shape
from cogmap.services.epam.recognition.look import (
    CHANNELS,
    FAR,
    WHOLE,
    Look,
    Window,
    network_input,
    padded,
)

DEFAULT_PATH = WEIGHTS / "segments.onnx"
# Beside the file of a network that looks at the whole view is that of the one for the closer look,
# if there is one.
FAR_SUFFIX = "-far.onnx"
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
MAX_MISS_SHARE = 0.25
MIN_ALONE_SHARE = 0.005
# Grey levels: an image with a smaller standard deviation, of one pixel in so many each way, shows
# nothing.
MIN_CONTRAST = 3.0
CONTRAST_STRIDE = 4
# Pieces of one building: where they meet, both point to places nearer to each other than this
# share of the square root of their area.
SAME_CENTRE = 0.04
# A segment with a smaller share of the view is looked at more closely. In 135 views of three towns
# of blocks fewer small buildings were found with 0.02; with 0.08 as many, but fewer large ones.
# What that finds is a segment if so many of its pixels, and half of them, belong to none that is
# larger.
FAR_AREA_SHARE = 0.04
MIN_FAR_PIXELS = 40
MIN_FREE_SHARE = 0.5

Numbers = npt.NDArray[np.integer]


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

    def in_view(self, height_px: int, top_px: int) -> Segment:
        """Return it in a view of that height, of which its mask begins at row `top_px`."""
        below_px = height_px - top_px - len(self.mask)
        mask = np.pad(self.mask, ((top_px, below_px), (0, 0)))
        left, top, width, height = self.box_px
        return Segment(mask, (left, top + top_px, width, height))


class Segmenter:
    """Divides views into segments, with the networks described above: one for the whole view, and
    one for a closer look, if there is one.
    """

    def __init__(self, network: Network, far: Network | None) -> None:
        self._network = network
        self._far = far

    def segments(self, image: Bytes, depth_m: Singles, camera: Calibration) -> list[Segment]:
        """Return the candidates in an RGB image (h, w, 3) with depth (h, w), 0 unknown, from left
        to right.

        An image without any contrast, such as a black one, has none.
        """
        if image[::CONTRAST_STRIDE, ::CONTRAST_STRIDE].std() < MIN_CONTRAST:
            return []

        whole = _begin(self._network, WHOLE, image, depth_m, camera)
        if self._far is None:
            return whole()

        closely = _begin(self._far, FAR, image, depth_m, camera)
        found = with_closer(whole(), closely(), FAR.window(camera))
        return sorted(found, key=_middle_px)


def load(path: Path = DEFAULT_PATH, processor: Processor = "cpu") -> Segmenter:
    """Load the segmentation network in the file at `path`, and that of the closer look beside it,
    if there is one. Raises ConfigError if they hold no such networks, or there is no such
    processor.
    """
    network = Network(path, (1, CHANNELS, None, None), OUTPUT_SHAPES, processor)
    far_path = far_beside(path)
    far = None
    if far_path.is_file():
        far = Network(far_path, FAR.shape, OUTPUT_SHAPES, processor)
    return Segmenter(network, far)


def far_beside(path: Path) -> Path:
    """Return the file of the closer look beside that of the network for the whole view."""
    return path.with_name(path.stem + FAR_SUFFIX)


def _begin(
    network: Network, look: Look, image: Bytes, depth_m: Singles, camera: Calibration
) -> Callable[[], list[Segment]]:
    """Begin a look at a view; what is returned waits for it, and returns its segments."""
    window = look.window(camera)
    seen = depth_m[window.rows]
    size = network.view_size(seen.shape, look.padding_px)
    small_size = (size.width_px, size.height_px)
    small = cv2.resize(image[window.rows], small_size, interpolation=cv2.INTER_AREA)
    small_m = cv2.resize(seen, small_size, interpolation=cv2.INTER_NEAREST)
    values = network_input(
        np.asarray(small, np.uint8), np.asarray(small_m, np.float32), camera, window
    )
    outputs = network.begin(padded(values, size.padding_px)[None])

    def segments() -> list[Segment]:
        (output,) = outputs.result()
        rows = output.shape[2]
        unpadded = output[0, :, size.padding_px : rows - size.padding_px]
        found = divided(unpadded, seen.shape)
        return [segment.in_view(len(depth_m), window.top_px) for segment in found]

    return segments


def with_closer(
    found: Sequence[Segment], closer: Iterable[Segment], window: Window
) -> list[Segment]:
    """Return the segments `found` in the whole view, with those of a closer look at `window` in the
    place of those that are small and within it.
    """
    bottom_px = window.top_px + window.height_px
    kept = []
    for segment in found:
        _, row_px, _, height_px = segment.box_px
        is_within = row_px > window.top_px and row_px + height_px < bottom_px
        if not is_within or segment.area_px > FAR_AREA_SHARE * segment.mask.size:
            kept.append(segment)

    taken = sum((segment.mask for segment in kept), start=np.False_)
    for segment in closer:
        free = segment.mask & ~taken
        free_px = np.count_nonzero(free)
        if free_px >= max(MIN_FAR_PIXELS, MIN_FREE_SHARE * segment.area_px):
            kept.append(Segment.of(free))

    return kept


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
    area_px = np.bincount(numbers[numbers >= 0])
    for number in np.flatnonzero(area_px >= MIN_PIXELS):
        small = (numbers == number).astype(np.float32)
        share = cv2.resize(small, (width, height), interpolation=cv2.INTER_LINEAR)
        mask = np.asarray((share > 0.5) & building)
        if mask.any():
            segments.append(Segment.of(mask))

    return sorted(segments, key=_middle_px)


def _middle_px(segment: Segment) -> float:
    left_px, _, width_px, _ = segment.box_px
    return left_px + width_px / 2


def _instances(output: Singles) -> Numbers:
    """Number the object at each pixel, -1 for none, by the network's output (4, h, w)."""
    log_odds, centre, right, down = output
    numbers = np.full(log_odds.shape, -1, np.int32)
    building = log_odds > np.log(MIN_BUILDING / (1 - MIN_BUILDING))
    if not building.any():
        return numbers

    # Centres are the local maxima over MIN_CENTRE.
    highest = cv2.dilate(centre, np.ones((PEAK_PX, PEAK_PX), np.uint8))
    centres = np.argwhere((centre == highest) & (centre > MIN_CENTRE)).astype(np.float32)
    if not len(centres):
        return _alone(building, 0)

    height, width = log_odds.shape
    pointed_row = np.arange(height, dtype=np.float32)[:, None] + OFFSET_PX * down
    pointed_column = np.arange(width, dtype=np.float32) + OFFSET_PX * right

    # The nearest centre.
    rows = pointed_row[building]
    columns = pointed_column[building]
    nearest = np.zeros(rows.shape, np.int32)
    nearest_px2 = np.full(rows.shape, np.inf, np.float32)
    for number, (centre_row, centre_column) in enumerate(centres):
        missed_px2 = (rows - centre_row) ** 2 + (columns - centre_column) ** 2
        nearest[missed_px2 < nearest_px2] = number
        np.minimum(nearest_px2, missed_px2, out=nearest_px2)

    numbers[building] = nearest
    misses = np.zeros_like(building)
    misses[building] = nearest_px2 > (MAX_MISS_SHARE * width) ** 2
    numbers[misses] = -1
    if len(centres) > 1:
        numbers = _joined(numbers, pointed_row, pointed_column)
    if misses.any():
        numbers = np.where(misses, _alone(misses, len(centres)), numbers)
    return numbers


def _alone(mask: Booleans, first: int) -> Numbers:
    """Number the areas of `mask` (h, w) that hang together from `first` on, -1 elsewhere and for
    those that cover less than MIN_ALONE_SHARE of it.
    """
    found = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    _, component, stats, _ = found
    is_large = stats[:, cv2.CC_STAT_AREA] >= MIN_ALONE_SHARE * mask.size
    is_large[0] = False
    return np.where(is_large[component], component - 1 + first, -1)


def _joined(numbers: Numbers, pointed_row: Singles, pointed_column: Singles) -> Numbers:
    """Give pieces of one object the same number in `numbers` (h, w): those that point to the same
    row and column, both (h, w), where they meet.
    """
    area_px = np.bincount(numbers[numbers >= 0])
    count = len(area_px)

    # At each border of two objects: the lower number times `count` plus the higher, and the
    # distance between the places that the pixels on both sides point to.
    pairs = []
    distances_px = []
    beside = (np.s_[:, :-1], np.s_[:, 1:])
    above = (np.s_[:-1], np.s_[1:])
    for before, after in (beside, above):
        one_side = numbers[before]
        other_side = numbers[after]
        is_border = (one_side != other_side) & (np.minimum(one_side, other_side) >= 0)

        one = one_side[is_border]
        other = other_side[is_border]
        pairs.append(np.minimum(one, other) * count + np.maximum(one, other))
        down_px = pointed_row[before][is_border] - pointed_row[after][is_border]
        right_px = pointed_column[before][is_border] - pointed_column[after][is_border]
        distances_px.append(np.hypot(down_px, right_px))

    pair = np.concatenate(pairs)
    apart_px = np.concatenate(distances_px)
    joined = np.arange(count)
    for each in np.unique(pair).tolist():
        lower, higher = divmod(each, count)
        size_px = np.sqrt(area_px[lower] + area_px[higher])
        median_px = np.median(apart_px[pair == each])
        if median_px < SAME_CENTRE * size_px:
            joined[joined == joined[higher]] = joined[lower]

    return np.where(numbers >= 0, joined[numbers], numbers)
