"""ONNX networks, run by ONNX Runtime, a pass on one thread; running them needs no torch."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cogmap.errors import ConfigError
from cogmap.geometry.arrays import Singles

if TYPE_CHECKING:
    import onnxruntime

WEIGHTS = Path(__file__).with_name("weights")
Shape = tuple[int, ...]


class Network:
    """The network in the ONNX file at `path`: float32 `input_shape` to float32 outputs, whose
    shapes are given by name.

    Raises ConfigError if there is no such file, or its network has other inputs or outputs.
    """

    def __init__(self, path: Path, input_shape: Shape, output_shapes: Mapping[str, Shape]) -> None:
        self._session = _session(path)
        self._beside = ThreadPoolExecutor(1)
        self._input_shape = input_shape
        self._output_names = list(output_shapes)

        inputs = {received.name: tuple(received.shape) for received in self._session.get_inputs()}
        self._input_name = next(iter(inputs), "input")
        _check(path, "takes", inputs, {self._input_name: input_shape})

        shapes = {output.name: tuple(output.shape) for output in self._session.get_outputs()}
        _check(path, "gives", shapes, output_shapes)

    def begin(self, values: Singles) -> Future[list[Singles]]:
        """Begin a pass that is computed beside what the caller does meanwhile; its outputs are
        those of `self(values)`.
        """
        return self._beside.submit(self, values)

    def __call__(self, values: Singles) -> list[Singles]:
        """Return the outputs for `values`, in the order of their names."""
        assert values.shape == self._input_shape

        outputs = self._session.run(self._output_names, {self._input_name: values})
        return [np.asarray(output, np.float32) for output in outputs]


def _session(path: Path) -> onnxruntime.InferenceSession:
    if not path.is_file():
        raise ConfigError(f"no weights {path}: train them with cogmap train")

    # It starts a thread as it is imported, which a forked process would lack and wait for.
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.inter_op_num_threads = 1
    try:
        return onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # the library raises an exception of its own for each status
        raise ConfigError(
            f"{path} does not hold a network ({error}): train it again with cogmap train"
        ) from error


def _check(
    path: Path, verb: str, found: Mapping[str, Shape], expected: Mapping[str, Shape]
) -> None:
    """Raise ConfigError where the shapes of inputs or outputs differ from those expected."""
    if found == dict(expected):
        return
    raise ConfigError(
        f"{path} {verb} {found}, where {dict(expected)} is expected: "
        "train it again with cogmap train"
    )
