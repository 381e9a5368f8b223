"""Trains the network that names and describes segments (see services/epam/objects.py), and calibrates it."""

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

from services.epam.objects import CHANNELS, DIMENSIONS, GIVES, SIDE_PX, TAKES
from services.epam.segments import load as load_segmenter
from services.epam.train import calibration
from services.epam.train.ahead import ahead
from services.epam.train.crops import Crops, crops
from services.epam.train.renderings import files, read

WIDTHS = (32, 64, 96, 128)
BATCH, EPOCHS = 64, 8
RATE, DECAY = 2e-3, 5e-4
SHARPNESS, MARGIN = 16.0, 0.15


class Describer(nn.Module):
    """float32 (n, CHANNELS, SIDE_PX, SIDE_PX) to embeddings (n, DIMENSIONS) of length 1."""

    def __init__(self) -> None:
        super().__init__()
        layers: list[nn.Module] = [_convolution(CHANNELS, WIDTHS[0], 2)]
        for fine, coarse in itertools.pairwise(WIDTHS):
            layers += [_convolution(fine, coarse, 2), _convolution(coarse, coarse, 1)]
        self.layers = nn.Sequential(*layers)
        self.head = nn.Linear(WIDTHS[-1] * (SIDE_PX // 2 ** len(WIDTHS)) ** 2, DIMENSIONS)

    def forward(self, values: Tensor) -> Tensor:
        """What it makes of `values`."""
        embedding = self.head(self.layers(values).flatten(1))
        return embedding / embedding.square().sum(1, keepdim=True).add(1e-6).sqrt()


def _convolution(channels_in: int, channels_out: int, stride: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(channels_in, channels_out, 3, stride=stride, padding=1, bias=False),
        nn.BatchNorm2d(channels_out),
        nn.ReLU(inplace=True),
    )


def varied(seen: npt.NDArray[np.float16], rng: np.random.Generator) -> npt.NDArray[np.float32]:
    """Crops (n, …) as they might have been: in another light, partly hidden, cut otherwise. Never mirrored."""
    values = seen.astype(np.float32)
    many = len(values)
    mask = values[:, 3:4]
    gain = np.exp(rng.normal(0, 0.06, (many, 3, 1, 1)) + rng.normal(0, 0.15, (many, 1, 1, 1))).astype(np.float32)
    offset = rng.normal(0, 0.06, (many, 1, 1, 1)).astype(np.float32)
    values[:, :3] = ((values[:, :3] + 2 * mask) * gain - 2 * mask) + offset * mask
    values[:, 4] += rng.normal(0, 0.04, (many, 1, 1)).astype(np.float32)
    for number in np.flatnonzero(rng.random(many) < 0.35):
        left, top = rng.integers(0, SIDE_PX, 2)
        wide, high = rng.integers(4, SIDE_PX // 2, 2)
        values[number, :4, top : top + high, left : left + wide] = 0.0
    shift = rng.integers(-3, 4, (many, 2))
    for row in range(many):
        values[row, :4] = np.roll(values[row, :4], shift[row], axis=(1, 2))
    return values


def train_on_renderings(folder: Path, out: Path, *, seed: int, epochs: int = EPOCHS) -> dict[str, float]:
    """Train on the segments of `folder`/train, calibrate on those of `folder`/val, write the network to `out` and what
    belongs to it beside; the figures on `folder`/val."""
    torch.manual_seed(seed)
    torch.use_deterministic_algorithms(True)
    torch.utils.deterministic.fill_uninitialized_memory = False
    torch.set_num_threads(1)
    with Progress() as progress:
        known, held = (
            crops(
                (read(path) for path in progress.track(files(folder, split), description=f"{split} segments")),
                load_segmenter(),
            )
            for split in ("train", "val")
        )
        net, directions, names = _fit(known, np.random.default_rng(seed), epochs, progress)
    export(net, out)
    taught = [number for number, name in enumerate(names) if not name.startswith("invented-")]
    sizes = sizes_m(folder, [names[number] for number in taught])
    unit = functional.normalize(directions).detach().numpy()[taught]
    found = calibration.calibrate(embeddings(net, held), held, [names[number] for number in taught], unit, sizes)
    out.with_suffix(".json").write_bytes(msgspec.json.format(msgspec.json.encode(found.names), indent=1) + b"\n")
    return found.figures


def _fit(
    known: Crops, rng: np.random.Generator, epochs: int, progress: Progress
) -> tuple[Describer, Tensor, list[str]]:
    names = sorted(set(known.name.tolist()))
    number = np.searchsorted(names, known.name)
    net = Describer().to(memory_format=torch.channels_last)
    directions = nn.Parameter(torch.randn(len(names), DIMENSIONS))
    steps = epochs * (len(number) // BATCH)
    weights = [*net.parameters(), directions]
    best = torch.optim.AdamW(weights, weight_decay=DECAY)
    rate = torch.optim.lr_scheduler.OneCycleLR(best, RATE, total_steps=steps, pct_start=0.1)
    task = progress.add_task("training", total=steps)
    for seen, wanted in ahead(_batches(known, number, steps, rng)):
        cosines = net(seen) @ functional.normalize(directions).T
        cosines = cosines - MARGIN * functional.one_hot(wanted, len(names))
        wrong = functional.cross_entropy(SHARPNESS * cosines, wanted)
        best.zero_grad()
        wrong.backward()
        best.step()
        rate.step()
        progress.update(task, advance=1, description=f"training, loss {wrong.item():.3f}")
    return net.eval(), directions, names


def _batches(
    known: Crops, number: npt.NDArray[np.intp], steps: int, rng: np.random.Generator
) -> Iterator[tuple[Tensor, Tensor]]:
    order = np.empty(0, np.intp)
    for _ in range(steps):
        if len(order) < BATCH:
            order = rng.permutation(len(number))
        chosen, order = order[:BATCH], order[BATCH:]
        seen = torch.from_numpy(varied(known.seen[chosen], rng))
        yield seen.contiguous(memory_format=torch.channels_last), torch.from_numpy(number[chosen])


def embeddings(net: Describer, of: Crops) -> npt.NDArray[np.float32]:
    """The embedding of each crop, float32 (n, DIMENSIONS)."""
    with torch.no_grad():
        some = np.array_split(of.seen, len(of.seen) // 256 + 1)
        parts = [net(torch.from_numpy(part.astype(np.float32))) for part in some]
    return np.asarray(torch.cat(parts).numpy(), np.float32)


def sizes_m(folder: Path, names: list[str]) -> dict[str, tuple[float, float, float]]:
    """The longer and the shorter side of each building's ground plan, and its height, as the towns show them."""
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
    names = {"input_names": ["seen"], "output_names": list(GIVES)}
    torch.onnx.export(net, (torch.zeros(TAKES),), str(out), dynamo=False, opset_version=13, **names)
