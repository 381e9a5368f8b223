"""A small U-Net (Ronneberger, Fischer & Brox 2015): what each pixel shows, from its surroundings at
several scales.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn


class UNet(nn.Module):
    """float32 (n, channels_in, h, w) to (n, channels_out, h, w), without a last nonlinearity.

    Each of `widths` is the number of channels at one scale, from the finest on, each at half the
    resolution of the one before: `h` and `w` must be multiples of 2 ** (len(widths) - 1).
    """

    def __init__(self, channels_in: int, channels_out: int, widths: Sequence[int]) -> None:
        super().__init__()
        finer = widths[:-1]
        coarser = widths[1:]

        self.stem = convolution(channels_in, widths[0])

        self.down = nn.ModuleList()
        for fine, coarse in zip(finer, coarser, strict=True):
            halved = convolution(fine, coarse, stride=2)
            mixed = convolution(coarse, coarse)
            self.down.append(nn.Sequential(halved, mixed))

        self.up = nn.ModuleList()
        for fine, coarse in zip(reversed(finer), reversed(coarser), strict=True):
            self.up.append(convolution(fine + coarse, fine))

        self.enlarge = nn.Upsample(scale_factor=2, mode="nearest")
        self.head = nn.Conv2d(widths[0], channels_out, 1)

    def forward(self, values: Tensor) -> Tensor:
        """Return the output for `values`."""
        scales = [self.stem(values)]
        for down in self.down:
            scales.append(down(scales[-1]))

        values = scales.pop()
        for up in self.up:
            finer = scales.pop()
            values = up(torch.cat([finer, self.enlarge(values)], dim=1))
        return self.head(values)


def convolution(channels_in: int, channels_out: int, stride: int = 1) -> nn.Sequential:
    """Return a 3 by 3 convolution, normalized and rectified; an exported network has the
    normalization folded into its weights.
    """
    return nn.Sequential(
        nn.Conv2d(channels_in, channels_out, 3, stride=stride, padding=1, bias=False),
        nn.BatchNorm2d(channels_out),
        nn.ReLU(inplace=True),
    )
