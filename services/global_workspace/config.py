"""How the global workspace is configured: LIDA's published defaults."""

from __future__ import annotations

from typing import Annotated

import msgspec

Positive = Annotated[float, msgspec.Meta(gt=0)]
Ticks = Annotated[int, msgspec.Meta(ge=0)]
Share = Annotated[float, msgspec.Meta(ge=0)]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Times in ticks of `tick_ms`: at 5 ms, the refractory period of 40 ticks is LIDA's cycle of
    about 200 ms.
    """

    tick_ms: Positive = 5.0
    no_broadcast_ticks: Ticks = 100
    no_new_coalition_ticks: Ticks = 50
    aggregate_above: Share = 0.8
    coalition_above: Share = 0.5
    refractory_ticks: Ticks = 40
    decay: Share = 0.1
    ticks_per_decay: Annotated[int, msgspec.Meta(ge=1)] = 40
