"""What the logs of landmarks ask of the codelets, where the user sets nothing."""

from __future__ import annotations

from typing import Any

from cogmap.runtime.config import Sections

RANGE_SHARE = 0.03
"""Standard deviation of a distance that is seen, as a share of it: the paper's (section 5.4)."""

SPEED_SHARE = 0.1
TURN_SHARE = 0.1
"""Those of the gains of wheels that nobody has calibrated: as their noise is taken for."""

DRIFT_RAD_PER_M = 0.05
"""What a heading by such wheels drifts by in a metre."""

UNCALIBRATED: dict[str, Any] = {
    "samples": 1000,
    "kept_samples": 100,
    "landmark_samples": 1000,
    "landmarks": "points",
    "landmark_jitter_m": 0.003,
    "speed_gain_sd": SPEED_SHARE,
    "turn_gain_sd": TURN_SHARE,
    "drift_rad_per_m": DRIFT_RAD_PER_M,
    "range_gain_sd": RANGE_SHARE,
    "anchor": "map",
    "path_spacing_m": 1.0,
    "path_variance_per_m": SPEED_SHARE**2,
    "heading_variance_per_m": DRIFT_RAD_PER_M**2,
    "heading_variance_per_rad": TURN_SHARE**2,
}
"""A robot whose senses nobody has calibrated, among landmarks that are points: its gains may err by
what the noise of its senses is taken for, and views of a point err independently.
"""


def of_points(**changed: Any) -> Sections:
    """Return the settings of such a robot, but for those that are changed. What it has seen is
    kept.
    """
    return {"workspace": {"base_level_decay": 0.0}, "codelets": UNCALIBRATED | changed}
