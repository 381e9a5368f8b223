"""The sparse distributed memory that a configuration asks for."""

from __future__ import annotations

from services.memory.sparse.binary import BinaryMemory
from services.memory.sparse.config import SparseConfig
from services.memory.sparse.interface import AssociativeMemory
from services.memory.sparse.memory import SparseMemory


def build(config: SparseConfig) -> AssociativeMemory:
    """An empty memory of the kind that is configured."""
    if config.kind == "binary":
        return BinaryMemory(config)

    return SparseMemory(config)
