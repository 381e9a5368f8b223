"""Trains the network that separates candidate objects (services/epam/recognition/segments.py)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
import torch
from rich.progress import Progress
from torch import Tensor, nn
from torch.nn import functional

from cogmap.geometry.arrays import Bytes, Floats, Singles
from cogmap.schemas.sensing import Calibration
from cogmap.services.epam.recognition.segments import (
    CHANNELS,
    HEIGHT_PX,
    INPUT_SHAPE,
    OFFSET_PX,
    OUTPUT_SHAPES,
    PADDING_PX,
    WIDTH_PX,
    Segment,
    load,
    network_input,
    padded,
)
from cogmap.training.crops import MIN_OVERLAP, overlap
from cogmap.training.networks.export import export
from cogmap.training.networks.loader import prefetch, shuffled
from cogmap.training.networks.optimizer import Optimizer, seed_torch
from cogmap.training.networks.unet import UNet
from cogmap.training.rendering.reader import Town, files, read, towns

WIDTHS = (16, 48, 96, 160)
BATCH = 16
EPOCHS = 16
MAX_RATE = 3e-3
WEIGHT_DECAY = 1e-4
MIN_AREA_PX = 10
LARGE_SHARE = 0.01


class SegmentationNet(nn.Module):
    """float32 (n, CHANNELS, h, w) to (n, 4, h, w): a U-Net at half the resolution, each pixel of
    which predicts four.
    """

    def __init__(self) -> None:
        super().__init__()
        self.stem = nn.Conv2d(CHANNELS, WIDTHS[0], 3, stride=2, padding=1)
        self.body = UNet(WIDTHS[0], 4 * 4, WIDTHS)
        self.finer = nn.PixelShuffle(2)

    def forward(self, values: Tensor) -> Tensor:
        """Return the output for `values`."""
        halved = functional.relu(self.stem(values))
        return self.finer(self.body(halved))


@dataclass(frozen=True, eq=False)
class Examples:
    """Network inputs, float16 (n, CHANNELS, h, w), and the number of the building at each pixel,
    uint8 (n, h, w), 0 for none.
    """

    values: npt.NDArray[np.float16]
    label: Bytes


def examples(towns: Iterable[Town]) -> Examples:
    """Return all views of `towns`, at the network's resolution."""
    values = []
    labels = []
    size = (WIDTH_PX, HEIGHT_PX)
    for town in towns:
        views = zip(town.left, town.stereo_m, town.label, strict=True)
        for image, depth_m, label in views:
            example = _example(image, depth_m, town.calibration)
            small_label = cv2.resize(label, size, interpolation=cv2.INTER_NEAREST)
            values.append(example)
            labels.append(small_label)

    stacked_labels = np.asarray(labels, np.uint8)
    return Examples(np.asarray(values), stacked_labels)


def _example(image: Bytes, depth_m: Singles, camera: Calibration) -> npt.NDArray[np.float16]:
    size = (WIDTH_PX, HEIGHT_PX)
    resized = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    small = resized.astype(np.uint8, copy=False)

    resized_m = cv2.resize(depth_m, size, interpolation=cv2.INTER_NEAREST)
    small_m = resized_m.astype(np.float32, copy=False)

    values = network_input(small, small_m, camera)
    return values.astype(np.float16)


def target(label: Bytes) -> Singles:
    """Return what the network should predict for labels (h, w), float32 (5, h, w): building,
    centre, offset to the right and downwards, and the weight of the offset.
    """
    rows, columns = np.nonzero(label)
    number = label[rows, columns]
    areas = _areas(number, rows, columns)

    wanted = np.zeros((5, *label.shape), np.float32)
    wanted[0] = label > 0
    _draw_centres(wanted[1], areas)

    right_px = areas.centre_column[number] - columns
    down_px = areas.centre_row[number] - rows
    wanted[2, rows, columns] = right_px / OFFSET_PX
    wanted[3, rows, columns] = down_px / OFFSET_PX
    wanted[4, rows, columns] = _weight(number, areas.size_px)
    return wanted


class _Areas(NamedTuple):
    """Of each number of a label, (k,): how many pixels show it, and the middle of these."""

    size_px: npt.NDArray[np.intp]
    centre_row: Floats
    centre_column: Floats


def _areas(number: Bytes, rows: npt.NDArray[np.intp], columns: npt.NDArray[np.intp]) -> _Areas:
    """What the pixels of `rows` and `columns` show, by number (n,) each."""
    size_px = np.bincount(number, minlength=1)
    divisor = np.maximum(size_px, 1)

    row_sum = np.bincount(number, rows, minlength=1)
    column_sum = np.bincount(number, columns, minlength=1)
    return _Areas(
        size_px=size_px,
        centre_row=row_sum / divisor,
        centre_column=column_sum / divisor,
    )


def _draw_centres(image: Singles, areas: _Areas) -> None:
    """Raise `image` (h, w) to a bump at the centre of each large area, larger for a larger one."""
    is_large = areas.size_px >= MIN_AREA_PX

    for number in np.flatnonzero(is_large):
        sd_px = np.clip(0.12 * np.sqrt(areas.size_px[number]), 1.5, 5.0)
        row = areas.centre_row[number]
        column = areas.centre_column[number]

        bump = _bump(image.shape, row, column, sd_px)
        np.maximum(image, bump, out=image)


def _weight(number: Bytes, size_px: npt.NDArray[np.intp]) -> Floats:
    """(n,): the weight of each pixel, 1 on the mean: of a large area the less the larger it is."""
    is_large = size_px >= MIN_AREA_PX
    divisor = np.maximum(size_px, 1)
    weight = is_large[number] / np.sqrt(divisor[number])

    scale = len(number) / max(float(weight.sum()), 1e-9)
    weighted: Floats = weight * scale
    return weighted


def _bump(size: tuple[int, ...], row: float, column: float, sd_px: float) -> Floats:
    """A Gaussian of height 1 about that pixel, (h, w)."""
    height, width = size
    down = _gaussian(height, row, sd_px)
    across = _gaussian(width, column, sd_px)

    return np.outer(down, across)


def _gaussian(count: int, middle: float, sd: float) -> Floats:
    """A Gaussian of height 1 at 0, 1, and so on, (count,)."""
    away = np.arange(count) - middle
    squared = away**2
    variance = sd**2

    exponent = -squared / (2 * variance)
    return np.asarray(np.exp(exponent))


def loss(output: Tensor, wanted: Tensor) -> Tensor:
    """Return the loss of the network's output (n, 4, h, w); small buildings have more weight than
    their pixels.
    """
    building = functional.binary_cross_entropy_with_logits(output[:, 0], wanted[:, 0])

    wanted_centre = wanted[:, 1]
    squared = (output[:, 1] - wanted_centre).square()
    emphasis = 1 + 8 * wanted_centre
    centre = (squared * emphasis).mean()

    weight = wanted[:, 4]
    error = (output[:, 2:4] - wanted[:, 2:4]).abs()
    weighted = error.sum(1) * weight
    offset = weighted.sum() / (weight.sum() + 1)

    return building + 20 * centre + 2 * offset


def augmented(
    values: npt.NDArray[np.float16], label: Bytes, rng: np.random.Generator
) -> tuple[Singles, Bytes]:
    """Return one example, perhaps mirrored, in another light, with less depth."""
    varied = values.astype(np.float32)
    if rng.random() < 0.5:
        varied[:7] = varied[:7, :, ::-1]
        label = label[:, ::-1]

    _relight(varied[:3], rng)
    if rng.random() < 0.3:
        _lose_depth(varied[3:6], rng)

    return varied, label


def _relight(colours: Singles, rng: np.random.Generator) -> None:
    """Change the light on colours (3, h, w), in place."""
    channel_gain = rng.normal(0, 0.08, (3, 1, 1))
    overall_gain = rng.normal(0, 0.12)
    gain = np.exp(channel_gain + overall_gain).astype(np.float32)
    offset = rng.normal(0, 0.05)

    light = colours + 2
    colours[:] = light * gain - 2 + offset


def _lose_depth(channels: Singles, rng: np.random.Generator) -> None:
    """Set what follows from depth (3, h, w) to 0 in some patches, in place."""
    coarse = rng.random((15, 20), np.float32)
    field = cv2.resize(coarse, (WIDTH_PX, HEIGHT_PX))

    is_lost = field < rng.uniform(0, 0.4)
    channels[:, is_lost] = 0.0


def train_on_renderings(
    folder: Path, out: Path, *, seed: int, epochs: int | None = None
) -> dict[str, float]:
    """Train on the towns in `folder`/train, write the network to `out`, and return its `metrics`.

    Raises UsageError if there are no renderings.
    """
    seed_torch(seed)
    rng = np.random.default_rng(seed)

    with Progress() as progress:
        paths = progress.track(files(folder, "train"), description="reading")
        known = examples(read(path) for path in paths)
        net = _fit(known, rng, epochs or EPOCHS, progress)

    export(net, out, "seen", INPUT_SHAPE, OUTPUT_SHAPES)
    return metrics(folder, out)


def _fit(
    known: Examples, rng: np.random.Generator, epochs: int, progress: Progress
) -> SegmentationNet:
    net = SegmentationNet().to(memory_format=torch.channels_last)
    steps = max(1, epochs * len(known.label) // BATCH)
    optimizer = Optimizer(net.parameters(), steps, MAX_RATE, WEIGHT_DECAY)

    task = progress.add_task("training", total=steps)
    batches = partial(_batches, known, steps, rng)
    for values, wanted in prefetch(batches):
        batch = values.contiguous(memory_format=torch.channels_last)
        with torch.autocast("cpu", torch.bfloat16):
            padded_output = net(batch)

        output = padded_output[:, :, PADDING_PX:-PADDING_PX].float()
        value = optimizer.step(loss(output, wanted))
        progress.update(task, advance=1, description=f"training, loss {value:.3f}")

    return net


def _batches(
    known: Examples, steps: int, rng: np.random.Generator
) -> Iterator[tuple[Singles, Singles]]:
    for chosen in shuffled(len(known.label), BATCH, steps, rng):
        inputs = []
        targets = []
        for number in chosen:
            values, label = augmented(known.values[number], known.label[number], rng)
            inputs.append(values)
            targets.append(target(label))

        yield padded(np.stack(inputs)), np.stack(targets)


def metrics(folder: Path, weights: Path) -> dict[str, float]:
    """Return the recall of buildings that cover at least LARGE_SHARE of a view in `folder`/val, and
    the precision of segments at least as large.
    """
    segmenter = load(weights)
    count = _Count()
    for town in towns(folder, "val"):
        for image, depth_m, label in zip(town.left, town.stereo_m, town.label, strict=True):
            segments = segmenter.segments(image, depth_m, town.calibration)
            count.add(segments, label)

    return {
        "recall": count.found / max(count.buildings, 1),
        "precision": count.correct / max(count.segments, 1),
    }


@dataclass
class _Count:
    """Of all views: the large buildings and how many of them were found, and the large segments and
    how many of them are right.
    """

    buildings: int = 0
    found: int = 0
    segments: int = 0
    correct: int = 0

    def add(self, segments: list[Segment], label: Bytes) -> None:
        """Add a view with that `label` (h, w), in which `segments` were found."""
        min_area_px = LARGE_SHARE * label.size
        area_px = np.bincount(label.ravel())[1:]
        large = np.flatnonzero(area_px >= min_area_px) + 1
        self.buildings += len(large)

        matched = set()
        for segment in segments:
            building, share = overlap(segment, label)
            is_match = share >= MIN_OVERLAP
            is_large = segment.area_px >= min_area_px
            self.segments += is_large
            self.correct += is_large and is_match
            if is_match:
                matched.add(building)

        self.found += len(matched & set(large.tolist()))
