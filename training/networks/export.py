"""Trained networks as ONNX files."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import torch
from torch import nn

OPSET = 13


def export(
    net: nn.Module,
    path: Path,
    input_name: str,
    input_shape: tuple[int, ...],
    output_names: Iterable[str],
) -> None:
    """Write `net` to `path`, as `cogmap.services.epam.network` reads it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    torch.onnx.export(
        net.eval(),
        (torch.zeros(input_shape),),
        str(path),
        dynamo=False,
        opset_version=OPSET,
        input_names=[input_name],
        output_names=list(output_names),
    )
