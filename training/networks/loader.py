"""Training batches, made ahead by processes of their own."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor
from torch.utils.data import DataLoader, Dataset, IterableDataset

Batch = tuple[npt.NDArray[np.generic], ...]
# More processes than a GPU needs to be busy would only take memory.
MAX_WORKERS = 4


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


class _Numbered(Dataset):
    def __init__(self, make: Callable[[int], Batch], count: int) -> None:
        super().__init__()
        self._make = make
        self._count = count

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, number: int) -> Batch:
        return self._make(number)


def prefetch_numbered(make: Callable[[int], Batch], count: int) -> DataLoader[list[Tensor]]:
    """Return the batches that `make` returns for 0, 1, and so on, in this order, as tensors.

    A process for each core but one makes them, at most MAX_WORKERS: a batch must follow from its
    number alone. torch's global random generator is not used.
    """
    return DataLoader(
        _Numbered(make, count),
        batch_size=None,
        num_workers=max(1, min(MAX_WORKERS, (os.cpu_count() or 1) - 1)),
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
