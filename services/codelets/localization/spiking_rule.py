"""Localization by spikes (paper §5.4, figure 4): pure functions of samples, which are the poses
that grid cells and head-direction cells represent, one in each gamma cycle.

They move as the paper's own samples do (`paper_rule.moved`), from one pose. Landmarks are attended
to one after another: place cells fire where a landmark's vector cells coincide with path
integration, and the phases of the cycles are reset to that firing, each to one spike. Before the
next step all are reset to one pose, the mean of the spikes, as in table 1.
"""

from __future__ import annotations

import numpy as np

from cogmap.estimation.spiking.coincidence import fire
from cogmap.geometry.arrays import Floats, Singles
from cogmap.schemas.nodes import POSE_COLUMNS
from cogmap.services.codelets.localization.measurement_model import Measurements, compare
from cogmap.services.codelets.localization.motion_model import GAINS
from cogmap.services.codelets.localization.sampling import resample

MIN_SPIKES = 10
"""Fewer spikes reset nothing: a handful would be all that is left of the distribution."""


def corrected(
    samples: Floats, seen: Measurements, rng: np.random.Generator
) -> tuple[Floats, float]:
    """Reset the phases (n, 7) to the place cells that fire for each landmark in view, one after
    another. Return them, and the mean over the landmarks of spikes a cycle, at most 1 each: 0 if
    none makes place cells fire, and all stay.
    """
    shares = []
    for number in range(len(seen.labels)):
        landmark = seen.select(number)

        def tuning(poses: Floats, landmark: Measurements = landmark) -> Singles:
            # Of the range gain there is nothing to be learned: it is 0.
            deviations = compare(_without_gains(poses), landmark).squared
            return np.asarray(np.exp(deviations / -2))

        spikes = fire(samples[:, :POSE_COLUMNS], tuning, rng)
        resets = len(spikes) >= MIN_SPIKES
        if resets:
            samples = _without_gains(resample(spikes, len(samples), 0.0, rng))
        shares.append(min(1.0, len(spikes) / len(samples)) if resets else 0.0)

    return samples, float(np.mean(shares))


def _without_gains(poses: Floats) -> Floats:
    """Return (n, 7) samples of (n, 3) poses, all gains 0."""
    return np.hstack([poses, np.zeros((len(poses), GAINS))])
