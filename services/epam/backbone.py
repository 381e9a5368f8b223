"""The backbone: the first stages of a network that was trained on photographs of all kinds of
things, computed once a view, for whoever recognizes by what it finds.
"""

from __future__ import annotations

from concurrent.futures import Future
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from cogmap.geometry.arrays import Bytes, Singles
from cogmap.services.epam.config import Processor
from cogmap.services.epam.network import WEIGHTS, Network

DEFAULT_PATH = WEIGHTS / "backbone.onnx"
# The input's sides: any camera's image is resized to them. On photographs of a corridor places are
# told apart at this size as well as at 224 by 224, in a third of the time.
WIDTH_PX = 160
HEIGHT_PX = 128
# A feature stands for so many pixels to either side.
STRIDE_PX = 16
CHANNELS = 80
ROWS = HEIGHT_PX // STRIDE_PX
COLUMNS = WIDTH_PX // STRIDE_PX
INPUT_SHAPE = (1, 3, HEIGHT_PX, WIDTH_PX)
OUTPUT_SHAPES: dict[str, tuple[int, ...]] = {"features": (1, CHANNELS, ROWS, COLUMNS)}
# Grey levels, as the network was trained.
MIDDLE = 127.0
SCALE = 128.0


class Backbone:
    """Finds the features of images, with a network whose input is that of `network_input`."""

    def __init__(self, network: Network) -> None:
        self._network = network

    def begin(self, image: Bytes) -> FeaturePass:
        """Begin to find the features of an RGB image (h, w, 3), beside what the caller does
        meanwhile.
        """
        return FeaturePass(self._network.begin(network_input(image)))

    def features(self, image: Bytes) -> Singles:
        """Return the features of an RGB image (h, w, 3), see FeaturePass."""
        return self.begin(image).features()


class FeaturePass(NamedTuple):
    """Features that are being found."""

    outputs: Future[list[Singles]]

    def features(self) -> Singles:
        """Return the features, float32 (CHANNELS, ROWS, COLUMNS), once they are found.

        On photographs of all kinds of things each channel has a mean of 0 and a standard deviation
        of about 1.
        """
        (output,) = self.outputs.result()
        return np.asarray(output[0])


def load(path: Path = DEFAULT_PATH, processor: Processor = "cpu") -> Backbone:
    """Load the backbone in the file at `path`. Raises ConfigError if it holds no such network, or
    there is no such processor.
    """
    return Backbone(Network(path, INPUT_SHAPE, OUTPUT_SHAPES, processor))


def network_input(image: Bytes) -> Singles:
    """Return the network's input, float32 INPUT_SHAPE, of an RGB image (h, w, 3)."""
    size = (WIDTH_PX, HEIGHT_PX)
    is_reduced = image.shape[1] >= WIDTH_PX and image.shape[0] >= HEIGHT_PX
    interpolation = cv2.INTER_AREA if is_reduced else cv2.INTER_LINEAR
    resized = cv2.resize(image, size, interpolation=interpolation)
    values = (resized.astype(np.float32) - np.float32(MIDDLE)) / np.float32(SCALE)
    return np.ascontiguousarray(values.transpose(2, 0, 1)[None])
