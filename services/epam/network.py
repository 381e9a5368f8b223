"""ONNX networks, run by OpenCV's dnn module on one thread; running them needs no torch."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np

from cogmap.errors import ConfigError
from cogmap.geometry.arrays import Singles

WEIGHTS = Path(__file__).with_name("weights")
Shape = tuple[int, ...]


class Network:
    """The network in the ONNX file at `path`: float32 `input_shape` to float32 outputs, whose
    shapes are given by name.

    Raises ConfigError if there is no such file, or its network has other inputs or outputs.
    """

    def __init__(self, path: Path, input_shape: Shape, output_shapes: Mapping[str, Shape]) -> None:
        cv2.setNumThreads(1)
        self._input_shape = input_shape
        self._output_names = list(output_shapes)
        self._load(path)
        self._check(path, list(output_shapes.values()))

    def __call__(self, values: Singles) -> list[Singles]:
        """Return the outputs for `values`, in the order of their names."""
        assert values.shape == self._input_shape

        self._net.setInput(values)
        outputs = self._net.forward(self._output_names)
        return [np.asarray(output, np.float32) for output in outputs]

    def _load(self, path: Path) -> None:
        if not path.is_file():
            raise ConfigError(f"no weights {path}: train them with cogmap train")
        try:
            self._net = cv2.dnn.readNetFromONNX(str(path))
        except cv2.error as error:
            raise self._unreadable(path, error) from None

    def _check(self, path: Path, expected: list[Shape]) -> None:
        try:
            channels = _input_channels(path)
            outputs = self(np.zeros(self._input_shape, np.float32))
        except cv2.error as error:
            raise self._unreadable(path, error) from None

        if channels != self._input_shape[1]:
            raise ConfigError(
                f"{path} takes {channels} channels, where {self._input_shape[1]} are expected: "
                "train it again with cogmap train"
            )

        shapes = [output.shape for output in outputs]
        if shapes != expected:
            raise ConfigError(
                f"{path} gives {shapes}, where {expected} are expected: "
                "train it again with cogmap train"
            )

    def _unreadable(self, path: Path, error: cv2.error) -> ConfigError:
        lines = str(error).strip().splitlines()
        reason = lines[0] if lines else "OpenCV cannot read it"
        return ConfigError(
            f"{path} does not hold a network that takes {self._input_shape} ({reason}): "
            "train it again with cogmap train"
        )


def _input_channels(path: Path) -> int:
    """The number of channels of the first layer's weights, 0 if no layer has any.

    OpenCV's new engine, which runs the network, accepts any number, so the classic one is asked.
    """
    net = cv2.dnn.readNetFromONNX(str(path), cv2.dnn.ENGINE_CLASSIC)
    layers = len(net.getLayerNames())

    for number in range(1, layers + 1):
        blobs = net.getLayer(number).blobs
        if blobs:
            weights = blobs[0]
            return int(weights.shape[1])
    return 0
