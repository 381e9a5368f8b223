"""A small U-Net (Ronneberger, Fischer & Brox 2015): what each pixel shows, from its surroundings at
several scales.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn


class UNet(nn.Module):
    """float32 (n, channels_in, h, w) to (n, channels_out, h, w), without a last nonlinearity.

    Each of `widths` is the number of channels at one scale, the full one first, each next one half
    as fine: `h` and `w` must divide by 2 ** (len(widths) - 1).
    """

    def __init__(self, channels_in: int, channels_out: int, widths: Sequence[int]) -> None:
        super().__init__()
        self.stem = convolution(channels_in, widths[0])
        finer = widths[:-1]
        coarser = widths[1:]
        self.down = nn.ModuleList(
            nn.Sequential(convolution(fine, coarse, stride=2), convolution(coarse, coarse))
            for fine, coarse in zip(finer, coarser, strict=True)
        )
        self.up = nn.ModuleList(
            convolution(fine + coarse, fine)
            for fine, coarse in zip(reversed(finer), reversed(coarser), strict=True)
        )
        self.enlarge = nn.Upsample(scale_factor=2, mode="nearest")
        self.head = nn.Conv2d(widths[0], channels_out, 1)

    def forward(self, values: Tensor) -> Tensor:
        """What it makes of `values`."""
        scales = [self.stem(values)]
        for down in self.down:
            scales.append(down(scales[-1]))
        values = scales.pop()
        for up in self.up:
            values = up(torch.cat([scales.pop(), self.enlarge(values)], dim=1))
        return self.head(values)


def unet(channels_in: int, channels_out: int, widths: Sequence[int]) -> UNet:
    """A new U-Net, its weights drawn from torch's generator; see `UNet`."""
    return UNet(channels_in, channels_out, widths)


def convolution(channels_in: int, channels_out: int, stride: int = 1) -> nn.Sequential:
    """A 3 by 3 convolution, normalised and rectified; normalisation has no cost where the network
    runs.
    """
    return nn.Sequential(
        nn.Conv2d(channels_in, channels_out, 3, stride=stride, padding=1, bias=False),
        nn.BatchNorm2d(channels_out),
        nn.ReLU(inplace=True),
    )
