"""How action is configured."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

Positive = Annotated[float, msgspec.Meta(gt=0)]
Share = Annotated[float, msgspec.Meta(ge=0, le=1)]
Leg = tuple[
    Annotated[float, msgspec.Meta(gt=0, le=1e5)], Annotated[float, msgspec.Meta(ge=-3.2, le=3.2)]
]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """`route` is the way as one is told it: go so many metres, turn by so much (left positive), and
    so on.
    """

    mode: Literal["lockstep", "real_time"] = "real_time"
    route: list[Leg] = []
    overrun_m: Annotated[float, msgspec.Meta(ge=0)] = 5.0
    corner_radius_m: Positive = 3.5
    cruise_m_s: Positive = 4.0
    lookahead_m: Positive = 2.5
    lateral_m_s2: Positive = 1.5
    braking_m_s2: Positive = 2.5
    clearance_m: Positive = 1.5
    half_width_m: Positive = 0.7
    wheel_radius_m: Positive = 0.2
    track_m: Positive = 0.8
    selection_threshold: Share = 0.9
    threshold_fall: Share = 0.1
    instantiation: Share = 0.1
