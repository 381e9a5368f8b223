"""Trains the network that embeds segments (services/epam/recognition/objects.py), and calibrates
it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import cv2
import msgspec
import numpy as np
import numpy.typing as npt
import torch
from rich.progress import Progress
from torch import Tensor, nn
from torch.nn import functional

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
from cogmap.training.networks.optimizer import Optimizer, seed_torch
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
    _relight(varied, rng)
    _hide_parts(varied, rng)
    _remove_details(varied, rng)

    shifts = rng.integers(-3, 4, (len(varied), 2))
    for crop, shift in zip(varied, shifts, strict=True):
        shown = crop[:5]
        shown[:] = np.roll(shown, shift, axis=(1, 2))

    return varied


def _relight(values: Singles, rng: np.random.Generator) -> None:
    """Change the colours of segment, ground and sky alike, and the size a little, in place."""
    gain, offset = _lights(len(values), rng)
    _relight_segments(values, gain, offset)
    _relight_surroundings(values, gain, offset)

    log_size = rng.normal(0, 0.04, (len(values), 1, 1))
    values[:, 5] += log_size.astype(np.float32)


def _lights(count: int, rng: np.random.Generator) -> tuple[Singles, Singles]:
    """The factor (count, 3, 1, 1) on colours, and what is added to them (count, 1, 1, 1)."""
    channel_gain = rng.normal(0, 0.06, (count, 3, 1, 1))
    overall_gain = rng.normal(0, 0.15, (count, 1, 1, 1))
    gain = np.exp(channel_gain + overall_gain)

    offset = rng.normal(0, 0.06, (count, 1, 1, 1))
    return gain.astype(np.float32), offset.astype(np.float32)


def _relight_segments(values: Singles, gain: Singles, offset: Singles) -> None:
    """Change the colours of the segments, in place; outside of them they stay 0."""
    mask = values[:, 3:4]
    colours = values[:, :3]
    black = 2 * mask

    light = colours + black
    relit = light * gain - black
    added = offset * mask
    colours[:] = relit + added


def _relight_surroundings(values: Singles, gain: Singles, offset: Singles) -> None:
    """Change the colours of ground and sky, in place; where there is none they stay 0."""
    around = values[:, 6:].reshape(len(values), 2, 3, SIDE_PX, SIDE_PX)
    brightest = np.abs(around).max(axis=2, keepdims=True)
    visible = brightest > 0

    light = around + 2
    brighter = light * gain[:, None]
    relit = brighter - 2 + offset[:, None]
    around[:] = np.where(visible, relit, 0)


def _hide_parts(values: Singles, rng: np.random.Generator) -> None:
    """Remove a rectangle from some of the segments, in place."""
    is_hidden = rng.random(len(values)) < HIDDEN_SHARE

    for number in np.flatnonzero(is_hidden):
        left, top = rng.integers(0, SIDE_PX, 2)
        width, height = rng.integers(4, SIDE_PX // 2, 2)

        rows = slice(top, top + height)
        columns = slice(left, left + width)
        values[number, :4, rows, columns] = 0.0


def _remove_details(values: Singles, rng: np.random.Generator) -> None:
    """Show some of the segments with the details of a smaller image, as from farther away, in
    place.
    """
    is_far = rng.random(len(values)) < FAR_SHARE

    for number in np.flatnonzero(is_far):
        side_px = int(rng.integers(MIN_SIDE_PX, SIDE_PX))
        for channel in values[number, :5]:
            small = cv2.resize(channel, (side_px, side_px), interpolation=cv2.INTER_AREA)
            channel[:] = cv2.resize(small, (SIDE_PX, SIDE_PX), interpolation=cv2.INTER_LINEAR)


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
    uncalibrated = _uncalibrated(folder, fitted)
    found = calibrate(embeddings, log_odds, held_out, uncalibrated)

    beside = out.with_suffix(".json")
    _write(found.prototypes, beside)
    return found.metrics


def _write(prototypes: Prototypes, path: Path) -> None:
    encoded = msgspec.json.encode(prototypes)
    indented = msgspec.json.format(encoded, indent=1)
    path.write_bytes(indented + b"\n")


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
    number = _numbers(known, names)

    net = EmbeddingNet().to(memory_format=torch.channels_last)
    # Short ones turn fast at first: each of thousands of kinds is seldom seen.
    initial = INITIAL_LENGTH * torch.randn(len(names), DIMENSIONS)
    directions = nn.Parameter(initial)

    steps = max(1, epochs * len(number) // BATCH)
    parameters = [*net.parameters(), directions]
    optimizer = Optimizer(parameters, steps, MAX_RATE, WEIGHT_DECAY)
    task = progress.add_task("training", total=steps)

    batches = partial(_batches, known, number, steps, rng)
    for values, wanted, whole in prefetch(batches):
        batch = values.contiguous(memory_format=torch.channels_last)
        with torch.autocast("cpu", torch.bfloat16):
            embedding, log_odds = net(batch)

        unit = functional.normalize(directions)
        lost = loss(embedding.float(), log_odds.float(), unit, wanted, whole)
        value = optimizer.step(lost)
        progress.update(task, advance=1, description=f"training, loss {value:.3f}")

    return Fitted(net.eval(), directions, names)


def _numbers(known: Crops, names: list[str]) -> npt.NDArray[np.intp]:
    """The row (n,) in sorted `names` of what each crop shows, -1 for no building."""
    rows = np.searchsorted(names, known.name)
    is_nameless = known.name == ""
    return np.where(is_nameless, -1, rows)


def loss(
    embedding: Tensor, log_odds: Tensor, directions: Tensor, wanted: Tensor, whole: Tensor
) -> Tensor:
    """Return the loss of embeddings (n, d) and log odds (n, 2), by the row in `directions` (k, d)
    of what each shows, -1 for no building, and whether it shows most of it.
    """
    building = wanted >= 0
    cosines = embedding[building] @ directions.T

    labels = wanted[building]
    is_wanted = functional.one_hot(labels, len(directions))
    margin = MARGIN * is_wanted
    scores = SHARPNESS * (cosines - margin)
    of_labels = functional.cross_entropy(scores, labels)

    shown = torch.stack([building, whole], 1).float()
    of_odds = functional.binary_cross_entropy_with_logits(log_odds, shown)

    return of_labels + of_odds


def _batches(
    known: Crops, number: npt.NDArray[np.intp], steps: int, rng: np.random.Generator
) -> Iterator[Batch]:
    for chosen in shuffled(len(number), BATCH, steps, rng):
        values = augmented(known.values[chosen], rng)
        wanted = number[chosen]
        whole = known.whole[chosen]

        yield values, wanted, whole


def embed(net: EmbeddingNet, of: Crops) -> tuple[Singles, Singles]:
    """Return the embedding of each crop, float32 (n, DIMENSIONS), and its log odds (n, 2)."""
    embeddings = []
    log_odds = []
    parts = len(of.values) // EMBEDDED_AT_ONCE + 1
    with torch.no_grad():
        for part in np.array_split(of.values, parts):
            inputs = part.astype(np.float32)
            values = torch.from_numpy(inputs)
            embedding, odds = net(values)
            embeddings.append(embedding)
            log_odds.append(odds)

    return _array(embeddings), _array(log_odds)


def _array(parts: list[Tensor]) -> Singles:
    joined = torch.cat(parts)
    return joined.numpy().astype(np.float32)


def sizes_m(folder: Path, names: list[str]) -> dict[str, tuple[float, float, float]]:
    """Return the longer and the shorter side of each building's footprint, and its height, in the
    towns of `folder`/train.
    """
    found: dict[str, tuple[float, float, float]] = {}
    for path in files(folder, "train"):
        town = read(path)
        buildings = zip(town.names, town.size_m.tolist(), strict=True)
        for name, size_m in buildings:
            if name not in names:
                continue
            *sides_m, height_m = size_m
            longer_m = max(sides_m)
            shorter_m = min(sides_m)
            found[name] = (longer_m, shorter_m, height_m)

    return found
