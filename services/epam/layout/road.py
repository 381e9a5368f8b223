"""Finds the pixels that show road: a fully-convolutional network that also receives the position of
each pixel in the image, the spatial prior of the paper (section 5.1).
"""

from __future__ import annotations

from concurrent.futures import Future
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from cogmap.geometry.arrays import Booleans, Bytes, Singles
from cogmap.services.epam.config import Processor
from cogmap.services.epam.network import WEIGHTS, Network, Shape

DEFAULT_PATH = WEIGHTS / "road.onnx"
# Half the camera's sides: the default weights are trained for them. Others may take any size.
WIDTH_PX = 160
HEIGHT_PX = 120
# Rows above and below, so that the network can halve the image often enough.
PADDING_PX = 4
CHANNELS = 5
INPUT_SHAPE = (1, CHANNELS, HEIGHT_PX + 2 * PADDING_PX, WIDTH_PX)
OUTPUT_SHAPES: dict[str, Shape] = {"road": (1, 1, None, None)}
# The mean, in grey levels, that images are scaled to, as in training; one that is darker than
# MIN_GREY is scaled as if it were that bright.
MEAN_GREY = 112.0
MIN_GREY = 20.0
# Grey levels: an image with a smaller standard deviation shows nothing.
MIN_CONTRAST = 3.0
# Of the image: smaller specks of road are removed, smaller holes filled.
MIN_ROAD_SHARE = 0.002
MAX_HOLE_SHARE = 0.0005
OPENING = np.ones((3, 3), np.uint8)


class RoadSegmenter:
    """Finds the road in images, with a network whose output is the log odds of road of each pixel
    of `network_input`.
    """

    def __init__(self, network: Network) -> None:
        self._network = network

    def begin(self, image: Bytes) -> RoadPass:
        """Begin to find the road in an RGB image (h, w, 3), beside what the caller does
        meanwhile.
        """
        height, width, _ = image.shape
        size = self._network.view_size((height, width), PADDING_PX)
        small_size = (size.width_px, size.height_px)
        resized = cv2.resize(image, small_size, interpolation=cv2.INTER_AREA)
        small = resized.astype(np.uint8, copy=False)
        if small.std() < MIN_CONTRAST:
            return RoadPass(height, width, size.padding_px, None)

        outputs = self._network.begin(network_input(small[None], size.padding_px))
        return RoadPass(height, width, size.padding_px, outputs)

    def likelihood(self, image: Bytes) -> Singles:
        """Return the likelihood of road in an RGB image (h, w, 3), see RoadPass."""
        return self.begin(image).likelihood()

    def mask(self, image: Bytes) -> Booleans:
        """Return which pixels of an RGB image (h, w, 3) show road, (h, w)."""
        return np.asarray(self.likelihood(image) >= 0.5)


class RoadPass(NamedTuple):
    """Road that is being found in an image of that size; `outputs` are those of the network, with
    `padding_px` rows above and below, None if the image has no contrast.
    """

    height_px: int
    width_px: int
    padding_px: int
    outputs: Future[list[Singles]] | None

    def likelihood(self) -> Singles:
        """Return the probability of road of each pixel, float32 (h, w), denoised, once it is found.

        A pixel is road if it is at least 0.5. An image without any contrast has none.
        """
        if self.outputs is None:
            return np.zeros((self.height_px, self.width_px), np.float32)

        (output,) = self.outputs.result()
        rows = output.shape[2]
        unpadded = output[0, 0, self.padding_px : rows - self.padding_px]
        size = (self.width_px, self.height_px)
        log_odds = np.asarray(cv2.resize(unpadded, size), np.float32)
        likelihood = np.asarray(1 / (1 + np.exp(-log_odds)), np.float32)

        # Specks and thin lines are removed from the road, and small holes filled.
        road = likelihood >= 0.5
        opened = cv2.morphologyEx(road.astype(np.uint8), cv2.MORPH_OPEN, OPENING)
        without_specks = _large_components(opened.astype(bool), MIN_ROAD_SHARE)
        background = _large_components(~without_specks, MAX_HOLE_SHARE)
        likelihood[road & background] = 0.0
        likelihood[~road & ~background] = 1.0
        return likelihood


def load(path: Path = DEFAULT_PATH, processor: Processor = "cpu") -> RoadSegmenter:
    """Load the road network in the file at `path`. Raises ConfigError if it holds no such
    network, or there is no such processor.
    """
    input_shape = (1, CHANNELS, None, None)
    return RoadSegmenter(Network(path, input_shape, OUTPUT_SHAPES, processor))


def network_input(small: Bytes, padding_px: int = PADDING_PX) -> Singles:
    """Return the network's input, float32 (n, CHANNELS, h + 2 padding_px, w), of RGB images (n, h,
    w, 3).

    Channels are three colours, normalized to one mean brightness, and the pixel's column and row,
    from -1 to 1.
    """
    count, inner_height, width, _ = small.shape
    height = inner_height + 2 * padding_px
    values = np.empty((count, CHANNELS, height, width), np.float32)

    brightness = small.mean((1, 2, 3), dtype=np.float32)
    gain = np.asarray(MEAN_GREY / np.maximum(brightness, MIN_GREY))
    scale = gain[:, None, None, None] / 64
    padded = np.pad(small, ((0, 0), (padding_px, padding_px), (0, 0), (0, 0)), mode="edge")
    colours = values[:, :3]
    colours[:] = padded.transpose(0, 3, 1, 2)
    colours[:] = colours * scale - 2

    across = np.linspace(-1, 1, width, dtype=np.float32)
    down = np.linspace(-1, 1, height, dtype=np.float32)
    values[:, 3] = across
    values[:, 4] = down[:, None]
    return values


def _large_components(mask: Booleans, min_share: float) -> Booleans:
    """Keep the connected components of `mask`, (h, w), that cover at least `min_share` of it."""
    found = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4)
    _, component, stats, _ = found

    kept = stats[:, cv2.CC_STAT_AREA] >= min_share * mask.size
    kept[0] = False
    return np.asarray(kept[component])
