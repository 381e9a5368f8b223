"""The settings of long-term memory."""

from __future__ import annotations

from typing import Annotated

import msgspec

from cogmap.services.memory.episodic.config import EpisodicConfig
from cogmap.services.memory.sparse.config import SparseConfig

MIN_SIGHTINGS = 3
"""Views that must agree with an object's position before it is stored, or cues a recall."""

Cycles = Annotated[int, msgspec.Meta(ge=1, le=100_000)]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """How often is stored and recalled, how much at once, and the memories that it has."""

    store_cycles: Annotated[
        Cycles,
        msgspec.Meta(
            description="Cycles between two times at which what has changed on a map that was "
            "broadcast is stored."
        ),
    ] = 25
    recall_cycles: Annotated[
        Cycles,
        msgspec.Meta(
            description="Cycles between two attempts to recall the map around, and an episode."
        ),
    ] = 5
    max_returned: Annotated[
        int,
        msgspec.Meta(
            ge=1,
            le=1000,
            description="Objects that come back in one recall at most, the nearest first.",
        ),
    ] = 4
    compared_maps: Annotated[
        int,
        msgspec.Meta(
            ge=1,
            le=1000,
            description="Stored maps that are compared with the objects around: if there are "
            "more, those that sparse distributed memory is reminded of.",
        ),
    ] = 5
    sparse: Annotated[SparseConfig, msgspec.Meta(description="The sparse distributed memory.")] = (
        SparseConfig()
    )
    episodic: Annotated[EpisodicConfig, msgspec.Meta(description="Episodic memory.")] = (
        EpisodicConfig()
    )
