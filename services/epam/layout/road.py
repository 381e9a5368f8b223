"""Where the road is: a fully-convolutional network that also sees where in the image a pixel is
(paper §5.1).
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from schemas.sensing import Calibration
from services.epam.layout.ground import Depth, Likelihood, Points, project
from services.epam.network import WEIGHTS, Network, Tensor

Image = npt.NDArray[np.uint8]
DEFAULT_PATH = WEIGHTS / "road.onnx"
WIDTH_PX = 160
HEIGHT_PX = 120
# Rows above and below, so that the network can halve the image often enough.
PADDING_PX = 4
CHANNELS = 5
TAKES = (1, CHANNELS, HEIGHT_PX + 2 * PADDING_PX, WIDTH_PX)
GIVES: dict[str, tuple[int, ...]] = {"road": (1, 1, HEIGHT_PX + 2 * PADDING_PX, WIDTH_PX)}
MEAN_GREY = 112.0
DARKEST_GREY = 20.0
LEAST_CONTRAST = 3.0
LEAST_SHARE = 0.002
LARGEST_HOLE_SHARE = 0.0005
_OPEN = np.ones((3, 3), np.uint8)


class Roads:
    """Finds the road in images, with a network that gives the log odds of road for each pixel of
    `pixels`.
    """

    def __init__(self, network: Network) -> None:
        self._network = network

    def likelihood(self, image: Image) -> Likelihood:
        """How likely each pixel of an RGB image (h, w, 3) shows road, float32 (h, w), denoised.

        0.5 and more is road. An image without any contrast, such as a black one, shows none.
        """
        height, width = image.shape[:2]
        small = cv2.resize(image, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_AREA).astype(
            np.uint8, copy=False
        )
        if small.std() < LEAST_CONTRAST:
            return np.zeros((height, width), np.float32)
        (log_odds,) = self._network(pixels(small[None]))
        whole = cv2.resize(
            log_odds[0, 0, PADDING_PX:-PADDING_PX], (width, height), interpolation=cv2.INTER_LINEAR
        )
        return _denoised(np.asarray(1 / (1 + np.exp(-whole)), np.float32))

    def mask(self, image: Image) -> npt.NDArray[np.bool_]:
        """Which pixels of an RGB image (h, w, 3) show road, (h, w)."""
        return np.asarray(self.likelihood(image) >= 0.5)

    def project(
        self, likelihood: Likelihood, depth_m: Depth, camera: Calibration
    ) -> tuple[Points, Points]:
        """The road and where it ends, in metres; see `services.epam.layout.ground.project`."""
        return project(likelihood, depth_m, camera)


def load(path: Path = DEFAULT_PATH) -> Roads:
    """Roads by the network in the file at `path`. Raises ConfigError where it holds no such
    network.
    """
    return Roads(Network(path, TAKES, GIVES))


def pixels(small: Image) -> Tensor:
    """What the network takes: of RGB images (n, HEIGHT_PX, WIDTH_PX, 3) the colours, all images
    about as bright, and where each pixel is, from -1 to 1 rightwards and downwards; padded, float32
    (n, CHANNELS, h, w).
    """
    gain = MEAN_GREY / np.maximum(small.mean((1, 2, 3), dtype=np.float32), DARKEST_GREY)
    tensor = np.empty((len(small), *TAKES[1:]), np.float32)
    padded = np.pad(small, ((0, 0), (PADDING_PX, PADDING_PX), (0, 0), (0, 0)), mode="edge")
    tensor[:, :3] = padded.transpose(0, 3, 1, 2)
    tensor[:, :3] = tensor[:, :3] * (gain[:, None, None, None] / 64) - 2
    tensor[:, 3] = np.linspace(-1, 1, TAKES[3], dtype=np.float32)
    tensor[:, 4] = np.linspace(-1, 1, TAKES[2], dtype=np.float32)[:, None]
    return tensor


def _denoised(likelihood: Likelihood) -> Likelihood:
    """Specks and hairs are no road, and pinholes in it are."""
    seen = (likelihood >= 0.5).astype(np.uint8)
    road = _pieces(
        cv2.morphologyEx(seen, cv2.MORPH_OPEN, _OPEN).astype(np.uint8, copy=False), LEAST_SHARE
    )
    whole = ~_pieces((~road).astype(np.uint8), LARGEST_HOLE_SHARE)
    likelihood[(seen > 0) & ~whole] = 0.0
    likelihood[(seen == 0) & whole] = 1.0
    return likelihood


def _pieces(mask: npt.NDArray[np.uint8], least_share: float) -> npt.NDArray[np.bool_]:
    """The connected pieces of `mask` that cover at least so large a share of it."""
    _, piece, facts, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
    kept = facts[:, cv2.CC_STAT_AREA] >= least_share * mask.size
    kept[0] = False
    return np.asarray(kept[piece])
