"""Trains the network that embeds segments (services/epam/recognition/objects.py), and calibrates
it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import msgspec
import numpy as np
import numpy.typing as npt
import torch
from rich.progress import Progress
from torch import Tensor, nn
from torch.nn import functional

from cogmap.files.digests import write_digests
from cogmap.geometry.arrays import Singles
from cogmap.services.epam.recognition.crop import CHANNELS, SIDE_PX
from cogmap.services.epam.recognition.objects import (
    DIMENSIONS,
    INPUT_SHAPE,
    OUTPUT_SHAPES,
    Prototypes,
)
from cogmap.services.epam.recognition.segments import load as load_segmenter
from cogmap.training.calibration import calibrate
from cogmap.training.crops import Crops, crops
from cogmap.training.networks.export import export
from cogmap.training.networks.loader import Batch, prefetch, shuffled
from cogmap.training.networks.optimizer import Optimizer, mixed_precision, seed_torch
from cogmap.training.networks.unet import convolution
from cogmap.training.rendering.reader import INVENTED, files, read

WIDTHS = (32, 64, 128, 160)
BATCH = 64
EPOCHS = 18
MAX_RATE = 2e-3
WEIGHT_DECAY = 5e-4
SHARPNESS = 16.0
MARGIN = 0.15
INITIAL_LENGTH = 0.03
HIDDEN_SHARE = 0.35
FAR_SHARE = 0.4
MIN_SIDE_PX = 10
EMBEDDED_AT_ONCE = 256


class EmbeddingNet(nn.Module):
    """float32 (n, CHANNELS, SIDE_PX, SIDE_PX) to embeddings (n, DIMENSIONS) of length 1, and log
    odds (n, 2) of a building and of most of one.

    The features of each scale are pooled over all positions, by mean and maximum, so that they hold
    from other sides as well.
    """

    def __init__(self) -> None:
        super().__init__()
        self.stem = convolution(CHANNELS, WIDTHS[0], 2)

        self.scales = nn.ModuleList()
        for fine, coarse in itertools.pairwise(WIDTHS):
            halved = convolution(fine, coarse, 2)
            mixed = convolution(coarse, coarse, 1)
            self.scales.append(nn.Sequential(halved, mixed))

        features = 2 * sum(WIDTHS[1:])
        self.head = nn.Linear(features, DIMENSIONS)
        self.odds = nn.Linear(features, 2)

    def forward(self, values: Tensor) -> tuple[Tensor, Tensor]:
        """Return the embeddings and the log odds of `values`."""
        values = self.stem(values)
        pooled = []
        for scale in self.scales:
            values = scale(values)
            pooled.append(values.mean((2, 3)))
            pooled.append(values.amax((2, 3)))

        features = torch.cat(pooled, 1)
        log_odds = self.odds(features)
        embedding = self.head(features)

        squared_length = embedding.square().sum(1, keepdim=True)
        length = squared_length.add(1e-6).sqrt()
        return embedding / length, log_odds


@dataclass(frozen=True, eq=False)
class Fitted:
    """A trained network, and the directions (k, DIMENSIONS) of the `names` it was trained on."""

    net: EmbeddingNet
    directions: Tensor
    names: list[str]


def augmented(values: npt.NDArray[np.float16], rng: np.random.Generator) -> Singles:
    """Return crops (n, ...) in another light, partly hidden, from farther away, shifted. They are
    never mirrored: a building's mirror image is another building.
    """
    varied = values.astype(np.float32)
    count = len(varied)

    # Another light changes the colours of segment, ground and sky alike; outside of the segment,
    # and for ground or sky that is not in view, they stay 0. The size changes a little.
    channel_gain = rng.normal(0, 0.06, (count, 3, 1, 1))
    overall_gain = rng.normal(0, 0.15, (count, 1, 1, 1))
    gain = np.exp(channel_gain + overall_gain).astype(np.float32)
    offset = rng.normal(0, 0.06, (count, 1, 1, 1)).astype(np.float32)

    mask = varied[:, 3:4]
    colours = varied[:, :3]
    relit = (colours + 2 * mask) * gain - 2 * mask
    colours[:] = relit + offset * mask

    around = varied[:, 6:].reshape(count, 2, 3, SIDE_PX, SIDE_PX)
    visible = np.abs(around).max(axis=2, keepdims=True) > 0
    relit_around = (around + 2) * gain[:, None] - 2 + offset[:, None]
    around[:] = np.where(visible, relit_around, 0)
    varied[:, 5] += rng.normal(0, 0.04, (count, 1, 1)).astype(np.float32)

    # A rectangle of some is hidden.
    for number in np.flatnonzero(rng.random(count) < HIDDEN_SHARE):
        left, top = rng.integers(0, SIDE_PX, 2)
        width, height = rng.integers(4, SIDE_PX // 2, 2)
        varied[number, :4, top : top + height, left : left + width] = 0.0

    # Some have the details of a smaller image, as from farther away.
    for number in np.flatnonzero(rng.random(count) < FAR_SHARE):
        side_px = int(rng.integers(MIN_SIDE_PX, SIDE_PX))
        for channel in varied[number, :5]:
            small = cv2.resize(channel, (side_px, side_px), interpolation=cv2.INTER_AREA)
            channel[:] = cv2.resize(small, (SIDE_PX, SIDE_PX), interpolation=cv2.INTER_LINEAR)

    shifts = rng.integers(-3, 4, (count, 2))
    for crop, shift in zip(varied, shifts, strict=True):
        crop[:5] = np.roll(crop[:5], shift, axis=(1, 2))

    return varied


def train_on_renderings(
    folder: Path, out: Path, *, seed: int, epochs: int | None = None
) -> dict[str, float]:
    """Train on the segments of `folder`/train and `folder`/unlabelled, calibrate on those of
    `folder`/val, write the network to `out` and its prototypes to the .json file beside it, and
    return the metrics on `folder`/val.

    Raises UsageError if there are no renderings.
    """
    seed_torch(seed)
    training_files = files(folder, "train") + files(folder, "unlabelled")
    held_out_files = files(folder, "val")
    rng = np.random.default_rng(seed)

    with Progress() as progress:
        training = _crops(training_files, progress)
        held_out = _crops(held_out_files, progress)
        fitted = _fit(training, rng, epochs or EPOCHS, progress)

    export(fitted.net, out, "seen", INPUT_SHAPE, OUTPUT_SHAPES)
    embeddings, log_odds = embed(fitted.net, held_out)

    # The prototypes of the catalogue's buildings, without the constants of calibration yet.
    rows = [row for row, name in enumerate(fitted.names) if not name.startswith(INVENTED)]
    taught = [fitted.names[row] for row in rows]
    sizes = sizes_m(folder, fitted.names)
    unit = functional.normalize(fitted.directions).detach().numpy()[rows]
    prototypes = Prototypes(
        names=taught,
        directions=unit.astype(float).round(5).tolist(),
        size_m=[sizes[name] for name in taught],
        sharpness=1.0,
        unknown=0.0,
        novel_sharpness=1.0,
        novel_unknown=0.0,
        evidence=1.0,
        taught_share=0.5,
    )
    found = calibrate(embeddings, log_odds, held_out, prototypes)

    encoded = msgspec.json.format(msgspec.json.encode(found.prototypes), indent=1)
    beside = out.with_suffix(".json")
    beside.write_bytes(encoded + b"\n")
    write_digests(beside)
    return found.metrics


def _crops(paths: list[Path], progress: Progress) -> Crops:
    tracked = progress.track(paths, description="segments")
    return crops((read(path) for path in tracked), load_segmenter())


def _fit(known: Crops, rng: np.random.Generator, epochs: int, progress: Progress) -> Fitted:
    names = sorted(set(known.name.tolist()) - {""})
    number = np.where(known.name == "", -1, np.searchsorted(names, known.name))

    net = EmbeddingNet().to(memory_format=torch.channels_last)
    # Short ones turn fast at first: each of thousands of kinds is seldom seen.
    directions = nn.Parameter(INITIAL_LENGTH * torch.randn(len(names), DIMENSIONS))

    steps = max(1, epochs * len(number) // BATCH)
    parameters = [*net.parameters(), directions]
    optimizer = Optimizer(parameters, steps, MAX_RATE, WEIGHT_DECAY)
    task = progress.add_task("training", total=steps)

    def batches() -> Iterator[Batch]:
        for chosen in shuffled(len(number), BATCH, steps, rng):
            yield augmented(known.values[chosen], rng), number[chosen], known.whole[chosen]

    for values, wanted, whole in prefetch(batches):
        batch = values.contiguous(memory_format=torch.channels_last)
        with mixed_precision():
            embedding, log_odds = net(batch)

        unit = functional.normalize(directions)
        lost = loss(embedding.float(), log_odds.float(), unit, wanted, whole)
        value = optimizer.step(lost)
        progress.update(task, advance=1, description=f"training, loss {value:.3f}")

    return Fitted(net.eval(), directions, names)


def loss(
    embedding: Tensor, log_odds: Tensor, directions: Tensor, wanted: Tensor, whole: Tensor
) -> Tensor:
    """Return the loss of embeddings (n, d) and log odds (n, 2), by the row in `directions` (k, d)
    of what each shows, -1 for no building, and whether it shows most of it.
    """
    building = wanted >= 0
    cosines = embedding[building] @ directions.T

    labels = wanted[building]
    margin = MARGIN * functional.one_hot(labels, len(directions))
    of_labels = functional.cross_entropy(SHARPNESS * (cosines - margin), labels)

    shown = torch.stack([building, whole], 1).float()
    return of_labels + functional.binary_cross_entropy_with_logits(log_odds, shown)


def embed(net: EmbeddingNet, of: Crops) -> tuple[Singles, Singles]:
    """Return the embedding of each crop, float32 (n, DIMENSIONS), and its log odds (n, 2)."""
    embeddings = []
    log_odds = []
    parts = len(of.values) // EMBEDDED_AT_ONCE + 1
    with torch.no_grad():
        for part in np.array_split(of.values, parts):
            embedding, odds = net(torch.from_numpy(part.astype(np.float32)))
            embeddings.append(embedding)
            log_odds.append(odds)

    joined_embeddings, joined_odds = torch.cat(embeddings), torch.cat(log_odds)
    return joined_embeddings.numpy().astype(np.float32), joined_odds.numpy().astype(np.float32)


def sizes_m(folder: Path, names: list[str]) -> dict[str, tuple[float, float, float]]:
    """Return the longer and the shorter side of each building's footprint, and its height, in the
    towns of `folder`/train.
    """
    found: dict[str, tuple[float, float, float]] = {}
    for path in files(folder, "train"):
        town = read(path)
        for name, (width_m, depth_m, height_m) in zip(
            town.names, town.size_m.tolist(), strict=True
        ):
            if name in names:
                found[name] = (max(width_m, depth_m), min(width_m, depth_m), height_m)

    return found
