"""The sparse distributed memory that a configuration asks for."""

from __future__ import annotations

from cogmap.services.memory.sparse.binary import BinaryMemory
from cogmap.services.memory.sparse.config import SparseConfig
from cogmap.services.memory.sparse.interface import AssociativeMemory
from cogmap.services.memory.sparse.modular import ModularMemory


def build(config: SparseConfig) -> AssociativeMemory:
    """Build an empty memory of the kind that is configured."""
    if config.kind == "binary":
        return BinaryMemory(config)

    return ModularMemory(config)
