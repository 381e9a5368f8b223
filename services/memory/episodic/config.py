"""The settings of episodic memory."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from cogmap.schemas.base import Share

Hours = Annotated[float, Meta(ge=0, le=1e4)]


class EpisodicConfig(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """How long episodes last, which of them are kept, and when one is recalled."""

    decay_per_h: Annotated[
        Share,
        Meta(
            description="What an episode in Transient Episodic Memory loses of its activation in "
            "an hour. LIDA: they last for hours, up to a day, by no published rate that "
            "we know; here 0.1, because what was fully active then lasts for 10 h."
        ),
    ] = 0.1
    consolidation_h: Annotated[
        Hours,
        Meta(
            description="Age from which on an episode that is still active is consolidated, in h. "
            "Those of earlier runs are when the next one begins."
        ),
    ] = 1.0
    max_declarative: Annotated[
        int,
        Meta(
            ge=1,
            le=100_000,
            description="Episodes in Declarative Memory; beyond, the oldest are "
            "forgotten. Sparse distributed memory holds about 1000 with its defaults.",
        ),
    ] = 500
    recall_after_s: Annotated[
        float,
        Meta(
            ge=0,
            le=1e6,
            description="Time since its end after which an episode of this run may be recalled, "
            "in s.",
        ),
    ] = 60.0
    refractory_cycles: Annotated[
        int,
        Meta(
            ge=0,
            le=100_000,
            description="Cycles after an episode was offered in which no other is.",
        ),
    ] = 50
