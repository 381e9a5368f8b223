"""The settings of the global workspace: LIDA's published defaults, where none says otherwise."""

from __future__ import annotations

from typing import Annotated

import msgspec

from cogmap.schemas.base import Share

TickCount = Annotated[int, msgspec.Meta(ge=0, le=10**9)]
ActivationSum = Annotated[float, msgspec.Meta(ge=0, le=1000)]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Times are in ticks of `tick_ms`. The refractory period, 40 ticks of 5 ms, is LIDA's cycle of
    about 200 ms.

    LIDA publishes 0.5 as the activation of one coalition above which it is broadcast at once. That
    is exactly what content without salience has at full activation, which so would never exceed it
    and be broadcast in each third cycle at most, by the time that has passed. With 0.45 such
    content is broadcast in each cycle in which nothing more salient is, up to five times a second.
    """

    tick_ms: Annotated[
        float,
        msgspec.Meta(gt=0, le=10_000, description="Length of a tick, in ms, above 0 to 10000."),
    ] = 5.0
    no_broadcast_ticks: Annotated[
        TickCount,
        msgspec.Meta(description="Time without a broadcast that triggers one, in ticks, 0 to 1e9."),
    ] = 100
    no_new_coalition_ticks: Annotated[
        TickCount,
        msgspec.Meta(
            description="Time without a new coalition that triggers one, in ticks, 0 to 1e9."
        ),
    ] = 50
    aggregate_above: Annotated[
        ActivationSum,
        msgspec.Meta(
            description="Sum of activations above which a broadcast is triggered, 0 to 1000."
        ),
    ] = 0.8
    coalition_above: Annotated[
        ActivationSum,
        msgspec.Meta(
            description="Activation of one coalition above which one is triggered, 0 to 1000. "
            "LIDA: 0.5; here 0.45, because content without salience has 0.5 at most and never "
            "exceeds it: it would be broadcast by the other triggers alone, in fewer cycles."
        ),
    ] = 0.45
    refractory_ticks: Annotated[
        TickCount,
        msgspec.Meta(
            description="Time after a broadcast in which none is triggered, in ticks, 0 to 1e9."
        ),
    ] = 40
    decay: Annotated[
        Share,
        msgspec.Meta(description="Activation that a coalition loses in `ticks_per_decay`, 0 to 1."),
    ] = 0.1
    ticks_per_decay: Annotated[
        int,
        msgspec.Meta(
            ge=1,
            le=10**9,
            description="Time in which a coalition loses `decay`, in ticks, 1 to 1e9. LIDA: 1; "
            "here 40, a cycle, because coalitions come once a cycle: at 0.1 a tick none would be "
            "left for the next competition.",
        ),
    ] = 40
