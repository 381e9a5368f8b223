"""The road network for photographs, which must not depend on the light nor on the camera: it sees
contrasts and differences of colour instead of colours.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from cogmap.training.networks.unet import UNet

COLOURS = 3
# Of the network's input, as services/epam/layout/road.py makes it: from there to shares of the
# mean brightness.
OFFSET = 2.0
SCALE = 64 / 112
NORMALIZED = 5
WINDOW_PX = 17
DARKEST = 0.05
MIN_CONTRAST = 0.15
MIN_DIFFERENCE = 0.05


class PhotographNet(nn.Module):
    """A U-Net at half the resolution, over what `normalized` returns and the positions of pixels.

    float32 (n, 5, h, w), colours and positions, to (n, 1, h, w), the log odds of road; `h` and `w`
    must be multiples of 2 ** len(widths).
    """

    def __init__(self, positions: int, widths: Sequence[int]) -> None:
        super().__init__()
        self.net = UNet(NORMALIZED + positions, 1, widths)

    def forward(self, values: Tensor) -> Tensor:
        """Return the output for `values`."""
        halved = functional.avg_pool2d(values, 2)
        colours = halved[:, :COLOURS]
        positions = halved[:, COLOURS:]
        output = self.net(torch.cat([normalized(colours), positions], dim=1))

        enlarged: Tensor = functional.interpolate(output, scale_factor=2.0, mode="bilinear")
        return enlarged


def normalized(colours: Tensor) -> Tensor:
    """Return values that hardly depend on light and camera, (n, NORMALIZED, h, w): the logarithm of
    the brightness against that around it and against the whole image's, and the colours less the
    image's mean, all in standard deviations.

    A normalization by the surroundings is local contrast normalization (Jarrett, Kavukcuoglu,
    Ranzato & LeCun 2009).
    """
    shares = (colours + OFFSET) * SCALE
    logarithm = torch.log(shares.clamp(min=0) + DARKEST)
    brightness = logarithm.mean(1, keepdim=True)
    tint = logarithm - brightness

    from_around = brightness - _around(brightness)
    deviation = torch.sqrt(_around(from_around.square()))
    local = from_around / (deviation + MIN_CONTRAST)

    whole = _standardized(brightness, MIN_CONTRAST)
    return torch.cat([local, whole, _standardized(tint, MIN_DIFFERENCE)], dim=1)


def _standardized(values: Tensor, minimum: float) -> Tensor:
    """Return `values` less their mean in each image, in standard deviations plus `minimum`."""
    from_mean = values - values.mean((2, 3), keepdim=True)
    deviation = torch.sqrt(from_mean.square().mean((2, 3), keepdim=True))
    return from_mean / (deviation + minimum)


def _around(values: Tensor) -> Tensor:
    """Average the WINDOW_PX by WINDOW_PX pixels about each pixel, those outside left out."""
    half_px = WINDOW_PX // 2
    rows = functional.avg_pool2d(values, (WINDOW_PX, 1), 1, (half_px, 0), count_include_pad=False)
    return functional.avg_pool2d(rows, (1, WINDOW_PX), 1, (0, half_px), count_include_pad=False)
