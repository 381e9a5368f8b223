"""The next batch, made while the network learns from this one."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Batch = TypeVar("Batch")
DEEP = 3


def ahead(batches: Iterator[Batch]) -> Iterator[Batch]:
    """`batches` in their order, some of them made ahead on a thread of their own."""
    with ThreadPoolExecutor(1) as maker:
        waiting = [maker.submit(next, batches, None) for _ in range(DEEP)]
        while (batch := waiting.pop(0).result()) is not None:
            waiting.append(maker.submit(next, batches, None))
            yield batch
