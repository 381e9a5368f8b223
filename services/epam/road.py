"""Where the road is: a fully-convolutional network that also sees where in the image a pixel is (paper §5.1)."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from schemas.sensing import Calibration
from services.epam.ground import FARTHEST_M, Depth, Likelihood, Points, project, thinned
from services.epam.network import WEIGHTS, Network, Tensor

Image = npt.NDArray[np.uint8]
DEFAULT_PATH = WEIGHTS / "road.onnx"
WIDTH_PX, HEIGHT_PX = 160, 120
# Rows above and below, so that the network can halve the image often enough.
PADDING_PX = 4
CHANNELS = 5
TAKES = (1, CHANNELS, HEIGHT_PX + 2 * PADDING_PX, WIDTH_PX)
GIVES: dict[str, tuple[int, ...]] = {"road": (1, 1, HEIGHT_PX + 2 * PADDING_PX, WIDTH_PX)}
MEAN_GREY, DARKEST_GREY = 112.0, 20.0
LEAST_CONTRAST = 3.0
LEAST_SHARE, LARGEST_HOLE_SHARE = 0.002, 0.0005
_OPEN = np.ones((3, 3), np.uint8)


class Roads:
    """Finds the road in images, with a network that gives the log odds of road for each pixel of `pixels`."""

    def __init__(self, network: Network) -> None:
        self._network = network

    def likelihood(self, image: Image) -> Likelihood:
        """How likely each pixel of an RGB image (h, w, 3) shows road, float32 (h, w), denoised.

        0.5 and more is road. An image without any contrast, such as a black one, shows none.
        """
        height, width = image.shape[:2]
        small = cv2.resize(image, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_AREA).astype(np.uint8, copy=False)
        if small.std() < LEAST_CONTRAST:
            return np.zeros((height, width), np.float32)
        (log_odds,) = self._network(pixels(small[None]))
        whole = cv2.resize(log_odds[0, 0, PADDING_PX:-PADDING_PX], (width, height), interpolation=cv2.INTER_LINEAR)
        return _denoised(np.asarray(1 / (1 + np.exp(-whole)), np.float32))

    def mask(self, image: Image) -> npt.NDArray[np.bool_]:
        """Which pixels of an RGB image (h, w, 3) show road, (h, w)."""
        return np.asarray(self.likelihood(image) >= 0.5)

    def project(self, likelihood: Likelihood, depth_m: Depth, camera: Calibration) -> tuple[Points, Points]:
        """The road and where it ends, in metres; see `services.epam.ground.project`."""
        return project(likelihood, depth_m, camera)


def load(path: Path = DEFAULT_PATH) -> Roads:
    """Roads by the network in the file at `path`. Raises ConfigError where it holds no such network."""
    return Roads(Network(path, TAKES, GIVES))


def pixels(small: Image) -> Tensor:
    """What the network takes: of RGB images (n, HEIGHT_PX, WIDTH_PX, 3) the colours, all images about as bright, and
    where each pixel is, from -1 to 1 rightwards and downwards; padded, float32 (n, CHANNELS, h, w)."""
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
    road = _pieces(cv2.morphologyEx(seen, cv2.MORPH_OPEN, _OPEN).astype(np.uint8, copy=False), LEAST_SHARE)
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


DARKEST, LIGHTEST, MOST_CHROMA = 50, 130, 9
PLANE_ERROR_PX = 1.0
_CLOSE = np.ones((5, 5), np.uint8)


def road(lab_image: Image, depth_m: npt.NDArray[np.float32], camera: Calibration) -> npt.NDArray[np.float32]:
    """Ground points seen as road, float32 (n, 2), x forward and y left of the robot, one in each cell of CELL_M.

    A pixel is road if it is as grey and dark as asphalt and its depth, where known, is that of the ground. Specks
    are taken out of the mask, and gaps as small as a lane marking filled.
    """
    rows = np.arange(camera.height_px)
    below = (rows - camera.cy_px) / camera.fy_px
    ground_m = np.where(below > 0, camera.mount_height_m / np.maximum(below, 1e-9), np.inf)
    first = int(np.searchsorted(-ground_m, -FARTHEST_M))
    if first >= len(rows):
        return np.empty((0, 2), np.float32)
    depth = ground_m[first:, None]
    mask = _asphalt(lab_image[first:]) & _on_plane(depth_m[first:], depth, camera)
    cleaned = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, _OPEN)
    cleaned = cv2.morphologyEx(cleaned, cv2.MORPH_CLOSE, _CLOSE)
    row, column = np.nonzero(cleaned)
    forward = depth[row, 0]
    left = (camera.cx_px - column) / camera.fx_px * forward
    return thinned(np.stack([forward + camera.mount_forward_m, left], axis=1))


def _asphalt(lab_image: Image) -> npt.NDArray[np.bool_]:
    lightness = lab_image[..., 0]
    chroma = np.abs(lab_image[..., 1:].astype(np.int16) - 128).max(-1)
    return np.asarray((lightness >= DARKEST) & (lightness <= LIGHTEST) & (chroma <= MOST_CHROMA))


def _on_plane(
    depth_m: npt.NDArray[np.float32], ground_m: npt.NDArray[np.float64], camera: Calibration
) -> npt.NDArray[np.bool_]:
    focal_baseline = camera.fx_px * camera.baseline_m
    known = depth_m > 0
    error_px = focal_baseline / np.where(known, depth_m, 1.0) - focal_baseline / ground_m
    return np.asarray(~known | (np.abs(error_px) < PLANE_ERROR_PX + 0.05 * focal_baseline / ground_m))
