"""The settings of long-term memory."""

from __future__ import annotations

from typing import Annotated

import msgspec

from cogmap.schemas.base import PositiveMetres, PositiveShare, Share
from cogmap.services.memory.episodic.config import EpisodicConfig
from cogmap.services.memory.sparse.config import SparseConfig

Cycles = Annotated[int, msgspec.Meta(ge=1, le=100_000)]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """What is stored and when, when a stored map is taken for the town around, and episodes."""

    store_cycles: Annotated[
        Cycles,
        msgspec.Meta(
            description="Cycles between two times at which what has changed on a map that was "
            "broadcast is stored, 1 to 100000."
        ),
    ] = 25
    recall_cycles: Annotated[
        Cycles,
        msgspec.Meta(
            description="Cycles between two attempts to recall the map around, and an episode, 1 "
            "to 100000."
        ),
    ] = 5
    min_sightings: Annotated[
        int,
        msgspec.Meta(
            ge=1,
            le=1000,
            description="Views that must agree with an object's position before it is stored, or "
            "cues a recall, 1 to 1000.",
        ),
    ] = 3
    learned_base_level: Annotated[
        Share,
        msgspec.Meta(
            description="Base level from which on an object that the workspace forgets by time "
            "alone was learned, and is kept here, 0 to 1. The second view gives 0.15, and two "
            "broadcasts the rest to the default; with less, what is placed badly would come back "
            "too."
        ),
    ] = 0.3
    cue_within_m: Annotated[
        PositiveMetres,
        msgspec.Meta(
            description="Distance from the agent, or from an object that is conscious, within "
            "which an object that was forgotten comes back, in m, above 0 to 1e4: somewhat "
            "farther than it is seen from."
        ),
    ] = 50.0
    max_returned: Annotated[
        int,
        msgspec.Meta(
            ge=1,
            le=1000,
            description="Objects that come back in one recall at most, the nearest first, 1 to "
            "1000.",
        ),
    ] = 4
    min_matches: Annotated[
        int,
        msgspec.Meta(
            ge=3,
            le=1000,
            description="Objects that must stand as on a stored map for it to be recalled, 3 to "
            "1000.",
        ),
    ] = 6
    min_looks: Annotated[
        int,
        msgspec.Meta(
            ge=1,
            le=100,
            description="Looks that these objects must have among them, 1 to 100: rows of equal "
            "houses are alike in every town.",
        ),
    ] = 3
    min_looks_passed: Annotated[
        int,
        msgspec.Meta(
            ge=1,
            le=100,
            description="Looks that are enough where the stored map has along the way what was "
            "passed, 1 to 100.",
        ),
    ] = 2
    min_passed: Annotated[
        int,
        msgspec.Meta(
            ge=1,
            le=1000,
            description="Objects that a stored map must have along the way for that, 1 to 1000: "
            "min_share of them must be known here.",
        ),
    ] = 4
    min_lead: Annotated[
        int,
        msgspec.Meta(
            ge=1,
            le=100,
            description="By how many matches the best position on all stored maps must lead any "
            "other, 1 to 100.",
        ),
    ] = 3
    min_share: Annotated[
        PositiveShare,
        msgspec.Meta(
            description="Share of the objects known here that must stand as on the stored map, of "
            "those where that map is known, above 0 to 1."
        ),
    ] = 0.75
    compared_maps: Annotated[
        int,
        msgspec.Meta(
            ge=1,
            le=1000,
            description="Stored maps that are compared with the objects around, 1 to 1000: where "
            "there are more, those that sparse distributed memory is reminded of.",
        ),
    ] = 5
    sparse: Annotated[SparseConfig, msgspec.Meta(description="The sparse distributed memory.")] = (
        SparseConfig()
    )
    episodic: Annotated[EpisodicConfig, msgspec.Meta(description="Episodic memory.")] = (
        EpisodicConfig()
    )
    match_within_m: Annotated[
        PositiveMetres,
        msgspec.Meta(
            description="Distance within which an object stands as on a stored map, in m, above 0 "
            "to 1e4."
        ),
    ] = 2.5
