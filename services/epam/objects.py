"""What a segment shows: a convolutional network names it, or tells that it was never taught, and describes it.

The description, an embedding, is a direction: what looks alike points the same way, from whatever side and in whatever
light it is seen, also where no name was taught. Names are directions too (Wang et al. 2018, cosine softmax), and the
activation of one is the calibrated posterior (Guo et al. 2017) of it among all names and "none of them".
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import msgspec
import numpy as np
import numpy.typing as npt

from bus.errors import ConfigError
from services.epam.network import WEIGHTS, Network, Tensor
from services.epam.segments import Depth, Image, Segment

DEFAULT_PATH = WEIGHTS / "objects.onnx"
SIDE_PX = 48
CHANNELS = 5
DIMENSIONS = 64
BATCH = 4
TAKES = (BATCH, CHANNELS, SIDE_PX, SIDE_PX)
GIVES = {"embedding": (BATCH, DIMENSIONS)}
MARGIN = 0.04
UNKNOWN_DISTANCE_M = 30.0
Vector = npt.NDArray[np.float32]


class Names(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """What belongs to the network's weights: the names taught, and how sure a likeness makes.

    `directions` (n, DIMENSIONS) are those of `names`; log odds are `sharpness` times the cosine with one of them, times
    `unknown` for none. What was met once, and not taught, has a cosine of less than its due: `once` is added to it.
    `size_m` (n, 3) is what towns showed of each: the longer and the shorter side of its ground plan, and its height.
    """

    names: list[str]
    directions: list[list[float]]
    size_m: list[tuple[float, float, float]]
    sharpness: float
    unknown: float
    once: float


@dataclass(frozen=True, eq=False)
class Recognition:
    """`label` is empty for what has none yet, `size_m` None where it was not taught; `activation` is its posterior."""

    label: str
    activation: float
    embedding: Vector
    size_m: tuple[float, float, float] | None = None


class Recogniser:
    """Recognises segments one by one, each on its own, among what was taught and what was learned since."""

    def __init__(self, network: Network, names: Names) -> None:
        self._network = network
        self._names = names
        self._directions = np.asarray(names.directions, np.float32)
        self._labels: list[str] = []
        self._met = np.empty((0, DIMENSIONS), np.float32)

    def embeddings(self, image: Image, depth_m: Depth, found: list[Segment], focal_px: float) -> list[Vector]:
        """The embedding of each of `found`, float32 (DIMENSIONS,)."""
        crops = [crop(image, depth_m, segment.mask, segment.box_px, focal_px) for segment in found]
        embeddings: list[Vector] = []
        for first in range(0, len(crops), BATCH):
            batch = np.zeros(TAKES, np.float32)
            some = crops[first : first + BATCH]
            batch[: len(some)] = some
            embeddings += list(self._network(batch)[0][: len(some)])
        return embeddings

    def recognise(self, embedding: Vector) -> Recognition:
        """What has that embedding, perhaps nothing known."""
        posterior = posteriors(self._directions @ embedding, self._met @ embedding, self._names)
        best, taught = int(posterior.argmax()), len(self._names.names)
        activation = float(posterior[best])
        if best < taught:
            return Recognition(self._names.names[best], activation, embedding, self._names.size_m[best])
        label = self._labels[best - taught] if best < len(posterior) - 1 else ""
        if label:
            same = [taught + number for number, other in enumerate(self._labels) if other == label]
            activation = float(posterior[same].sum())
        return Recognition(label, min(activation, 1.0), embedding)

    def learn(self, label: str, embedding: Vector) -> None:
        """From now on, what is like `embedding` is called `label`."""
        self._labels.append(label)
        self._met = np.concatenate([self._met, embedding[None]])

    @property
    def sizes_m(self) -> dict[str, tuple[float, float, float]]:
        """Of each name taught, the sides of its ground plan, the longer first, and its height."""
        return dict(zip(self._names.names, self._names.size_m, strict=True))

    @property
    def learned(self) -> list[tuple[str, Vector]]:
        """All that was learned, in order."""
        return list(zip(self._labels, self._met, strict=True))


def load(path: Path = DEFAULT_PATH) -> Recogniser:
    """A recogniser by the network in the file at `path` and the names in the .json beside it. Raises ConfigError."""
    network, beside = Network(path, TAKES, GIVES), path.with_suffix(".json")
    try:
        names = msgspec.json.decode(beside.read_bytes(), type=Names)
    except (OSError, msgspec.DecodeError) as error:
        raise ConfigError(
            f"{beside} does not hold the names of {path.name} ({error}): "
            "train both again with python -m services.epam.train objects"
        ) from None
    shapes = {len(direction) for direction in names.directions}
    if shapes != {DIMENSIONS} or not len(names.names) == len(names.directions) == len(names.size_m):
        raise ConfigError(
            f"{beside} belongs to other weights: train both again with python -m services.epam.train objects"
        )
    return Recogniser(network, names)


def posteriors(taught: Vector, met: Vector, names: Names) -> npt.NDArray[np.float64]:
    """The posterior (…, n + m + 1) of each name taught, each object met, and none of them, from the cosines (…, n)
    and (…, m) with their directions."""
    none = np.full((*taught.shape[:-1], 1), names.unknown)
    log_odds = names.sharpness * np.concatenate([taught, met + names.once, none], axis=-1, dtype=np.float64)
    weights = np.exp(log_odds - log_odds.max(axis=-1, keepdims=True))
    return np.asarray(weights / weights.sum(axis=-1, keepdims=True))


def crop(
    image: Image, depth_m: Depth, mask: npt.NDArray[np.bool_], box_px: tuple[int, int, int, int], focal_px: float
) -> Tensor:
    """A segment as the network sees it, float32 (CHANNELS, SIDE_PX, SIDE_PX): three colours, 0 where it is not, where
    it is, and the logarithm of how many metres the picture is high."""
    left, top, wide, high = box_px
    side = round(max(wide, high) * (1 + 2 * MARGIN))
    span = slice(top, top + high), slice(left, left + wide)
    square = np.zeros((side, side, 4), np.float32)
    into = slice((side - high) // 2, (side - high) // 2 + high), slice((side - wide) // 2, (side - wide) // 2 + wide)
    shown = mask[span].astype(np.float32)
    square[*into, :3] = (image[span].astype(np.float32) / 64.0 - 2.0) * shown[..., None]
    square[*into, 3] = shown
    how = cv2.INTER_AREA if side > SIDE_PX else cv2.INTER_LINEAR
    values = np.empty((CHANNELS, SIDE_PX, SIDE_PX), np.float32)
    values[:4] = cv2.resize(square, (SIDE_PX, SIDE_PX), interpolation=how).transpose(2, 0, 1)
    known = depth_m[span][mask[span] & (depth_m[span] > 0)]
    distance_m = float(np.median(known)) if len(known) else UNKNOWN_DISTANCE_M
    values[4] = np.log(max(side * distance_m / focal_px, 1.0)) / 2.0 - 1.0
    return values
