"""The settings of the global workspace: LIDA's published defaults, unless one says otherwise."""

from __future__ import annotations

from typing import Annotated

import msgspec

from cogmap.schemas.base import Share

TickCount = Annotated[int, msgspec.Meta(ge=0, le=10**9)]
ActivationSum = Annotated[float, msgspec.Meta(ge=0, le=1000)]


# LIDA's tick. The refractory period, 40 ticks, is LIDA's cycle of about 200 ms.
TICK_MS = 5.0
# Time without a new coalition that triggers a broadcast (LIDA).
NO_NEW_COALITION_TICKS = 50
# A cycle: coalitions come once in each, so by LIDA's decay in each tick none would be left.
TICKS_PER_DECAY = 40


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Thresholds and times of the competition, in ticks of 5 ms."""

    no_broadcast_ticks: Annotated[
        TickCount, msgspec.Meta(description="Time without a broadcast that triggers one, in ticks.")
    ] = 100
    aggregate_above: Annotated[
        ActivationSum,
        msgspec.Meta(description="Sum of activations above which a broadcast is triggered."),
    ] = 0.8
    coalition_above: Annotated[
        ActivationSum,
        msgspec.Meta(
            description="Activation of one coalition above which one is triggered. LIDA: 0.5; "
            "here 0.45, because content without salience has 0.5 at most and never "
            "exceeds it: it would be broadcast by the other triggers alone, in each "
            "third cycle at most."
        ),
    ] = 0.45
    refractory_ticks: Annotated[
        TickCount,
        msgspec.Meta(description="Time after a broadcast in which none is triggered, in ticks."),
    ] = 40
    decay: Annotated[
        Share,
        msgspec.Meta(
            description="Activation that a coalition loses in a cycle of 40 ticks. LIDA: 0.1 in a "
            "tick; here in a cycle, because coalitions come once in each: at 0.1 a "
            "tick none would be left for the next competition."
        ),
    ] = 0.1
