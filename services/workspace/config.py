"""How the workspace is configured."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

Positive = Annotated[float, msgspec.Meta(gt=0)]
Share = Annotated[float, msgspec.Meta(ge=0, le=1)]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Lockstep waits for every answer; real time commits what there is at the deadline, counted
    from the frame.

    A percept is an object of the map where its total activation is over `recognition_threshold`. A
    view of what was away for `revisit_s` may close a loop, as may those that follow, one in
    `closure_spacing_s`. Map correction goes on meanwhile: lockstep waits for it at the end of the
    `correction_cycles`th cycle.
    """

    mode: Literal["lockstep", "real_time"] = "real_time"
    cell_m: Positive = 1.0
    deadline_ms: Positive = 180.0
    lease_ms: Positive = 120.0
    attempts: Annotated[int, msgspec.Meta(ge=1, le=100)] = 5
    first_samples: Annotated[int, msgspec.Meta(ge=10, le=100_000)] = 200
    recognition_threshold: Share = 0.7
    decay: Share = 0.1
    base_level_decay: Share = 0.0005
    place_decay: Share = 0.02
    forget_below: Share = 0.05
    path_spacing_m: Positive = 1.0
    revisit_s: Positive = 20.0
    closure_spacing_s: Positive = 2.0
    correction_cycles: Annotated[int, msgspec.Meta(ge=1, le=1000)] = 3
    correction_lease_ms: Positive = 5000.0
