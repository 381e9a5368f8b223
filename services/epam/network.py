"""ONNX networks, run by ONNX Runtime, each pass on one thread, without torch."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cogmap.errors import ConfigError
from cogmap.files.digests import read_checked
from cogmap.geometry.arrays import Singles
from cogmap.services.epam.config import Processor

if TYPE_CHECKING:
    import onnxruntime

WEIGHTS = Path(__file__).with_name("weights")
CPU_PROVIDER = "CPUExecutionProvider"
CUDA_PROVIDER = "CUDAExecutionProvider"
# ONNX Runtime's names; the first that is installed is taken.
GPU_PROVIDERS = (
    CUDA_PROVIDER,
    "MIGraphXExecutionProvider",
    "DmlExecutionProvider",
    "CoreMLExecutionProvider",
)
# Products of single precision, as on a CPU.
CUDA_OPTIONS = {"use_tf32": "0"}
# None: any number.
Shape = tuple[int | None, ...]
# Views are scaled to about this area for a network that takes any size, and to sides that are
# multiples of this: the network halves them five times.
FREE_AREA_PX = 320 * 240
FREE_STEP_PX = 32


class Network:
    """The network in the ONNX file at `path`: float32 `input_shape` to float32 outputs, whose
    shapes are given by name, run by `processor`. Where a shape has None the file may have any
    number, or leave it free.

    Raises ConfigError if there is no such file or no such processor, if the file does not have the
    digest that is beside it, or if its network has other inputs or outputs.
    """

    def __init__(
        self,
        path: Path,
        input_shape: Shape,
        output_shapes: Mapping[str, Shape],
        processor: Processor = "cpu",
    ) -> None:
        self._session = _session(path, processor)
        self._beside = ThreadPoolExecutor(1)
        self._output_names = list(output_shapes)

        inputs = _shapes(self._session.get_inputs())
        self._input_name = next(iter(inputs), "input")
        outputs = _shapes(self._session.get_outputs())
        for verb, found, expected in (
            ("takes", inputs, {self._input_name: input_shape}),
            ("gives", outputs, dict(output_shapes)),
        ):
            if not _agree(found, expected):
                raise ConfigError(
                    f"{path} {verb} {found}, but {expected} is expected: "
                    "train it again with cogmap train"
                )

        self._input_shape = inputs[self._input_name]

    def view_size(self, view: tuple[int, ...], padding_px: int) -> ViewSize:
        """Return the size to which a `view` of that size (h, w) is scaled for this network, whose
        input is (n, channels, h, w). One that takes a single size has `padding_px` rows of border.
        """
        *_, height, width = self._input_shape
        if height is not None and width is not None:
            return ViewSize(height - 2 * padding_px, width, padding_px)

        height_px, width_px = view
        scale = np.sqrt(FREE_AREA_PX / (height_px * width_px)) / FREE_STEP_PX
        rows = max(1, round(height_px * scale))
        columns = max(1, round(width_px * scale))
        return ViewSize(rows * FREE_STEP_PX, columns * FREE_STEP_PX, 0)

    def begin(self, values: Singles) -> Future[list[Singles]]:
        """Begin a pass that is computed beside what the caller does meanwhile; its outputs are
        those of `self(values)`.
        """
        return self._beside.submit(self, values)

    def __call__(self, values: Singles) -> list[Singles]:
        """Return the outputs for `values`, in the order of their names."""
        assert _fits(values.shape, self._input_shape)

        outputs = self._session.run(self._output_names, {self._input_name: values})
        return [np.asarray(output, np.float32) for output in outputs]


class ViewSize(NamedTuple):
    """The size of a view as a network receives it, without the `padding_px` rows that the network
    has above it and below.
    """

    height_px: int
    width_px: int
    padding_px: int


def _shapes(arguments: Iterable[onnxruntime.NodeArg]) -> dict[str, Shape]:
    """Return the shapes of a network's inputs or outputs by name, None where a number is free."""
    shapes: dict[str, Shape] = {}
    for argument in arguments:
        numbers = [size if isinstance(size, int) else None for size in argument.shape]
        shapes[argument.name] = tuple(numbers)

    return shapes


def _agree(found: Mapping[str, Shape], expected: Mapping[str, Shape]) -> bool:
    """Return whether the same names have shapes that fit."""
    return found.keys() == expected.keys() and all(
        _fits(shape, expected[name]) for name, shape in found.items()
    )


def _fits(shape: Shape, expected: Shape) -> bool:
    """Return whether `shape` has the numbers of `expected`, where that has any."""
    return len(shape) == len(expected) and all(
        wanted in (None, size) for size, wanted in zip(shape, expected, strict=True)
    )


def provider_of(processor: Processor, installed: Collection[str]) -> str:
    """Return the one of ONNX Runtime's `installed` providers that runs networks on a processor.

    Raises ConfigError if there is none.
    """
    if processor == "cpu":
        return CPU_PROVIDER

    for name in GPU_PROVIDERS:
        if name in installed:
            return name

    raise ConfigError(
        "epam.processor is gpu, but the installed ONNX Runtime has no provider for one: install "
        "onnxruntime-gpu in its place, or set epam.processor to cpu"
    )


def _session(path: Path, processor: Processor) -> onnxruntime.InferenceSession:
    content = read_checked(path)

    # It starts a thread as it is imported, which a forked process would lack and wait for.
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.inter_op_num_threads = 1
    provider = provider_of(processor, onnxruntime.get_available_providers())
    provider_options = CUDA_OPTIONS if provider == CUDA_PROVIDER else {}
    try:
        session = onnxruntime.InferenceSession(
            content, options, providers=[(provider, provider_options)]
        )
    except Exception as error:  # the library raises an exception of its own for each status
        raise ConfigError(
            f"{path} does not hold a network ({error}): train it again with cogmap train"
        ) from error

    # If its driver is missing, ONNX Runtime takes the CPU without an error.
    if provider not in session.get_providers():
        raise ConfigError(
            f"{provider} does not start on this machine: install the driver that it needs, or set "
            "epam.processor to cpu"
        )
    return session
