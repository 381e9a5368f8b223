"""What each building looks like: the colours of its walls, and its size."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from bus.errors import ConfigError

Floats = npt.NDArray[np.float64]
Image = npt.NDArray[np.uint8]

LIGHTNESS_LEVELS, CHROMA_LEVELS = 8, 16
CHROMA_STEP = 10
BINS = LIGHTNESS_LEVELS * CHROMA_LEVELS**2
DEFAULT_PATH = Path(__file__).with_name("appearance.npz")


@dataclass(frozen=True, eq=False)
class Appearance:
    """The learned model of n kinds of building.

    `log_colour` float32 (BINS, n + 2): log probability of each colour given the kind, then given something that was
    not learned, then given no object at all: ground, sky. `footprint_m` (n, 2): sides of the ground plan, the longer
    first; `height_m` (n,); `top_m` (n, 2): how low and how high the upper end of a wall and its roof appears.
    """

    names: tuple[str, ...]
    log_colour: npt.NDArray[np.float32]
    footprint_m: Floats
    height_m: Floats
    top_m: Floats

    @property
    def other(self) -> int:
        """The column of an object that was not learned."""
        return len(self.names)

    @property
    def background(self) -> int:
        """The column of no object."""
        return len(self.names) + 1

    def save(self, path: Path) -> None:
        """Write the model to `path`."""
        np.savez_compressed(
            path,
            names=np.array(self.names),
            log_colour=self.log_colour.astype(np.float16),
            footprint_m=self.footprint_m,
            height_m=self.height_m,
            top_m=self.top_m,
        )


def load(path: Path) -> Appearance:
    """The model in the file at `path`. Raises ConfigError where there is none."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            model = Appearance(
                tuple(str(name) for name in stored["names"]),
                stored["log_colour"].astype(np.float32),
                stored["footprint_m"].astype(np.float64),
                stored["height_m"].astype(np.float64),
                stored["top_m"].astype(np.float64),
            )
    except FileNotFoundError:
        raise ConfigError(f"no appearance model {path}: make one with python -m services.epam.learn") from None
    except (OSError, ValueError, KeyError) as error:
        raise ConfigError(
            f"{path} is no appearance model ({error}): make one with python -m services.epam.learn"
        ) from None
    if model.log_colour.shape != (BINS, len(model.names) + 2):
        raise ConfigError(f"{path} was learned by another version: learn it again with python -m services.epam.learn")
    return model


def lab(image: Image) -> Image:
    """CIE L*a*b* of an RGB image, each channel as a byte."""
    return cv2.cvtColor(image, cv2.COLOR_RGB2LAB).astype(np.uint8, copy=False)


def colour_bins(lab_pixels: Image) -> npt.NDArray[np.intp]:
    """The bin of each colour (…, 3): lightness, coarsely, since shading changes it, and the two chroma axes."""
    lightness = lab_pixels[..., 0].astype(np.intp) * LIGHTNESS_LEVELS // 256
    chroma = (lab_pixels[..., 1:].astype(np.intp) - 128) // CHROMA_STEP + CHROMA_LEVELS // 2
    chroma = chroma.clip(0, CHROMA_LEVELS - 1)
    return (lightness * CHROMA_LEVELS + chroma[..., 0]) * CHROMA_LEVELS + chroma[..., 1]
