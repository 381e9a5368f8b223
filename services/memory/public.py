"""What others may use of long-term memory: sparse distributed memory, episodes by their cues, and
the recall of maps.
"""

from __future__ import annotations

from cogmap.services.memory import recall
from cogmap.services.memory.episodic import cues, episodic_memory
from cogmap.services.memory.episodic.config import EpisodicConfig
from cogmap.services.memory.maps import RememberedMap
from cogmap.services.memory.sequence_cue import Way
from cogmap.services.memory.sparse import vectors
from cogmap.services.memory.sparse.config import SparseConfig
from cogmap.services.memory.sparse.modular import ModularMemory, hard_addresses
from cogmap.services.memory.sparse.structures import ItemMemory

__all__ = [
    "EpisodicConfig",
    "ItemMemory",
    "ModularMemory",
    "RememberedMap",
    "SparseConfig",
    "Way",
    "cues",
    "episodic_memory",
    "hard_addresses",
    "recall",
    "vectors",
]
