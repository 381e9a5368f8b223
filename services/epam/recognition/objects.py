"""What a segment shows: a convolutional network names it, or tells that it was never taught, and
describes it.

The description, an embedding, is a direction: what looks alike points the same way, from whatever
side and in whatever light it is seen, also where no name was taught. Names are directions too (Wang
et al. 2018, cosine softmax), and the activation of one is the calibrated posterior (Guo et al.
2017) of it among all names and "none of them". The network tells besides how likely the segment is
to show a building at all.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np
import numpy.typing as npt

from cogmap.errors import ConfigError
from schemas.sensing import Calibration
from services.epam.network import WEIGHTS, Network
from services.epam.recognition.crop import CHANNELS, SIDE_PX, crop, surroundings
from services.epam.recognition.segments import Depth, Image, Segment

DEFAULT_PATH = WEIGHTS / "objects.onnx"
DIMENSIONS = 64
BATCH = 4
TAKES = (BATCH, CHANNELS, SIDE_PX, SIDE_PX)
GIVES = {"embedding": (BATCH, DIMENSIONS), "odds": (BATCH, 2)}
MOST_LOOKS = 8
ALIKE = 0.9
Vector = npt.NDArray[np.float32]


class Names(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """What belongs to the network's weights: the names taught, and how sure a likeness makes.

    `directions` (n, DIMENSIONS) are those of `names`. At a cosine of `unknown` with one of them, a
    building is as likely that as none known, and log odds rise by `sharpness` with the cosine;
    `met_unknown` and `met_sharpness` are those of what was met, and not taught. The network's log
    odds that a segment shows a building, or all of one, are multiplied by `evidence`. `size_m` (n,
    3) is what towns showed: the longer and the shorter side of its ground plan, and its height.
    """

    names: list[str]
    directions: list[list[float]]
    size_m: list[tuple[float, float, float]]
    sharpness: float
    unknown: float
    met_sharpness: float
    met_unknown: float
    evidence: float


@dataclass(frozen=True, eq=False)
class Look:
    """What the network makes of a segment: its embedding (DIMENSIONS,), the probability that it
    shows a building, and that it is most of what can be seen of that.
    """

    embedding: Vector
    building: float
    whole: float


@dataclass(frozen=True, eq=False)
class Recognition:
    """The likeliest `label`, and its posterior `activation`; the probabilities of a `new` building,
    none of those known, and of no building. `size_m` is None where it was not taught, or is not
    likely.
    """

    label: str
    activation: float
    new: float
    nothing: float
    look: Look
    size_m: tuple[float, float, float] | None = None

    @property
    def known(self) -> bool:
        """Whether that label is likelier than that it has none."""
        return self.activation > self.new + self.nothing


class Recogniser:
    """Recognises segments one by one, each on its own, among what was taught and what was learned
    since.
    """

    def __init__(self, network: Network, names: Names) -> None:
        self._network = network
        self._names = names
        self._directions = np.asarray(names.directions, np.float32)
        self._labels: list[str] = []
        self._met = np.empty((0, DIMENSIONS), np.float32)

    def looks(
        self, image: Image, depth_m: Depth, found: list[Segment], camera: Calibration
    ) -> list[Look]:
        """What each of `found` looks like."""
        around = surroundings(image, depth_m, camera)
        crops = [crop(image, depth_m, segment, around, camera.fx_px) for segment in found]
        looks: list[Look] = []
        for first in range(0, len(crops), BATCH):
            batch = np.zeros(TAKES, np.float32)
            some = crops[first : first + BATCH]
            batch[: len(some)] = some
            embeddings, odds = self._network(batch)
            likely = probability(odds, self._names)
            looks += [Look(embeddings[row], *likely[row].tolist()) for row in range(len(some))]
        return looks

    def recognise(self, look: Look, apart_from: Container[str] = ()) -> Recognition:
        """What looks so, perhaps nothing that is known, and in no case one of `apart_from`."""
        labels = list(dict.fromkeys(self._labels))
        alike = self._directions @ look.embedding, self._likeness(look, labels)
        names = [*self._names.names, *labels]
        excluded = np.array([name in apart_from for name in names])
        *posterior, new, nothing = posteriors(*alike, look.building, self._names, excluded).tolist()
        best = int(np.argmax(posterior))
        found = Recognition(names[best], min(posterior[best], 1.0), new, nothing, look)
        taught = found.known and best < len(self._names.names)
        return replace(found, size_m=self._names.size_m[best]) if taught else found

    def _likeness(self, look: Look, labels: list[str]) -> Vector:
        """The cosine with each of `labels` that were met, with that of its looks which is most
        alike.
        """
        cosines = self._met @ look.embedding
        alike = np.full(len(labels), -1.0, np.float32)
        np.maximum.at(alike, [labels.index(label) for label in self._labels], cosines)
        return alike

    def learn(self, label: str, embedding: Vector) -> None:
        """From now on, what is like `embedding` is called `label`."""
        self._labels.append(label)
        self._met = np.concatenate([self._met, embedding[None]])

    def is_another(self, recognition: Recognition) -> bool:
        """Whether a building that was met, not taught, is unlike every look of it that was learned,
        and there is room for one more.
        """
        known = [vector for label, vector in self.learned if label == recognition.label]
        if not 0 < len(known) < MOST_LOOKS:
            return False
        return bool(max(vector @ recognition.look.embedding for vector in known) < ALIKE)

    @property
    def sizes_m(self) -> dict[str, tuple[float, float, float]]:
        """Of each name taught, the sides of its ground plan, the longer first, and its height."""
        return dict(zip(self._names.names, self._names.size_m, strict=True))

    @property
    def learned(self) -> list[tuple[str, Vector]]:
        """All that was learned, in order."""
        return list(zip(self._labels, self._met, strict=True))


def load(path: Path = DEFAULT_PATH) -> Recogniser:
    """A recogniser by the network in the file at `path` and the names in the .json beside it.
    Raises ConfigError.
    """
    network = Network(path, TAKES, GIVES)
    beside = path.with_suffix(".json")
    try:
        names = msgspec.json.decode(beside.read_bytes(), type=Names)
    except (OSError, msgspec.DecodeError) as error:
        raise ConfigError(
            f"{beside} does not hold the names of {path.name} ({error}): "
            "train both again with python -m training objects"
        ) from None
    shapes = {len(direction) for direction in names.directions}
    if shapes != {DIMENSIONS} or not len(names.names) == len(names.directions) == len(names.size_m):
        raise ConfigError(
            f"{beside} belongs to other weights: train both again with python -m training objects"
        )
    return Recogniser(network, names)


def posteriors(
    taught: Vector,
    met: Vector,
    building: npt.ArrayLike,
    names: Names,
    excluded: npt.ArrayLike = False,
) -> npt.NDArray[np.float64]:
    """The posterior (…, n + m + 2) of each name taught, each object met, another building, and no
    building, from the cosines (…, n) and (…, m) with their directions, the probability (…) of a
    building, and which (n + m,) it is not.
    """
    log_odds = [
        names.sharpness * (taught - names.unknown),
        names.met_sharpness * (met - names.met_unknown),
    ]
    possible = np.where(excluded, -np.inf, np.concatenate(log_odds, axis=-1, dtype=np.float64))
    likelihood = np.concatenate([possible, np.zeros((*taught.shape[:-1], 1))], axis=-1)
    weights = np.exp(likelihood - likelihood.max(axis=-1, keepdims=True))
    likely = np.asarray(building, np.float64)[..., None]
    return np.concatenate(
        [likely * weights / weights.sum(axis=-1, keepdims=True), 1 - likely], axis=-1
    )


def probability(odds: Vector, names: Names) -> npt.NDArray[np.float64]:
    """That of the network's log odds."""
    return np.asarray(1 / (1 + np.exp(-names.evidence * odds.astype(np.float64).clip(-50, 50))))
