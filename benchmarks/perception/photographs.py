"""Road found in street photographs that the town's network never saw, after training on some."""

from __future__ import annotations

from pathlib import Path

from benchmarks.report import Metrics
from benchmarks.threshold import at_least
from cogmap.errors import UsageError
from training.photographs import camvid_iou

THRESHOLDS = {"camvid_iou": at_least(0.85)}
SEED = 0


def measure(camvid: Path, folder: Path) -> Metrics:
    """Train on CamVid's `train` photographs, and measure on its `val`; the weights go to `folder`.

    Raises UsageError where torch is not installed, or the photographs cannot be read.
    """
    try:
        from training.camvid import train_on_photographs
    except ImportError as error:
        raise UsageError(f"{error}: it trains a network first, run make train-setup") from None

    weights = folder / "road-camvid.onnx"
    train_on_photographs(camvid, weights, seed=SEED)

    return {"camvid_iou": camvid_iou(weights, camvid / "val", camvid / "valannot")}
