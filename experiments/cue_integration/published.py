"""Metrics that others published of this experiment. They are a simulation's, not people's.

Kessler, Frankenstein and Rothkopf (2024) simulated the experiment of Nardini et al. (2008) with a
model of their own, its noise fitted to human responses. The human values themselves are in no
public file that we know.
"""

from __future__ import annotations

from cogmap.experiments.cue_integration.trial import Condition

SOURCE = "simulation by Kessler et al. 2024"
SD_M = {
    Condition.SELF_MOTION: 0.50,
    Condition.LANDMARKS: 0.40,
    Condition.BOTH: 0.27,
    Condition.CONFLICT: 0.31,
}
RMSE_M = {
    Condition.SELF_MOTION: 0.52,
    Condition.LANDMARKS: 0.38,
    Condition.BOTH: 0.29,
    Condition.CONFLICT: 0.52,
}
