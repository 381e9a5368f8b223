"""How the codelets are configured."""

from __future__ import annotations

from typing import Annotated

import msgspec

Positive = Annotated[float, msgspec.Meta(gt=0)]
Share = Annotated[float, msgspec.Meta(ge=0, le=1)]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Noise as the agent believes it to be, and numbers of samples."""

    samples: Annotated[int, msgspec.Meta(ge=10, le=100_000)] = 800
    kept_samples: Annotated[int, msgspec.Meta(ge=1, le=10_000)] = 200
    landmark_samples: Annotated[int, msgspec.Meta(ge=10, le=10_000)] = 200
    speed_noise: Share = 0.1
    turn_noise: Share = 0.1
    drift_rad_per_sqrt_m: Share = 0.02
    outlier_share: Share = 1e-3
    largest_landmark_sd_m: Positive = 4.0
    landmark_jitter_m: Positive = 0.03
    gate: Positive = 4.0
    misses: Annotated[int, msgspec.Meta(ge=1)] = 8
    attention_base_level: Share = 1.0
