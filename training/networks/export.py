"""Trained networks as ONNX files."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from cogmap.errors import UsageError
from cogmap.files.digests import read_checked, write_digests

OPSET = 13
# Weights with more values than this are stored in half precision where a file is to be small.
MIN_HALVED = 256


def export(
    net: nn.Module,
    path: Path,
    input_name: str,
    input_shape: tuple[int, ...],
    output_names: Iterable[str],
    *,
    any_size: bool = False,
) -> None:
    """Write `net` to `path`, and its digest beside it, as `cogmap.services.epam.network` reads it;
    with `any_size`, for inputs (n, channels, h, w) of any height and width.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    free = {2: "height", 3: "width"}
    torch.onnx.export(
        net.eval(),
        (torch.zeros(input_shape),),
        str(path),
        dynamo=False,
        opset_version=OPSET,
        input_names=[input_name],
        output_names=list(output_names),
        dynamic_axes={input_name: free} if any_size else None,
    )
    write_digests(path)


def adopt(net: nn.Module, path: Path) -> None:
    """Give `net` the weights of the network of its kind that `export` wrote to `path`, to train it
    further. Raises UsageError if that has other layers, ConfigError if it is not as it was written.

    What normalized the layers is part of these weights, so that the normalization of `net` does
    nothing from here on: it must stay in evaluation.
    """
    import onnx
    from onnx import numpy_helper

    graph = onnx.load_from_string(read_checked(path)).graph
    values = {each.name: numpy_helper.to_array(each) for each in graph.initializer}
    stored = [
        [torch.tensor(values[name]) for name in node.input[1:]]
        for node in graph.node
        if node.op_type == "Conv" and all(name in values for name in node.input[1:])
    ]
    layers = [each for each in net.modules() if isinstance(each, nn.Conv2d | nn.BatchNorm2d)]
    convolutions = [each for each in layers if isinstance(each, nn.Conv2d)]
    shapes = [each.weight.shape for each in convolutions]
    if shapes != [weight.shape for weight, _ in stored]:
        raise UsageError(f"{path} holds another network: start from one that was trained so")

    # The bias of a convolution without one is that of the normalization after it.
    biases: list[Tensor] = []
    of_convolutions = iter(stored)
    for layer in layers:
        if isinstance(layer, nn.BatchNorm2d):
            layer.running_mean = torch.zeros(layer.num_features)
            layer.running_var = torch.ones(layer.num_features) - layer.eps
            layer.bias.data = biases.pop()
            continue

        weight, bias = next(of_convolutions)
        layer.weight.data = weight
        if layer.bias is None:
            biases.append(bias)
        else:
            layer.bias.data = bias


def halve(path: Path) -> None:
    """Store the large weights of the network in `path` in half precision; it computes in single
    precision as before.
    """
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    model = onnx.load(path)
    casts = []
    for weights in model.graph.initializer:
        values = numpy_helper.to_array(weights)
        if values.dtype != np.float32 or values.size < MIN_HALVED:
            continue

        name = weights.name
        weights.CopyFrom(numpy_helper.from_array(values.astype(np.float16), f"{name}.half"))
        casts.append(helper.make_node("Cast", [f"{name}.half"], [name], to=TensorProto.FLOAT))

    # A node stands after those that it depends on.
    nodes = [*casts, *model.graph.node]
    del model.graph.node[:]
    model.graph.node.extend(nodes)
    onnx.save(model, path)
    write_digests(path)
