"""Trains the network that divides a view into candidate objects (see services/epam/segments.py)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import torch
from rich.progress import Progress
from torch import Tensor, nn
from torch.nn import functional

from services.epam.recognition.segments import (
    CHANNELS,
    HEIGHT_PX,
    INPUT_SHAPE,
    OFFSET_PX,
    OUTPUT_SHAPES,
    PADDING_PX,
    WIDTH_PX,
    load,
    network_input,
    padded,
)
from training.crops import LEAST_OVERLAP, overlap
from training.prefetch import ahead
from training.renderings import Town, files, read, towns
from training.unet import unet

WIDTHS = (16, 48, 96, 160)
BATCH = 16
EPOCHS = 16
RATE = 3e-3
DECAY = 1e-4
LEAST_PX = 10
LARGE_SHARE = 0.01
_HALF = np.float16


class Divider(nn.Module):
    """float32 (n, CHANNELS, h, w) to (n, 4, h, w): a U-Net half as fine, each pixel of which tells
    of four.
    """

    def __init__(self) -> None:
        super().__init__()
        self.stem = nn.Conv2d(CHANNELS, WIDTHS[0], 3, stride=2, padding=1)
        self.body = unet(WIDTHS[0], 4 * 4, WIDTHS)
        self.finer = nn.PixelShuffle(2)

    def forward(self, values: Tensor) -> Tensor:
        """What it makes of `values`."""
        return self.finer(self.body(functional.relu(self.stem(values))))


@dataclass(frozen=True, eq=False)
class Examples:
    """What the network sees, float16 (n, CHANNELS, h, w), and the number of the building there,
    uint8 (n, h, w).
    """

    seen: npt.NDArray[np.float16]
    label: npt.NDArray[np.uint8]


def examples(towns: Iterable[Town]) -> Examples:
    """All views of `towns`, half as fine."""
    seen = []
    label = []
    for town in towns:
        for image, depth_m, labels in zip(town.left, town.stereo_m, town.label, strict=True):
            small = cv2.resize(image, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_AREA).astype(
                np.uint8, copy=False
            )
            depth = cv2.resize(depth_m, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_NEAREST)
            seen.append(
                network_input(small, np.asarray(depth, np.float32), town.calibration).astype(_HALF)
            )
            label.append(cv2.resize(labels, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_NEAREST))
    return Examples(np.asarray(seen), np.asarray(label, np.uint8))


def target(label: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
    """What should be said of labels (h, w): float32 (5, h, w): building, middles, offsets x and y,
    their weight.
    """
    wanted = np.zeros((5, *label.shape), np.float32)
    wanted[0] = label > 0
    rows, columns = np.nonzero(label)
    number = label[rows, columns]
    area = np.bincount(number, minlength=1)
    known = np.maximum(area, 1)
    row, column = (np.bincount(number, at, minlength=1) / known for at in (rows, columns))
    y, x = (np.arange(side, dtype=np.float32) for side in label.shape)
    for one in np.flatnonzero(area >= LEAST_PX):
        spread = np.clip(0.12 * np.sqrt(area[one]), 1.5, 5.0)
        across, down = (
            np.exp(-((axis - at[one]) ** 2) / (2 * spread**2))
            for axis, at in ((x, column), (y, row))
        )
        np.maximum(wanted[1], np.outer(down, across), out=wanted[1])
    counts = area[number] >= LEAST_PX
    wanted[2, rows, columns] = (column[number] - columns) / OFFSET_PX
    wanted[3, rows, columns] = (row[number] - rows) / OFFSET_PX
    weight = counts / np.sqrt(known[number])
    wanted[4, rows, columns] = weight * (len(rows) / max(float(weight.sum()), 1e-9))
    return wanted


def loss(said: Tensor, wanted: Tensor) -> Tensor:
    """How wrong the network's answer (n, 4, h, w) is; small buildings count for more than their
    pixels.
    """
    shown = functional.binary_cross_entropy_with_logits(said[:, 0], wanted[:, 0])
    middles = ((said[:, 1] - wanted[:, 1]).square() * (1 + 8 * wanted[:, 1])).mean()
    apart = (said[:, 2:4] - wanted[:, 2:4]).abs().sum(1) * wanted[:, 4]
    return shown + 20 * middles + 2 * apart.sum() / (wanted[:, 4].sum() + 1)


def varied(
    seen: npt.NDArray[np.float16], label: npt.NDArray[np.uint8], rng: np.random.Generator
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint8]]:
    """One example as it might have been: mirrored, in another light, with less depth."""
    values = seen.astype(np.float32)
    if rng.random() < 0.5:
        values[:7], label = values[:7, :, ::-1], label[:, ::-1]
    gain = np.exp(rng.normal(0, 0.08, (3, 1, 1)) + rng.normal(0, 0.12)).astype(np.float32)
    values[:3] = (values[:3] + 2) * gain - 2 + rng.normal(0, 0.05)
    if rng.random() < 0.3:
        lost = cv2.resize(rng.random((15, 20), np.float32), (WIDTH_PX, HEIGHT_PX)) < rng.uniform(
            0, 0.4
        )
        values[3:6, lost] = 0.0
    return values, label


def train_on_renderings(
    folder: Path, out: Path, *, seed: int, epochs: int = EPOCHS
) -> dict[str, float]:
    """Train on the towns in `folder`/train, write the network to `out`; its `figures`."""
    torch.manual_seed(seed)
    torch.use_deterministic_algorithms(True)
    torch.utils.deterministic.fill_uninitialized_memory = False
    torch.set_num_threads(1)
    with Progress() as progress:
        paths = files(folder, "train")
        known = examples(read(path) for path in progress.track(paths, description="reading"))
        net = Divider().to(memory_format=torch.channels_last)
        steps = max(1, epochs * len(known.label) // BATCH)
        best = torch.optim.AdamW(net.parameters(), weight_decay=DECAY)
        rate = torch.optim.lr_scheduler.OneCycleLR(best, RATE, total_steps=steps, pct_start=0.1)
        task = progress.add_task("training", total=steps)
        for seen, wanted in ahead(_batches(known, steps, np.random.default_rng(seed))):
            with torch.autocast("cpu", torch.bfloat16):
                said = net(seen)[:, :, PADDING_PX:-PADDING_PX]
            wrong = loss(said.float(), wanted)
            best.zero_grad()
            wrong.backward()
            best.step()
            rate.step()
            progress.update(task, advance=1, description=f"training, loss {wrong.item():.3f}")
    export(net, out)
    return figures(folder, out)


def figures(folder: Path, weights: Path) -> dict[str, float]:
    """How many of the buildings that cover LARGE_SHARE of a view in `folder`/val are found, and how
    many of the segments as large are a building.
    """
    segmenter = load(weights)
    there = found = large = right = 0
    for town in towns(folder, "val"):
        for image, depth_m, label in zip(town.left, town.stereo_m, town.label, strict=True):
            least_px = LARGE_SHARE * label.size
            segments = segmenter.segments(image, depth_m, town.calibration)
            matched = [(segment.area_px, *overlap(segment, label)) for segment in segments]
            hits = {building for _, building, share in matched if share >= LEAST_OVERLAP}
            wanted = np.flatnonzero(np.bincount(label.ravel())[1:] >= least_px) + 1
            there = there + len(wanted)
            found = found + len(hits & set(wanted.tolist()))
            large += sum(area >= least_px for area, _, _ in matched)
            right += sum(area >= least_px and share >= LEAST_OVERLAP for area, _, share in matched)
    return {"recall": found / max(there, 1), "precision": right / max(large, 1)}


def _batches(
    known: Examples, steps: int, rng: np.random.Generator
) -> Iterator[tuple[Tensor, Tensor]]:
    order = np.empty(0, np.intp)
    for _ in range(steps):
        if len(order) < BATCH:
            order = rng.permutation(len(known.label))
        chosen = order[:BATCH]
        order = order[BATCH:]
        pairs = [varied(known.seen[number], known.label[number], rng) for number in chosen]
        seen = torch.from_numpy(padded(np.stack([values for values, _ in pairs])))
        wanted = torch.from_numpy(np.stack([target(label) for _, label in pairs]))
        yield seen.contiguous(memory_format=torch.channels_last), wanted


def export(net: nn.Module, out: Path) -> None:
    """Write `net` as an ONNX file."""
    out.parent.mkdir(parents=True, exist_ok=True)
    net.eval()
    names = {"input_names": ["seen"], "output_names": list(OUTPUT_SHAPES)}
    torch.onnx.export(
        net, (torch.zeros(INPUT_SHAPE),), str(out), dynamo=False, opset_version=13, **names
    )
