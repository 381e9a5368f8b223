"""EfficientNet-Lite0 (Tan and Le 2019; Liu 2020) up to the layer that is used, with the names that
its published weights have.

The layers are padded as TensorFlow pads them, where the weights were trained: a row or column that
is missing for a stride is added below and on the right.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

STEM_CHANNELS = 32
EXPANSION = 6
EPSILON = 1e-3


class Stage(NamedTuple):
    """Blocks of one size: the first has the stride."""

    kernel: int
    stride: int
    expansion: int
    blocks: int
    channels: int


# Of seven stages the first four: at a sixteenth of the image's sides.
STAGES = (
    Stage(3, 1, 1, 1, 16),
    Stage(3, 2, EXPANSION, 2, 24),
    Stage(5, 2, EXPANSION, 2, 40),
    Stage(3, 2, EXPANSION, 3, 80),
)


class EfficientNetLite0(nn.Module):
    """The stem and STAGES: float32 (n, 3, h, w) to (n, 80, h / 16, w / 16), each channel less its
    mean and by its standard deviation on the photographs that it was trained on.

    These follow from what its batch normalizations keep: the blocks of a stage are summed, and
    taken as independent.
    """

    mean: Tensor
    deviation: Tensor

    def __init__(self, weights: Mapping[str, Tensor]) -> None:
        super().__init__()
        self._conv_stem = _Convolution(3, STEM_CHANNELS, 3, stride=2)
        self._bn0 = nn.BatchNorm2d(STEM_CHANNELS, EPSILON)

        blocks = []
        channels = STEM_CHANNELS
        for stage in STAGES:
            for number in range(stage.blocks):
                stride = stage.stride if number == 0 else 1
                blocks.append(
                    _Block(channels, stage.channels, stage.kernel, stride, stage.expansion)
                )
                channels = stage.channels
        self._blocks = nn.ModuleList(blocks)

        names = self.state_dict()
        self.load_state_dict({name: weights[name] for name in names})
        summed = blocks[-STAGES[-1].blocks :]
        mean = torch.stack([block._bn2.bias for block in summed]).sum(0)
        variance = torch.stack([block._bn2.weight.square() for block in summed]).sum(0)
        self.register_buffer("mean", mean[:, None, None].detach(), persistent=False)
        self.register_buffer("deviation", variance.sqrt()[:, None, None].detach(), persistent=False)

    def forward(self, values: Tensor) -> Tensor:
        """Return the last layer for `values`."""
        layer = functional.relu6(self._bn0(self._conv_stem(values)))
        for block in self._blocks:
            layer = block(layer)

        return (layer - self.mean) / self.deviation


class _Block(nn.Module):
    """An inverted residual block: wider, across the image, narrower; added to its input where the
    sizes are the same.
    """

    def __init__(
        self, channels: int, out_channels: int, kernel: int, stride: int, expansion: int
    ) -> None:
        super().__init__()
        wide = expansion * channels
        self._expands = expansion > 1
        if self._expands:
            self._expand_conv = _Convolution(channels, wide, 1)
            self._bn0 = nn.BatchNorm2d(wide, EPSILON)

        self._depthwise_conv = _Convolution(wide, wide, kernel, stride, groups=wide)
        self._bn1 = nn.BatchNorm2d(wide, EPSILON)
        self._project_conv = _Convolution(wide, out_channels, 1)
        self._bn2 = nn.BatchNorm2d(out_channels, EPSILON)
        self._adds = stride == 1 and channels == out_channels

    def forward(self, values: Tensor) -> Tensor:
        layer = values
        if self._expands:
            layer = functional.relu6(self._bn0(self._expand_conv(layer)))

        layer = functional.relu6(self._bn1(self._depthwise_conv(layer)))
        layer = self._bn2(self._project_conv(layer))
        return layer + values if self._adds else layer


class _Convolution(nn.Conv2d):
    """A convolution without a bias, padded as TensorFlow pads."""

    def __init__(
        self, channels: int, out_channels: int, kernel: int, stride: int = 1, groups: int = 1
    ) -> None:
        super().__init__(channels, out_channels, kernel, stride, groups=groups, bias=False)
        self._kernel = kernel
        self._stride = stride

    def forward(self, values: Tensor) -> Tensor:
        padding = []
        for size in (values.shape[3], values.shape[2]):
            outputs = -(-size // self._stride)
            missing = max((outputs - 1) * self._stride + self._kernel - size, 0)
            padding += [missing // 2, missing - missing // 2]

        return super().forward(functional.pad(values, padding))
