"""Trains the network that embeds segments (services/epam/recognition/objects.py), and calibrates
it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import msgspec
import numpy as np
import numpy.typing as npt
import torch
from rich.progress import Progress
from torch import Tensor, nn
from torch.nn import functional

from cogmap.geometry.arrays import Singles
from services.epam.recognition.crop import CHANNELS, SIDE_PX
from services.epam.recognition.objects import (
    DIMENSIONS,
    INPUT_SHAPE,
    OUTPUT_SHAPES,
    Prototypes,
)
from services.epam.recognition.segments import load as load_segmenter
from training.calibration import calibrate
from training.crops import Crops, crops
from training.networks.export import export
from training.networks.loader import Batch, prefetch
from training.networks.optimizer import Optimizer, seed_torch
from training.networks.unet import convolution
from training.rendering.reader import INVENTED, files, read

WIDTHS = (32, 64, 128, 160)
BATCH = 64
EPOCHS = 22
MAX_RATE = 2e-3
WEIGHT_DECAY = 5e-4
SHARPNESS = 16.0
MARGIN = 0.15
INITIAL_LENGTH = 0.03
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
            self.scales.append(nn.Sequential(halved, convolution(coarse, coarse, 1)))

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
        embedding = self.head(features)
        length = embedding.square().sum(1, keepdim=True).add(1e-6).sqrt()
        return embedding / length, self.odds(features)


@dataclass(frozen=True, eq=False)
class Fitted:
    """A trained network, and the directions (k, DIMENSIONS) of the `names` it was trained on."""

    net: EmbeddingNet
    directions: Tensor
    names: list[str]


def augmented(values: npt.NDArray[np.float16], rng: np.random.Generator) -> Singles:
    """Return crops (n, ...) in another light, partly hidden, shifted. They are never mirrored: a
    building's mirror image is another building.
    """
    varied = values.astype(np.float32)
    _relight(varied, rng)
    _hide_parts(varied, rng)

    shifts = rng.integers(-3, 4, (len(varied), 2))
    for row, shift in enumerate(shifts):
        varied[row, :5] = np.roll(varied[row, :5], shift, axis=(1, 2))
    return varied


def _relight(values: Singles, rng: np.random.Generator) -> None:
    """Change the colours of segment, ground and sky alike, and the size a little, in place."""
    count = len(values)
    mask = values[:, 3:4].copy()
    channel_gain = rng.normal(0, 0.06, (count, 3, 1, 1))
    gain = np.exp(channel_gain + rng.normal(0, 0.15, (count, 1, 1, 1))).astype(np.float32)
    offset = rng.normal(0, 0.06, (count, 1, 1, 1)).astype(np.float32)
    values[:, :3] = ((values[:, :3] + 2 * mask) * gain - 2 * mask) + offset * mask

    around = values[:, 6:].reshape(count, 2, 3, *values.shape[2:])
    visible = np.abs(around).max(axis=2, keepdims=True) > 0
    relit = (around + 2) * gain[:, None] - 2 + offset[:, None]
    around[:] = np.where(visible, relit, 0)
    values[:, 5] += rng.normal(0, 0.04, (count, 1, 1)).astype(np.float32)


def _hide_parts(values: Singles, rng: np.random.Generator) -> None:
    """Remove a rectangle from some of the segments, in place."""
    for number in np.flatnonzero(rng.random(len(values)) < 0.35):
        left, top = rng.integers(0, SIDE_PX, 2)
        width, height = rng.integers(4, SIDE_PX // 2, 2)
        values[number, :4, top : top + height, left : left + width] = 0.0


def train_on_renderings(
    folder: Path, out: Path, *, seed: int, epochs: int | None = None
) -> dict[str, float]:
    """Train on the segments of `folder`/train and `folder`/unlabelled, calibrate on those of
    `folder`/val, write the network to `out` and its prototypes to the .json file beside it, and
    return the metrics on `folder`/val.

    Raises UsageError if there are no renderings.
    """
    seed_torch(seed)
    with Progress() as progress:
        training = _crops(files(folder, "train") + files(folder, "unlabelled"), progress)
        held_out = _crops(files(folder, "val"), progress)
        fitted = _fit(training, np.random.default_rng(seed), epochs or EPOCHS, progress)

    export(fitted.net, out, "seen", INPUT_SHAPE, OUTPUT_SHAPES)
    embeddings, log_odds = embed(fitted.net, held_out)
    found = calibrate(embeddings, log_odds, held_out, _uncalibrated(folder, fitted))
    encoded = msgspec.json.format(msgspec.json.encode(found.prototypes), indent=1)
    out.with_suffix(".json").write_bytes(encoded + b"\n")
    return found.metrics


def _crops(paths: list[Path], progress: Progress) -> Crops:
    tracked = progress.track(paths, description="segments")
    return crops((read(path) for path in tracked), load_segmenter())


def _uncalibrated(folder: Path, fitted: Fitted) -> Prototypes:
    """The prototypes of the catalogue's buildings, without the constants of calibration."""
    rows = [row for row, name in enumerate(fitted.names) if not name.startswith(INVENTED)]
    taught = [fitted.names[row] for row in rows]
    sizes = sizes_m(folder, fitted.names)
    unit = functional.normalize(fitted.directions).detach().numpy()[rows]
    return Prototypes(
        names=taught,
        directions=unit.astype(float).round(5).tolist(),
        size_m=[sizes[name] for name in taught],
        sharpness=1.0,
        unknown=0.0,
        novel_sharpness=1.0,
        novel_unknown=0.0,
        evidence=1.0,
    )


def _fit(known: Crops, rng: np.random.Generator, epochs: int, progress: Progress) -> Fitted:
    names = sorted(set(known.name.tolist()) - {""})
    number = np.where(known.name == "", -1, np.searchsorted(names, known.name))
    net = EmbeddingNet().to(memory_format=torch.channels_last)
    # Short ones turn fast at first: each of thousands of kinds is seldom seen.
    directions = nn.Parameter(INITIAL_LENGTH * torch.randn(len(names), DIMENSIONS))
    steps = max(1, epochs * len(number) // BATCH)
    optimizer = Optimizer([*net.parameters(), directions], steps, MAX_RATE, WEIGHT_DECAY)
    task = progress.add_task("training", total=steps)

    for values, wanted, whole in prefetch(partial(_batches, known, number, steps, rng)):
        with torch.autocast("cpu", torch.bfloat16):
            embedding, log_odds = net(values.contiguous(memory_format=torch.channels_last))
        unit = functional.normalize(directions)
        value = optimizer.step(loss(embedding.float(), log_odds.float(), unit, wanted, whole))
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
    cosines = cosines - MARGIN * functional.one_hot(wanted[building], len(directions))
    label = functional.cross_entropy(SHARPNESS * cosines, wanted[building])

    shown = torch.stack([building, whole], 1).float()
    return label + functional.binary_cross_entropy_with_logits(log_odds, shown)


def _batches(
    known: Crops, number: npt.NDArray[np.intp], steps: int, rng: np.random.Generator
) -> Iterator[Batch]:
    order = np.empty(0, np.intp)
    for _ in range(steps):
        if len(order) < BATCH:
            order = rng.permutation(len(number))
        chosen = order[:BATCH]
        order = order[BATCH:]
        yield augmented(known.values[chosen], rng), number[chosen], known.whole[chosen]


def embed(net: EmbeddingNet, of: Crops) -> tuple[Singles, Singles]:
    """Return the embedding of each crop, float32 (n, DIMENSIONS), and its log odds (n, 2)."""
    embeddings = []
    log_odds = []
    with torch.no_grad():
        for part in np.array_split(of.values, len(of.values) // EMBEDDED_AT_ONCE + 1):
            embedding, odds = net(torch.from_numpy(part.astype(np.float32)))
            embeddings.append(embedding)
            log_odds.append(odds)
    return _array(embeddings), _array(log_odds)


def _array(parts: list[Tensor]) -> Singles:
    return torch.cat(parts).numpy().astype(np.float32)


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
                found[name] = max(width_m, depth_m), min(width_m, depth_m), height_m
    return found
