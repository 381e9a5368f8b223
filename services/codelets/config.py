"""How the codelets are configured."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

Positive = Annotated[float, msgspec.Meta(gt=0)]
Share = Annotated[float, msgspec.Meta(ge=0, le=1)]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Numbers of samples, and what is believed of sightings. The noise of each sense comes with
    what it says.

    `correlated_views`: so many views of a landmark on end err alike and count for one, those of driving
    by once. The paper takes each for independent (eq. 1); a landmark that is always seen a little
    too near then drags the agent. `correct`: the map's positions only, as in the paper, or its
    headings too. `false_closure`: closures that would be as wrong as they look with a smaller
    probability than this do not hold. Gains: what each sense may be off by for longer than one
    step, as a share, and how long it stays so. The town's senses have none; a robot's that nobody
    calibrated are found while it drives. After `astray` views on end that fit nowhere, of two
    landmarks at least, the agent looks for itself anew. What is seen by its bearing alone stands at
    most `farthest_m` away.
    """

    samples: Annotated[int, msgspec.Meta(ge=10, le=100_000)] = 800
    kept_samples: Annotated[int, msgspec.Meta(ge=1, le=10_000)] = 200
    landmark_samples: Annotated[int, msgspec.Meta(ge=10, le=10_000)] = 200
    outlier_share: Share = 1e-3
    correlated_views: Annotated[float, msgspec.Meta(ge=1, le=1000)] = 60.0
    largest_landmark_sd_m: Positive = 4.0
    landmark_jitter_m: Positive = 0.03
    gate: Positive = 4.0
    misses: Annotated[int, msgspec.Meta(ge=1)] = 8
    speed_gain_sd: Share = 0.0
    turn_gain_sd: Share = 0.0
    drift_rad_per_m: Share = 0.0
    motion_bias_time_s: Positive = 30.0
    range_gain_sd: Share = 0.0
    range_bias_time_s: Positive = 300.0
    astray: Annotated[int, msgspec.Meta(ge=2)] = 8
    farthest_m: Positive = 50.0
    attention_base_level: Share = 1.0
    path_spacing_m: Positive = 1.0
    path_variance_per_m: Positive = 1e-4
    heading_variance_per_m: Positive = 1e-6
    heading_variance_per_rad: Positive = 1e-5
    correct: Literal["positions", "heading"] = "heading"
    place_match_sd_m: Positive = 2.0
    place_match_sd_rad: Positive = 0.2
    false_closure: Annotated[float, msgspec.Meta(gt=0, lt=1)] = 1e-3
    synapse_decay_per_m: Positive = 0.2
