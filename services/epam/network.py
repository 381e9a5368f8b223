"""Networks in ONNX files, run by OpenCV's dnn module on one thread: the running system needs no
torch.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.errors import ConfigError

WEIGHTS = Path(__file__).with_name("weights")
Tensor = npt.NDArray[np.float32]
Shape = tuple[int, ...]


class Network:
    """The network in the file at `path`, which turns float32 `takes` into float32 of the shapes in
    `gives`, by name.

    Raises ConfigError where there is no such file, or what is in it has other inputs or outputs.
    """

    def __init__(self, path: Path, takes: Shape, gives: Mapping[str, Shape]) -> None:
        cv2.setNumThreads(1)
        self._takes, self._names = takes, list(gives)
        if not path.is_file():
            raise ConfigError(f"no weights {path}: train them with python -m training")
        try:
            self._net = cv2.dnn.readNetFromONNX(str(path))
            channels = _channels(path)
            given = [values.shape for values in self(np.zeros(takes, np.float32))]
        except cv2.error as error:
            reason = (
                str(error).strip().splitlines()[0]
                if str(error).strip()
                else "OpenCV cannot read it"
            )
            raise ConfigError(
                f"{path} does not hold a network that takes {takes} ({reason}): "
                "train it again with python -m training"
            ) from None
        if channels != takes[1]:
            raise ConfigError(
                f"{path} takes {channels} channels, where {takes[1]} are expected: "
                "train it again with python -m training"
            )
        if given != list(gives.values()):
            raise ConfigError(
                f"{path} gives {given}, where {list(gives.values())} are expected: "
                "train it again with python -m training"
            )

    def __call__(self, values: Tensor) -> list[Tensor]:
        """What it makes of `values`, a tensor for each name in `gives`."""
        assert values.shape == self._takes
        self._net.setInput(values)
        return [np.asarray(output, np.float32) for output in self._net.forward(self._names)]


def _channels(path: Path) -> int:
    """How many channels the first layer takes. OpenCV's new engine, which runs the network, takes
    any number.
    """
    net = cv2.dnn.readNetFromONNX(str(path), cv2.dnn.ENGINE_CLASSIC)
    layers = (net.getLayer(number).blobs for number in range(1, len(net.getLayerNames()) + 1))
    return next((int(blobs[0].shape[1]) for blobs in layers if blobs), 0)
