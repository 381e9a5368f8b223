"""Trains the network that names and describes segments (see services/epam/objects.py), and
calibrates it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path

import msgspec
import numpy as np
import numpy.typing as npt
import torch
from rich.progress import Progress
from torch import Tensor, nn
from torch.nn import functional

from services.epam.recognition.crop import CHANNELS, SIDE_PX
from services.epam.recognition.objects import DIMENSIONS, INPUT_SHAPE, OUTPUT_SHAPES, Prototypes
from services.epam.recognition.segments import load as load_segmenter
from training import calibration
from training.crops import Crops, crops
from training.prefetch import ahead
from training.renderings import files, read
from training.unet import convolution

WIDTHS = (32, 64, 128, 160)
BATCH = 64
EPOCHS = 22
RATE = 2e-3
DECAY = 5e-4
SHARPNESS = 16.0
MARGIN = 0.15
SHORT = 0.03


class Describer(nn.Module):
    """float32 (n, CHANNELS, SIDE_PX, SIDE_PX) to embeddings (n, DIMENSIONS) of length 1, and log
    odds (n, 2).

    What it finds at each scale counts by how much of it there is and how clear it is, not by where:
    so it holds from other sides as well.
    """

    def __init__(self) -> None:
        super().__init__()
        self.stem = convolution(CHANNELS, WIDTHS[0], 2)
        self.scales = nn.ModuleList(
            nn.Sequential(convolution(fine, coarse, 2), convolution(coarse, coarse, 1))
            for fine, coarse in itertools.pairwise(WIDTHS)
        )
        many = 2 * sum(WIDTHS[1:])
        self.head, self.odds = nn.Linear(many, DIMENSIONS), nn.Linear(many, 2)

    def forward(self, values: Tensor) -> tuple[Tensor, Tensor]:
        """What it makes of `values`."""
        values = self.stem(values)
        found = []
        for scale in self.scales:
            values = scale(values)
            found += [values.mean((2, 3)), values.amax((2, 3))]
        features = torch.cat(found, 1)
        embedding = self.head(features)
        return embedding / embedding.square().sum(1, keepdim=True).add(1e-6).sqrt(), self.odds(
            features
        )


def varied(seen: npt.NDArray[np.float16], rng: np.random.Generator) -> npt.NDArray[np.float32]:
    """Crops (n, …) as they might have been: in another light, partly hidden, cut otherwise. Never
    mirrored.
    """
    values = seen.astype(np.float32)
    many = len(values)
    mask = values[:, 3:4].copy()
    gain = np.exp(
        rng.normal(0, 0.06, (many, 3, 1, 1)) + rng.normal(0, 0.15, (many, 1, 1, 1))
    ).astype(np.float32)
    offset = rng.normal(0, 0.06, (many, 1, 1, 1)).astype(np.float32)
    values[:, :3] = ((values[:, :3] + 2 * mask) * gain - 2 * mask) + offset * mask
    around = values[:, 6:].reshape(many, 2, 3, *values.shape[2:])
    seen_around = np.abs(around).max(axis=2, keepdims=True) > 0
    around[:] = np.where(seen_around, (around + 2) * gain[:, None] - 2 + offset[:, None], 0)
    values[:, 5] += rng.normal(0, 0.04, (many, 1, 1)).astype(np.float32)
    for number in np.flatnonzero(rng.random(many) < 0.35):
        left, top = rng.integers(0, SIDE_PX, 2)
        wide, high = rng.integers(4, SIDE_PX // 2, 2)
        values[number, :4, top : top + high, left : left + wide] = 0.0
    shift = rng.integers(-3, 4, (many, 2))
    for row in range(many):
        values[row, :5] = np.roll(values[row, :5], shift[row], axis=(1, 2))
    return values


def train_on_renderings(
    folder: Path, out: Path, *, seed: int, epochs: int = EPOCHS
) -> dict[str, float]:
    """Train on the segments of `folder`/train and `folder`/strangers, calibrate on those of
    `folder`/val, write the network to `out` and what belongs to it beside; the figures on
    `folder`/val.
    """
    torch.manual_seed(seed)
    torch.use_deterministic_algorithms(True)
    torch.utils.deterministic.fill_uninitialized_memory = False
    torch.set_num_threads(1)
    with Progress() as progress:
        known, held = (
            crops(
                (read(path) for path in progress.track(paths, description="segments")),
                load_segmenter(),
            )
            for paths in (files(folder, "train") + files(folder, "strangers"), files(folder, "val"))
        )
        net, directions, names = _fit(known, np.random.default_rng(seed), epochs, progress)
    export(net, out)
    found = calibration.calibrate(*looks(net, held), held, _taught(folder, names, directions))
    out.with_suffix(".json").write_bytes(
        msgspec.json.format(msgspec.json.encode(found.names), indent=1) + b"\n"
    )
    return found.figures


def _taught(folder: Path, names: list[str], directions: Tensor) -> Prototypes:
    """Those of `names` that belong to the catalogue, before calibration."""
    rows = [number for number, name in enumerate(names) if not name.startswith("invented-")]
    taught = [names[row] for row in rows]
    sizes = sizes_m(folder, names)
    unit = functional.normalize(directions).detach().numpy()[rows]
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


def _fit(
    known: Crops, rng: np.random.Generator, epochs: int, progress: Progress
) -> tuple[Describer, Tensor, list[str]]:
    names = sorted(set(known.name.tolist()) - {""})
    number = np.where(known.name == "", -1, np.searchsorted(names, known.name))
    net = Describer().to(memory_format=torch.channels_last)
    # Short ones turn fast at first: each of thousands of kinds is seldom seen.
    directions = nn.Parameter(SHORT * torch.randn(len(names), DIMENSIONS))
    steps = max(1, epochs * len(number) // BATCH)
    weights = [*net.parameters(), directions]
    best = torch.optim.AdamW(weights, weight_decay=DECAY)
    rate = torch.optim.lr_scheduler.OneCycleLR(best, RATE, total_steps=steps, pct_start=0.1)
    task = progress.add_task("training", total=steps)
    for seen, wanted, whole in ahead(_batches(known, number, steps, rng)):
        with torch.autocast("cpu", torch.bfloat16):
            embedding, odds = net(seen)
        wrong = loss(
            embedding.float(), odds.float(), functional.normalize(directions), wanted, whole
        )
        best.zero_grad()
        wrong.backward()
        best.step()
        rate.step()
        progress.update(task, advance=1, description=f"training, loss {wrong.item():.3f}")
    return net.eval(), directions, names


def loss(
    embedding: Tensor, odds: Tensor, directions: Tensor, wanted: Tensor, whole: Tensor
) -> Tensor:
    """How wrong embeddings (n, d) and log odds (n, 2) are, by the number in `directions` (k, d) of
    what each shows, -1 for no building, and whether it is whole.
    """
    shows = wanted >= 0
    cosines = embedding[shows] @ directions.T
    cosines = cosines - MARGIN * functional.one_hot(wanted[shows], len(directions))
    named = functional.cross_entropy(SHARPNESS * cosines, wanted[shows])
    return named + functional.binary_cross_entropy_with_logits(
        odds, torch.stack([shows, whole], 1).float()
    )


def _batches(
    known: Crops, number: npt.NDArray[np.intp], steps: int, rng: np.random.Generator
) -> Iterator[tuple[Tensor, Tensor, Tensor]]:
    order = np.empty(0, np.intp)
    for _ in range(steps):
        if len(order) < BATCH:
            order = rng.permutation(len(number))
        chosen = order[:BATCH]
        order = order[BATCH:]
        seen = torch.from_numpy(varied(known.seen[chosen], rng))
        shown = torch.from_numpy(number[chosen]), torch.from_numpy(known.whole[chosen])
        yield seen.contiguous(memory_format=torch.channels_last), *shown


def looks(net: Describer, of: Crops) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """The embedding of each crop, float32 (n, DIMENSIONS), and its log odds (n, 2)."""
    with torch.no_grad():
        some = np.array_split(of.seen, len(of.seen) // 256 + 1)
        parts = [net(torch.from_numpy(part.astype(np.float32))) for part in some]
    embedding, odds = (
        torch.cat(column).numpy().astype(np.float32) for column in zip(*parts, strict=True)
    )
    return embedding, odds


def sizes_m(folder: Path, names: list[str]) -> dict[str, tuple[float, float, float]]:
    """The longer and the shorter side of each building's ground plan, and its height, as the towns
    show them.
    """
    found: dict[str, tuple[float, float, float]] = {}
    for path in files(folder, "train"):
        town = read(path)
        for name, (width, depth, height) in zip(town.names, town.size_m.tolist(), strict=True):
            if name in names:
                found[name] = max(width, depth), min(width, depth), height
    return found


def export(net: nn.Module, out: Path) -> None:
    """Write `net` as an ONNX file."""
    out.parent.mkdir(parents=True, exist_ok=True)
    net.eval()
    names = {"input_names": ["seen"], "output_names": list(OUTPUT_SHAPES)}
    torch.onnx.export(
        net, (torch.zeros(INPUT_SHAPE),), str(out), dynamo=False, opset_version=13, **names
    )
