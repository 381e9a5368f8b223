"""Trains the networks for photographs on street photographs with label images, together with
renderings of towns where there are any.

The encoder stays as it is, so the features of every example are computed once, and only the decoder
is trained. What photographs show is labelled road or building, but not which building: an area of
building that hangs together is one there. Which building a pixel belongs to, and what depth tells
of that, is learned from renderings; in half of these, depth is dropped.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import torch
from rich.progress import Progress
from torch import Tensor
from torch.nn import functional

from cogmap.geometry.arrays import Booleans, Bytes, Singles
from cogmap.services.epam.layout import road
from cogmap.services.epam.network import Network
from cogmap.services.epam.recognition import segments
from cogmap.training.augment import Augmentation, LabelledImage, augmented, relit
from cogmap.training.networks.encoder import FEATURES, Encoder, pretrained
from cogmap.training.networks.export import export, halve
from cogmap.training.networks.loader import shuffled
from cogmap.training.networks.optimizer import Optimizer, seed_torch
from cogmap.training.networks.photograph import (
    COARSE,
    DEPTHS,
    FINEST,
    BuildingNet,
    Decoder,
    RoadNet,
)
from cogmap.training.photographs import Photograph
from cogmap.training.rendering.reader import Town
from cogmap.training.road import ROAD
from cogmap.training.segments import instance_loss, target

# Columns and rows of the images, as EPAM scales a view of 320 by 240, and of the labels: half of
# these, as of the network's outputs.
SIZE_PX = (320, 256)
LABEL_SIZE_PX = (160, 128)
STRONG = Augmentation(
    zoom=(0.8, 2.0),
    shift=0.2,
    turn_deg=6.0,
    contrast=0.6,
    gamma=0.8,
    cast=0.25,
    brightness=25.0,
    noise=8.0,
    shadow_share=0.3,
    blur_share=0.4,
    slope=0.12,
    saturation=0.8,
    backlit_share=0.5,
    stretch=0.4,
    grey_share=0.15,
)
# Few photographs: each is seen in so many variations that there are about EXAMPLES, four of each of
# CamVid's training photographs, and each variation so often.
EXAMPLES = 1500
EPOCHS = 2
BATCH = 16
MAX_RATE = 4e-3
WEIGHT_DECAY = 0.02
WARM_UP = 0.15
# Of each batch, so many examples are for what parts buildings.
PARTED = 4
DEPTH_DROPPED_SHARE = 0.5
# Gaps in an area of building, behind lamps and signs, that do not part it.
CLOSING = np.ones((5, 5), np.uint8)

Halves = npt.NDArray[np.float16]


@dataclass(frozen=True, eq=False)
class Examples:
    """Features of the images, one array for each stride, and their depth (n, 3, h / 4, w / 4), 0
    where it is unknown; and uint8 (n, h / 2, w / 2) each: the share of a pixel that shows road, the
    share that is known, of 255, and the number of its building, 0 for none. `drive` (n,) has the
    names of the drives, empty for renderings.
    """

    features: list[Halves]
    depth: Halves
    road: Bytes
    known: Bytes
    label: Bytes
    drive: npt.NDArray[np.str_]

    def chosen(self, is_chosen: Booleans) -> Examples:
        """Return the examples for which that is true."""
        return Examples(
            features=[values[is_chosen] for values in self.features],
            depth=self.depth[is_chosen],
            road=self.road[is_chosen],
            known=self.known[is_chosen],
            label=self.label[is_chosen],
            drive=self.drive[is_chosen],
        )


@dataclass(frozen=True, eq=False)
class _Example:
    """One of Examples, with its image (h, w, 3) instead of features."""

    image: Bytes
    depth: Singles
    road: Bytes
    known: Bytes
    label: Bytes
    drive: str


def train_on(
    shown: Iterable[Photograph],
    towns: Iterable[Town],
    road_out: Path,
    segments_out: Path,
    *,
    seed: int,
    epochs: int | None = None,
    variations: int | None = None,
) -> None:
    """Train on `variations` of each photograph, and on the views of `towns`, and write the network
    that finds the road and that which separates buildings to these files.

    Raises UsageError if the encoder's weights are not installed, or the photographs cannot be read.
    """
    seed_torch(seed)
    encoder = pretrained()
    known = examples(encoder, list(shown), towns, seed=seed, variations=variations)
    write(encoder, fit(known, seed=seed, epochs=epochs), road_out, segments_out)


def examples(
    encoder: Encoder,
    shown: Sequence[Photograph],
    towns: Iterable[Town],
    *,
    seed: int,
    variations: int | None = None,
) -> Examples:
    """Return `variations` of each photograph, and each view of `towns`, in other light."""
    rng = np.random.default_rng([seed, 0x0F07])
    count = variations or max(1, round(EXAMPLES / len(shown)))
    with tempfile.TemporaryDirectory() as folder, Progress() as progress:
        network = _runnable(encoder, Path(folder) / "encoder.onnx")
        rows = []
        features: list[list[Halves]] = [[] for _ in FEATURES]

        task = progress.add_task("encoding photographs", total=count * len(shown))
        for example in _varied(shown, count, rng):
            rows.append(example)
            _add(features, network, example.image)
            progress.update(task, advance=1)

        for town in towns:
            for example in progress.track(
                _views(town, rng), total=len(town.left), description="encoding a town"
            ):
                rows.append(example)
                _add(features, network, example.image)

    return Examples(
        features=[np.asarray(values) for values in features],
        depth=np.asarray([row.depth for row in rows], np.float16),
        road=np.asarray([row.road for row in rows]),
        known=np.asarray([row.known for row in rows]),
        label=np.asarray([row.label for row in rows]),
        drive=np.asarray([row.drive for row in rows]),
    )


def fit(known: Examples, *, seed: int, epochs: int | None = None) -> Decoder:
    """Return a decoder trained on these examples."""
    seed_torch(seed)
    rng = np.random.default_rng([seed, 0xDEC0])
    decoder = Decoder().to(memory_format=torch.channels_last)
    steps = max(1, (epochs or EPOCHS) * len(known.drive) // BATCH)
    batch = min(BATCH, len(known.drive))
    optimizer = Optimizer(decoder.parameters(), steps, MAX_RATE, WEIGHT_DECAY, WARM_UP)
    positions = torch.from_numpy(_positions())

    decoder.train()
    with Progress() as progress:
        task = progress.add_task("training", total=steps)
        for chosen in shuffled(len(known.drive), batch, steps, rng):
            features = [_tensor(of[chosen]) for of in known.features]
            depth = _tensor(known.depth[chosen[:PARTED]])
            found = decoder(features, positions.expand(batch, -1, -1, -1), depth)
            value = optimizer.step(_loss(found, known, chosen))
            progress.update(task, advance=1, description=f"training, loss {value:.3f}")

    return decoder.eval()


def write(encoder: Encoder, decoder: Decoder, road_out: Path, segments_out: Path) -> None:
    """Write both networks, as EPAM reads them, for views of any size."""
    columns, rows = SIZE_PX
    road_shape = (1, road.CHANNELS, rows, columns)
    segments_shape = (1, segments.CHANNELS, rows, columns)
    export(
        RoadNet(encoder, decoder),
        road_out,
        "image",
        road_shape,
        road.OUTPUT_SHAPES,
        any_size=True,
    )
    export(
        BuildingNet(encoder, decoder),
        segments_out,
        "seen",
        segments_shape,
        segments.OUTPUT_SHAPES,
        any_size=True,
    )
    halve(road_out)
    halve(segments_out)


def _runnable(encoder: Encoder, path: Path) -> Network:
    """Return the encoder as a network, for images of SIZE_PX, one a pass."""
    columns, rows = SIZE_PX
    shape = (1, 3, rows, columns)
    names = [f"features{number}" for number in range(len(FEATURES))]
    export(encoder, path, "colours", shape, names)
    return Network(path, shape, dict.fromkeys(names, (1, None, None, None)))


def _add(features: list[list[Halves]], network: Network, image: Bytes) -> None:
    """Add the features of an image (h, w, 3)."""
    values = road.network_input(image[None], padding_px=0)
    colours = np.ascontiguousarray(values[:, :3])
    for known, (of_image,) in zip(features, network(colours), strict=True):
        known.append(of_image.astype(np.float16))


def _varied(
    shown: Sequence[Photograph], variations: int, rng: np.random.Generator
) -> Iterator[_Example]:
    """Yield each photograph so often, each time from another viewpoint and in other light."""
    for photograph in shown:
        drive, _, _ = photograph.name.partition("_")
        labelled = LabelledImage.of(
            photograph.image, photograph.road, photograph.building, photograph.known, SIZE_PX
        )
        for _ in range(variations):
            varied = augmented(labelled, STRONG, rng, SIZE_PX)
            building = _small(varied.building) > 127
            yield _Example(
                image=varied.image,
                depth=np.zeros(_depth_shape(), np.float32),
                road=_small(varied.road),
                known=_small(varied.known),
                label=_areas(building),
                drive=drive,
            )


def _views(town: Town, rng: np.random.Generator) -> Iterator[_Example]:
    """Yield the views of a town in other light, half of them mirrored, half of them without
    depth.
    """
    for image, depth_m, surface, label in zip(
        town.left, town.stereo_m, town.surface, town.label, strict=True
    ):
        scaled = cv2.resize(image, SIZE_PX, interpolation=cv2.INTER_AREA)
        scaled_m = cv2.resize(depth_m, SIZE_PX, interpolation=cv2.INTER_NEAREST)
        seen = segments.network_input(
            scaled.astype(np.uint8), scaled_m.astype(np.float32), town.calibration
        )
        depth = _pooled(seen[3:6])
        is_road = 255 * (surface == ROAD).astype(np.uint8)
        small_label = cv2.resize(label, LABEL_SIZE_PX, interpolation=cv2.INTER_NEAREST)
        mirrored = slice(None, None, -1 if rng.random() < 0.5 else 1)
        if rng.random() < DEPTH_DROPPED_SHARE:
            depth = np.zeros_like(depth)

        yield _Example(
            image=relit(scaled[:, mirrored].astype(np.float32), STRONG, rng),
            depth=depth[:, :, mirrored],
            road=_small(is_road)[:, mirrored],
            known=np.full(LABEL_SIZE_PX[::-1], 255, np.uint8),
            label=small_label.astype(np.uint8)[:, mirrored],
            drive="",
        )


def _areas(building: Booleans) -> Bytes:
    """Number the areas of building (h, w) that hang together, 0 for none."""
    closed = cv2.morphologyEx(building.astype(np.uint8), cv2.MORPH_CLOSE, CLOSING)
    _, numbers = cv2.connectedComponents(closed)
    return np.asarray(np.minimum(numbers, 255) * building, np.uint8)


def _tensor(values: Halves) -> Tensor:
    single = torch.from_numpy(values.astype(np.float32))
    return single.contiguous(memory_format=torch.channels_last)


def _loss(
    found: tuple[Tensor, Tensor, Tensor], known: Examples, chosen: npt.NDArray[np.intp]
) -> Tensor:
    """Return the loss of the network's outputs for the examples `chosen`."""
    road_odds, building_odds, shown = found
    is_known = torch.from_numpy(known.known[chosen].astype(np.float32)) / 255
    is_road = torch.from_numpy(known.road[chosen].astype(np.float32)) / 255
    is_building = torch.from_numpy((known.label[chosen] > 0).astype(np.float32))
    parted = [target(known.label[number]) for number in chosen[:PARTED]]

    of_road = _surprise(road_odds[:, 0], is_road, is_known)
    of_building = _surprise(building_odds[:, 0], is_building, is_known)
    of_parts = instance_loss(shown, torch.from_numpy(np.stack(parted)))
    return of_road + of_building + of_parts


def _surprise(log_odds: Tensor, wanted: Tensor, known: Tensor) -> Tensor:
    """Return the mean cross entropy over the pixels that are known, (n, h, w) each."""
    of_pixels = functional.binary_cross_entropy_with_logits(log_odds, wanted, reduction="none")
    return (of_pixels * known).sum() / known.sum().clamp(min=1)


def _positions() -> Singles:
    """Return column and row of each coarse pixel, from -1 to 1, (1, 2, h / 32, w / 32)."""
    columns, rows = SIZE_PX
    plain = np.zeros((1, rows, columns, 3), np.uint8)
    positions = road.network_input(plain, padding_px=0)[0, 3:5]
    return _pooled(positions, COARSE)[None]


def _pooled(values: Singles, stride: int = FINEST) -> Singles:
    """Return the means of `values` (c, h, w) over squares of that many pixels a side."""
    count, height, width = values.shape
    squares = values.reshape(count, height // stride, stride, width // stride, stride)
    return np.asarray(squares.mean((2, 4)), np.float32)


def _small(mask: Bytes) -> Bytes:
    small = cv2.resize(mask, LABEL_SIZE_PX, interpolation=cv2.INTER_AREA)
    return small.astype(np.uint8, copy=False)


def _depth_shape() -> tuple[int, int, int]:
    columns, rows = SIZE_PX
    return DEPTHS, rows // FINEST, columns // FINEST
