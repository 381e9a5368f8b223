"""Recognizes what a segment shows: a convolutional network embeds it, and the embedding is compared
with prototypes.

An embedding is a direction: what looks alike points the same way, from any side and in any light,
also where no label was taught. Prototypes are directions too (Wang et al. 2018, cosine softmax),
and the activation of a label is its calibrated posterior (Guo et al. 2017) among all labels, an
unknown building and the background. The network also estimates the probability that the segment
shows a building at all.
"""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import msgspec
import numpy as np
import numpy.typing as npt

from cogmap.errors import ConfigError
from cogmap.files.digests import read_checked
from cogmap.geometry.arrays import Bytes, Floats, Singles
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import Appearance as PublishedAppearance
from cogmap.schemas.sensing import Calibration
from cogmap.services.epam.config import Processor
from cogmap.services.epam.network import WEIGHTS, Network
from cogmap.services.epam.recognition.crop import CHANNELS, SIDE_PX, crop, surroundings
from cogmap.services.epam.recognition.segments import Segment

DEFAULT_PATH = WEIGHTS / "objects.onnx"
# Of the network: length of an embedding, and segments a pass. The weights are exported for both.
DIMENSIONS = 64
BATCH = 4
INPUT_SHAPE = (BATCH, CHANNELS, SIDE_PX, SIDE_PX)
OUTPUT_SHAPES = {"embedding": (BATCH, DIMENSIONS), "odds": (BATCH, 2)}
FIELDS_IN_FILE = {"novel_sharpness": "met_sharpness", "novel_unknown": "met_unknown"}


class Prototypes(
    msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True, rename=FIELDS_IN_FILE
):
    """What belongs to the network's weights: a direction for each label that was taught, and the
    constants that make a cosine a probability.

    `directions` (n, DIMENSIONS) are those of `names`. At a cosine of `unknown` with one of them, a
    building is as likely that as an unknown one, and log odds rise by `sharpness` with the cosine;
    `novel_unknown` and `novel_sharpness` are those of objects learned from one encounter. The
    network's log odds that a segment shows a building, or most of one, are multiplied by
    `evidence`. Of the buildings that these constants were fitted on, `taught_share` had one of the
    `names`. `size_m` (n, 3) are the longer and the shorter side of the footprint, and the height.
    """

    names: list[str]
    directions: list[list[float]]
    size_m: list[tuple[float, float, float]]
    sharpness: float
    unknown: float
    novel_sharpness: float
    novel_unknown: float
    evidence: float
    taught_share: Annotated[float, msgspec.Meta(gt=0, lt=1)]


@dataclass(frozen=True, eq=False)
class Appearance:
    """The network's output for a segment: its embedding (DIMENSIONS,), the probability that it
    shows a building, and that it shows most of what is visible of that building.
    """

    embedding: Singles
    building: float
    whole: float


class EmbeddingPass(NamedTuple):
    """So many segments, at most BATCH, that are being embedded, and the network's outputs."""

    number: int
    outputs: Future[list[Singles]]


@dataclass(frozen=True, eq=False)
class Recognition:
    """The likeliest `label` with its posterior `activation`, which is with the prior.

    Without that prior, by the view and the share of taught buildings in the drive, `evidence` is
    the posterior of the label, beside the probabilities of an `unknown` building and of
    `background`; `names` are those of all labels. `size_m` is None unless the label has more
    evidence than those two.
    """

    label: str
    activation: float
    evidence: float
    unknown: float
    background: float
    names: dict[str, float]
    appearance: Appearance
    size_m: tuple[float, float, float] | None = None

    @property
    def known(self) -> bool:
        """Return whether the label is likelier than an unknown building and background together,
        without the prior.
        """
        return self.evidence > self.unknown + self.background


class ObjectRecognizer:
    """Recognizes segments one by one, among what was taught."""

    def __init__(self, network: Network, prototypes: Prototypes) -> None:
        self._network = network
        self._prototypes = prototypes
        self._directions = np.asarray(prototypes.directions, np.float32)

    def begin(
        self, image: Bytes, depth_m: Singles, segments: list[Segment], camera: Calibration
    ) -> list[EmbeddingPass]:
        """Begin to embed `segments` of a view, beside what the caller does meanwhile."""
        around = surroundings(image, depth_m, camera)

        passes = []
        for first in range(0, len(segments), BATCH):
            some = segments[first : first + BATCH]
            batch = np.zeros(INPUT_SHAPE, np.float32)
            for row, segment in enumerate(some):
                batch[row] = crop(image, depth_m, segment, around, camera.fx_px)
            passes.append(EmbeddingPass(len(some), self._network.begin(batch)))

        return passes

    def appearances(self, passes: Iterable[EmbeddingPass]) -> list[Appearance]:
        """Return the appearance of each segment, once all are embedded."""
        appearances = []
        for each in passes:
            embeddings, log_odds = each.outputs.result()
            probabilities = probability(log_odds, self._prototypes)
            for row in range(each.number):
                building, whole = probabilities[row].tolist()
                appearances.append(Appearance(embeddings[row], building, whole))

        return appearances

    @property
    def labels(self) -> list[str]:
        """Return all labels that a segment may be recognized as."""
        return self._prototypes.names

    @property
    def taught_share(self) -> float:
        """Return the share of the buildings calibrated on that had one of `labels`."""
        return self._prototypes.taught_share

    def recognize(
        self,
        appearance: Appearance,
        log_prior: Floats | float = 0.0,
        log_taught: float = 0.0,
    ) -> Recognition:
        """Return the recognition of a segment with this `appearance`.

        `log_prior`: how much likelier each of `labels` was before the view, as a logarithm.
        `log_taught`: how much likelier all of them are in this drive than where they were
        calibrated, which counts as evidence.
        """
        labels = self.labels
        none = np.empty(0, np.float32)
        cosines = self._directions @ appearance.embedding
        possible = _log_odds(cosines, none, self._prototypes) + log_taught

        *seen, unknown, background = _posteriors(possible, appearance.building).tolist()
        expected = _posteriors(possible + log_prior, appearance.building)
        best = int(np.argmax(expected[: len(labels)]))
        evidence = min(seen[best], 1.0)

        size_m = None
        if evidence > unknown + background:
            size_m = self._prototypes.size_m[best]

        return Recognition(
            label=labels[best],
            activation=min(float(expected[best]), 1.0),
            evidence=evidence,
            unknown=unknown,
            background=background,
            names={name: min(value, 1.0) for name, value in zip(labels, seen, strict=True)},
            appearance=appearance,
            size_m=size_m,
        )

    def published(self, appearance: Appearance) -> PublishedAppearance:
        """Return an appearance as others compare it with further ones: what was met once is
        recognized by its cosine with that.
        """
        return PublishedAppearance(
            direction=Array.of(appearance.embedding, "<f4"),
            sharpness=self._prototypes.novel_sharpness,
            even_cosine=self._prototypes.novel_unknown,
        )

    @property
    def sizes_m(self) -> dict[str, tuple[float, float, float]]:
        """Return each taught label's footprint sides, the longer first, and height."""
        return dict(zip(self._prototypes.names, self._prototypes.size_m, strict=True))


def load(path: Path = DEFAULT_PATH, processor: Processor = "cpu") -> ObjectRecognizer:
    """Load the embedding network in the file at `path` and the prototypes in the .json file beside
    it. Raises ConfigError if they cannot be read or do not belong together, or there is no such
    processor.
    """
    network = Network(path, INPUT_SHAPE, OUTPUT_SHAPES, processor)
    beside = path.with_suffix(".json")
    try:
        prototypes = msgspec.json.decode(read_checked(beside), type=Prototypes)
    except (msgspec.DecodeError, RecursionError) as error:
        raise ConfigError(
            f"{beside} does not hold the prototypes of {path.name} ({error}): "
            "train both again with cogmap train objects"
        ) from None

    dimensions = {len(direction) for direction in prototypes.directions}
    counts = {len(prototypes.names), len(prototypes.directions), len(prototypes.size_m)}
    if dimensions != {DIMENSIONS} or len(counts) != 1:
        raise ConfigError(
            f"{beside} belongs to other weights: train both again with cogmap train objects"
        )
    return ObjectRecognizer(network, prototypes)


def posteriors(
    taught: Singles,
    novel: Singles,
    building: npt.ArrayLike,
    prototypes: Prototypes,
    excluded: npt.ArrayLike = False,
) -> Floats:
    """Return the posterior (..., n + m + 2) of each label taught, each label learned, an unknown
    building, and background.

    `taught` (..., n) and `novel` (..., m) are cosines with their directions, `building` (...) the
    probability of a building; labels `excluded` (n + m,) have a posterior of 0.
    """
    log_odds = _log_odds(taught, novel, prototypes)
    return _posteriors(np.where(excluded, -np.inf, log_odds), building)


def _posteriors(possible: Floats, building: npt.ArrayLike) -> Floats:
    """Compute the posterior (..., n + 2) of each label, an unknown building and background, from
    the log odds (..., n) of each label over an unknown building.
    """
    *leading, _ = possible.shape
    unknown = np.zeros((*leading, 1))
    log_weights = np.concatenate([possible, unknown], axis=-1)
    # Scaled so that the largest is 1.
    weights = np.asarray(np.exp(log_weights - log_weights.max(axis=-1, keepdims=True)))
    total = weights.sum(axis=-1, keepdims=True)

    of_building = np.asarray(building, np.float64)[..., None]
    labels = of_building * weights / total
    return np.concatenate([labels, 1 - of_building], axis=-1)


def _log_odds(taught: Singles, novel: Singles, prototypes: Prototypes) -> Floats:
    """Compute log odds (..., n + m) of each label, taught or learned, over an unknown building."""
    taught_odds = prototypes.sharpness * (taught - prototypes.unknown)
    novel_odds = prototypes.novel_sharpness * (novel - prototypes.novel_unknown)
    return np.concatenate([taught_odds, novel_odds], axis=-1, dtype=np.float64)


def probability(log_odds: Singles, prototypes: Prototypes) -> Floats:
    """Return the calibrated probability of the network's log odds."""
    calibrated = prototypes.evidence * log_odds.astype(np.float64).clip(-50, 50)
    return np.asarray(1 / (1 + np.exp(-calibrated)))
