"""The networks for photographs: a small decoder over an encoder that others have trained, with one
output for the road and one for buildings.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from cogmap.training.networks.encoder import FEATURES, Encoder
from cogmap.training.photographs import BUILDING, ROAD, UNLABELLED

WIDTH = 48
POSITIONS = 2
DEPTHS = 3
DROPPED_SHARE = 0.1
# Strides of the coarsest and of the finest features.
COARSE = 32
FINEST = 4


class Decoder(nn.Module):
    """Features of `Encoder`, positions (n, 2, h / 32, w / 32) and depth (n, 3, h / 4, w / 4) to log
    odds of road (n, 1, h / 2, w / 2), and to what `services/epam/recognition/segments.py` reads,
    (n, 4, h / 2, w / 2).

    Features are added from the coarser to the finer ones (Lin et al. 2017, feature pyramid), with
    the mean of the whole image for its light. Road and buildings are two of all CamVid's classes:
    what else a pixel may show is learned with them.

    Only where a building is parted from the next depends on depth, as no photograph that shows what
    is a building has any; what is learned of that does not change what road and buildings are found
    by.
    """

    def __init__(self) -> None:
        super().__init__()
        self.sideways = nn.ModuleList(_sideways(channels) for channels in FEATURES)
        self.position = nn.Conv2d(POSITIONS, WIDTH, 1)
        self.whole = nn.Conv2d(FEATURES[-1], WIDTH, 1)
        self.around = nn.Sequential(_separable(WIDTH), _separable(WIDTH, dilation=2))
        self.mixed = nn.ModuleList(_separable(WIDTH) for _ in FEATURES)
        self.class_head = nn.Conv2d(WIDTH, UNLABELLED, 1)

        self.depth = nn.Sequential(nn.Conv2d(DEPTHS, WIDTH, 3, padding=1), nn.ReLU())
        self.instance = nn.Sequential(
            _separable(2 * WIDTH, WIDTH), _separable(WIDTH), nn.Conv2d(WIDTH, 3, 1)
        )

    def forward(
        self, features: Sequence[Tensor], positions: Tensor, depth: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Return the unnormalized log probability of each class, (n, UNLABELLED, h / 2, w / 2), and
        the second output of the first examples, as many as `depth` has.
        """
        values = self._joined(features, positions)
        classes = _enlarged(self.class_head(values), 2)
        return classes, self._shown(values[: len(depth)], depth)

    def road(self, features: Sequence[Tensor], positions: Tensor) -> Tensor:
        """Return the first output alone."""
        values = self._joined(features, positions)
        return _enlarged(log_odds(self.class_head(values), ROAD), 2)

    def shown(self, features: Sequence[Tensor], positions: Tensor, depth: Tensor) -> Tensor:
        """Return the second output alone."""
        return self._shown(self._joined(features, positions), depth)

    def _joined(self, features: Sequence[Tensor], positions: Tensor) -> Tensor:
        """Join all features at the finest resolution, (n, WIDTH, h / 4, w / 4)."""
        coarse = features[-1]
        placed = self.sideways[-1](coarse) + self.position(positions)
        values = functional.relu(placed + self.whole(coarse.mean((2, 3), keepdim=True)))
        values = self.mixed[-1](values + self.around(values))
        for number in range(len(FEATURES) - 2, -1, -1):
            finer = self.sideways[number](features[number])
            values = self.mixed[number](functional.relu(finer + _enlarged(values, 2)))

        return values

    def _shown(self, values: Tensor, depth: Tensor) -> Tensor:
        instance = self.instance(torch.cat([values.detach(), self.depth(depth)], dim=1))
        building = log_odds(self.class_head(values), BUILDING)
        return _enlarged(torch.cat([building, instance], dim=1), 2)


def log_odds(classes: Tensor, number: int) -> Tensor:
    """Return the log odds (n, 1, h, w) of one class by the unnormalized log probabilities of all,
    (n, classes, h, w).
    """
    others = torch.cat([classes[:, :number], classes[:, number + 1 :]], dim=1)
    return classes[:, number : number + 1] - torch.logsumexp(others, 1, keepdim=True)


class RoadNet(nn.Module):
    """The input of `services/epam/layout/road.py`, unpadded and of any size that is a multiple of
    32, to log odds of road at half the resolution.
    """

    def __init__(self, encoder: Encoder, decoder: Decoder) -> None:
        super().__init__()
        self.encoder = encoder
        self.decoder = decoder

    def forward(self, values: Tensor) -> Tensor:
        """Return the output for `values`."""
        positions = functional.avg_pool2d(values[:, 3:5], COARSE)
        return self.decoder.road(self.encoder(values[:, :3]), positions)


class BuildingNet(nn.Module):
    """The input of `services/epam/recognition/segments.py`, unpadded and of any size that is a
    multiple of 32, to its output at half the resolution.
    """

    def __init__(self, encoder: Encoder, decoder: Decoder) -> None:
        super().__init__()
        self.encoder = encoder
        self.decoder = decoder

    def forward(self, values: Tensor) -> Tensor:
        """Return the output for `values`."""
        # Rows stand before columns here.
        positions = functional.avg_pool2d(values[:, 6:8].flip(1), COARSE)
        depth = functional.avg_pool2d(values[:, 3:6], FINEST)
        return self.decoder.shown(self.encoder(values[:, :3]), positions, depth)


def _sideways(channels: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Dropout2d(DROPPED_SHARE),
        nn.Conv2d(channels, WIDTH, 1, bias=False),
        nn.BatchNorm2d(WIDTH),
    )


def _separable(received: int, channels: int = WIDTH, dilation: int = 1) -> nn.Sequential:
    """Return a convolution channel by channel, then one of the channels, normalized and
    rectified.
    """
    return nn.Sequential(
        nn.Conv2d(
            received,
            received,
            3,
            padding=dilation,
            dilation=dilation,
            groups=received,
            bias=False,
        ),
        nn.Conv2d(received, channels, 1, bias=False),
        nn.BatchNorm2d(channels),
        nn.ReLU(),
    )


def _enlarged(values: Tensor, scale: int) -> Tensor:
    factor = float(scale)
    enlarged: Tensor = functional.interpolate(values, scale_factor=factor, mode="bilinear")
    return enlarged
