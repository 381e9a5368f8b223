"""What the logs of landmarks ask of the codelets, where the user sets nothing."""

from __future__ import annotations

from cogmap.runtime.config import Sections
from cogmap.services.player.landmark_logs.wheels import WheelNoise

RANGE_SHARE = 0.03
"""Standard deviation of a distance that is seen, as a share of it: the paper's (section 5.4)."""

DRIFT_RAD_PER_M = 0.05
"""What a heading by wheels that nobody has calibrated drifts by in a metre."""


def of_points(noise: WheelNoise, spacing_m: float) -> Sections:
    """Return the settings of a robot whose senses nobody has calibrated, among landmarks that are
    points: its gains may err by what the noise of its senses is taken for, views of a point err
    independently, and the path has a place every `spacing_m`. What it has seen is kept.
    """
    return {
        "workspace": {"base_level_decay": 0.0},
        "codelets": {
            "samples": 1000,
            "kept_samples": 100,
            "landmark_samples": 1000,
            "correlated_views": 1.0,
            "landmarks": "points",
            "landmark_jitter_m": 0.003,
            "speed_gain_sd": noise.speed,
            "turn_gain_sd": noise.turn,
            "drift_rad_per_m": DRIFT_RAD_PER_M,
            "range_gain_sd": RANGE_SHARE,
            "anchor": "map",
            "path_spacing_m": spacing_m,
            "path_variance_per_m": noise.speed**2,
            "heading_variance_per_m": DRIFT_RAD_PER_M**2,
            "heading_variance_per_rad": noise.turn**2,
        },
    }
