"""Training batches, made ahead by a process of their own."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor
from torch.utils.data import DataLoader, IterableDataset

Batch = tuple[npt.NDArray[np.generic], ...]


class _Batches(IterableDataset):
    def __init__(self, generate: Callable[[], Iterator[Batch]]) -> None:
        super().__init__()
        self._generate = generate

    def __iter__(self) -> Iterator[Batch]:
        return self._generate()


def prefetch(generate: Callable[[], Iterator[Batch]]) -> DataLoader[list[Tensor]]:
    """Return the batches of `generate`, in its order, as tensors.

    One worker process makes them, so a seeded `generate` gives the same batches each time. torch's
    global random generator is not used.
    """
    return DataLoader(
        _Batches(generate),
        batch_size=None,
        num_workers=1,
        prefetch_factor=2,
        generator=torch.Generator(),
    )


def shuffled(
    count: int, batch: int, steps: int, rng: np.random.Generator
) -> Iterator[npt.NDArray[np.intp]]:
    """Yield the numbers (batch,) of the examples of each step: all of `count` in any order, but for
    a rest smaller than a batch, then all again.
    """
    order = np.empty(0, np.intp)
    for _ in range(steps):
        if len(order) < batch:
            order = rng.permutation(count)
        yield order[:batch]
        order = order[batch:]
