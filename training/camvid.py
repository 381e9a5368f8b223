"""Trains the networks for photographs on street photographs with label images, together with
renderings of towns where there are any.

The encoder, which others have trained on photographs of all kinds, is trained further, at a lower
rate than the decoder. What photographs show is labelled, but not which building a pixel belongs to:
an area of building that hangs together is one there. That, and what depth tells of it, is learned
from renderings; in half of these, depth is dropped.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import torch
from rich.progress import Progress
from torch import Tensor
from torch.nn import functional

from cogmap.geometry.arrays import Booleans, Bytes, Singles
from cogmap.services.epam.layout import road
from cogmap.services.epam.recognition import look, segments
from cogmap.training.augment import Augmentation, augmented_classes, relit
from cogmap.training.networks.encoder import OFFSET, SCALE, Encoder, pretrained
from cogmap.training.networks.export import export, halve
from cogmap.training.networks.loader import prefetch_numbered
from cogmap.training.networks.optimizer import Optimizer, seed_torch, training_device
from cogmap.training.networks.photograph import (
    COARSE,
    DEPTHS,
    FINEST,
    BuildingNet,
    Decoder,
    RoadNet,
    log_odds,
)
from cogmap.training.photographs import BUILDING, ROAD, UNLABELLED, Photograph
from cogmap.training.rendering.reader import Town
from cogmap.training.road import CLASS
from cogmap.training.segments import instance_loss, target

# Columns and rows of the images, as EPAM scales a view of 320 by 240, and of the labels: half of
# these, as of the network's outputs.
SIZE_PX = (320, 256)
LABEL_SIZE_PX = (160, 128)
# This and what follows, down to REFLECTION, was chosen by the mean IoU over three drives of CamVid,
# each of which was left out once. With colours varied twice as much, that of buildings is 0.03
# less.
VARIED = Augmentation(
    zoom=(0.8, 2.0),
    shift=0.2,
    turn_deg=4.0,
    contrast=0.3,
    gamma=0.4,
    cast=0.1,
    brightness=25.0,
    noise=5.0,
    shadow_share=0.3,
    blur_share=0.4,
    slope=0.06,
    saturation=0.5,
    backlit_share=0.5,
    stretch=0.25,
    grey_share=0.05,
)
# So many variations of photographs are seen in all, each of them once.
EXAMPLES = 10_000
BATCH = 16
ENCODER_RATE = 5e-4
DECODER_RATE = 3e-3
WEIGHT_DECAY = 0.02
WARM_UP = 0.15
# Weights of the terms of the loss for road and buildings, beside that for all classes. Without that
# for the overlap, the IoU of buildings is 0.02 less.
OF_ODDS = 0.5
OF_OVERLAP = 1.0
# Of so many images the buildings have glass fronts: in them a share of at most REFLECTION is what
# another photograph shows. Without these, the IoU of buildings is 0.03 less.
GLASS_SHARE = 0.4
REFLECTION = 0.8
# Of each batch, so many examples are for what parts buildings, and so many are renderings.
PARTED = 4
RENDERED = 2
DEPTH_DROPPED_SHARE = 0.5
# Gaps in an area of building, behind lamps and signs, that do not part it.
CLOSING = np.ones((5, 5), np.uint8)


@dataclass(frozen=True, eq=False)
class Example:
    """An image (h, w, 3), its depth (3, h / 4, w / 4), 0 where it is unknown; and uint8 (h / 2, w /
    2) each: the class of a pixel, as of photographs, and the number of its building, 0 for none.
    """

    image: Bytes
    depth: Singles
    classes: Bytes
    number: Bytes


class _Examples:
    """Variations of photographs and of renderings, in batches that follow from their number."""

    def __init__(
        self, shown: Sequence[Photograph], views: Sequence[Example], seed: int, batch: int
    ) -> None:
        self._views = views
        self._seed = seed
        self._rendered = min(RENDERED, batch - 1) if views else 0
        self._each = batch - self._rendered
        self._images = []
        self._labels = []
        for photograph in shown:
            image = cv2.resize(photograph.image, SIZE_PX, interpolation=cv2.INTER_AREA)
            label = cv2.resize(photograph.label, SIZE_PX, interpolation=cv2.INTER_NEAREST)
            self._images.append(image.astype(np.uint8, copy=False))
            self._labels.append(label.astype(np.uint8, copy=False))

    @property
    def photographs_a_batch(self) -> int:
        """Return how many examples of a batch are variations of photographs."""
        return self._each

    def batch(self, number: int) -> tuple[Bytes, Bytes, Singles, Singles]:
        """Return the images (n, 3, h, w) of the batch of that number, their classes (n, h / 2, w /
        2), and depth and target of the first ones, for what parts buildings.
        """
        rng = np.random.default_rng([self._seed, 0xBA7C, number])
        chosen_views = rng.integers(0, max(1, len(self._views)), self._rendered)
        rendered = [_varied_view(self._views[each], rng) for each in chosen_views]
        photographed = [self._varied(each, rng) for each in self._chosen(number)]
        examples = [*rendered, *_glazed(photographed, rng)]

        parted = examples[:PARTED]
        return (
            np.stack([each.image.transpose(2, 0, 1) for each in examples]),
            np.stack([each.classes for each in examples]),
            np.stack([each.depth for each in parted]),
            np.stack([target(each.number) for each in parted]),
        )

    def _chosen(self, number: int) -> list[int]:
        """Return the photographs of that batch: all of them in any order, then all again."""
        count = len(self._images)
        first = number * self._each
        chosen = []
        for place in range(first, first + self._each):
            turn, within = divmod(place, count)
            order = np.random.default_rng([self._seed, 0x0F07, turn]).permutation(count)
            chosen.append(int(order[within]))

        return chosen

    def _varied(self, number: int, rng: np.random.Generator) -> Example:
        """Return a photograph from another viewpoint and in other light."""
        image, label = self._images[number], self._labels[number]
        varied, classes = augmented_classes(image, label, UNLABELLED, VARIED, rng)
        small = np.ascontiguousarray(classes[::2, ::2])
        return Example(
            image=varied,
            depth=np.zeros(_depth_shape(), np.float32),
            classes=small,
            number=_areas(small == BUILDING),
        )


def train_on(
    shown: Iterable[Photograph],
    towns: Iterable[Town],
    road_out: Path,
    segments_out: Path,
    *,
    seed: int,
    epochs: int | None = None,
) -> None:
    """Train on each photograph so often, and on the views of `towns`, and write the network that
    finds the road and that which separates buildings to these files.

    Raises UsageError if the encoder's weights are not installed, or the photographs cannot be read.
    """
    encoder, decoder = fit(list(shown), list(views(towns)), seed=seed, epochs=epochs)
    write(encoder, decoder, road_out, segments_out)


def fit(
    shown: Sequence[Photograph],
    rendered: Sequence[Example],
    *,
    seed: int,
    epochs: int | None = None,
) -> tuple[Encoder, Decoder]:
    """Return an encoder and a decoder that are trained on these examples."""
    seed_torch(seed)
    device = training_device()
    encoder = pretrained().to(device, memory_format=torch.channels_last)
    decoder = Decoder().to(device, memory_format=torch.channels_last)

    count = epochs * len(shown) if epochs else EXAMPLES
    examples = _Examples(shown, rendered, seed, min(BATCH, max(2, count)))
    steps = max(1, count // examples.photographs_a_batch)
    groups = [{"params": decoder.parameters()}, {"params": encoder.parameters()}]
    rates = [DECODER_RATE, ENCODER_RATE]
    optimizer = Optimizer(groups, steps, rates, WEIGHT_DECAY, WARM_UP)
    positions = torch.from_numpy(_positions()).to(device)

    # The encoder's statistics stay those of many more photographs.
    encoder.eval()
    decoder.train()
    with Progress() as progress:
        task = progress.add_task("training", total=steps)
        for batch in prefetch_numbered(examples.batch, steps):
            images, classes, depth, parted = (values.to(device) for values in batch)
            colours = (images / 255 / SCALE - OFFSET).contiguous(memory_format=torch.channels_last)
            with torch.autocast(device.type, torch.bfloat16, enabled=device.type == "cuda"):
                placed = positions.expand(len(images), -1, -1, -1)
                found, shown_parts = decoder(encoder(colours), placed, depth)

            of_classes = _loss(found.float(), classes.long())
            value = optimizer.step(of_classes + instance_loss(shown_parts.float(), parted))
            progress.update(task, advance=1, description=f"training, loss {value:.3f}")

    return encoder.cpu().eval(), decoder.cpu().eval()


def write(encoder: Encoder, decoder: Decoder, road_out: Path, segments_out: Path) -> None:
    """Write both networks, as EPAM reads them, for views of any size."""
    columns, rows = SIZE_PX
    road_shape = (1, road.CHANNELS, rows, columns)
    segments_shape = (1, look.CHANNELS, rows, columns)
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


def views(towns: Iterable[Town]) -> Iterator[Example]:
    """Yield the views of all towns."""
    for town in towns:
        for image, depth_m, surface, label in zip(
            town.left, town.stereo_m, town.surface, town.label, strict=True
        ):
            scaled = cv2.resize(image, SIZE_PX, interpolation=cv2.INTER_AREA)
            scaled_m = cv2.resize(depth_m, SIZE_PX, interpolation=cv2.INTER_NEAREST)
            seen = look.network_input(
                scaled.astype(np.uint8),
                scaled_m.astype(np.float32),
                town.calibration,
                look.Window.whole(town.calibration),
            )
            yield Example(
                image=scaled.astype(np.uint8),
                depth=_pooled(seen[3:6]),
                classes=_small(CLASS[surface]),
                number=_small(label),
            )


def _varied_view(view: Example, rng: np.random.Generator) -> Example:
    """Return a rendering in other light, perhaps mirrored, perhaps without depth."""
    mirrored = slice(None, None, -1 if rng.random() < 0.5 else 1)
    depth = view.depth[:, :, mirrored]
    if rng.random() < DEPTH_DROPPED_SHARE:
        depth = np.zeros_like(depth)

    return Example(
        image=relit(view.image[:, mirrored].astype(np.float32), VARIED, rng),
        depth=depth,
        classes=view.classes[:, mirrored],
        number=view.number[:, mirrored],
    )


def _glazed(examples: Sequence[Example], rng: np.random.Generator) -> list[Example]:
    """Give the buildings of some examples glass fronts: they reflect the example before."""
    glazed = []
    for number, example in enumerate(examples):
        image = example.image
        if rng.random() < GLASS_SHARE:
            reflected = examples[number - 1].image[:, ::-1]
            building = (example.classes == BUILDING).astype(np.float32)
            share = cv2.resize(building, SIZE_PX)[..., None] * rng.uniform(0, REFLECTION)
            image = np.asarray(image + share * (reflected.astype(np.float32) - image), np.uint8)
        glazed.append(replace(example, image=image))

    return glazed


def _areas(building: Booleans) -> Bytes:
    """Number the areas of building (h, w) that hang together, 0 for none."""
    closed = cv2.morphologyEx(building.astype(np.uint8), cv2.MORPH_CLOSE, CLOSING)
    _, numbers = cv2.connectedComponents(closed)
    return np.asarray(np.minimum(numbers, 255) * building, np.uint8)


def _loss(found: Tensor, classes: Tensor) -> Tensor:
    """Return the loss of the unnormalized log probabilities (n, UNLABELLED, h, w) for the classes
    (n, h, w).
    """
    known = (classes != UNLABELLED).float()
    labelled = classes.clamp(max=UNLABELLED)
    surprise = functional.cross_entropy(
        found, labelled, ignore_index=UNLABELLED, reduction="sum"
    ) / (labelled != UNLABELLED).sum().clamp(min=1)

    lost = surprise
    for number in (ROAD, BUILDING):
        odds = log_odds(found, number)[:, 0]
        wanted = (classes == number).float()
        of_pixels = functional.binary_cross_entropy_with_logits(odds, wanted, reduction="none")
        lost = lost + OF_ODDS * (of_pixels * known).sum() / known.sum().clamp(min=1)
        lost = lost + OF_OVERLAP * _missed(odds.sigmoid() * known, wanted * known)

    return lost


def _missed(found: Tensor, wanted: Tensor) -> Tensor:
    """Return 1 less the overlap of what was found with what was wanted (Dice), over a batch."""
    return 1 - (2 * (found * wanted).sum() + 1) / (found.sum() + wanted.sum() + 1)


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


def _small(label: Bytes) -> Bytes:
    small = cv2.resize(label, LABEL_SIZE_PX, interpolation=cv2.INTER_NEAREST)
    return small.astype(np.uint8, copy=False)


def _depth_shape() -> tuple[int, int, int]:
    columns, rows = SIZE_PX
    return DEPTHS, rows // FINEST, columns // FINEST
