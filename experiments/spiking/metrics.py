"""The metrics of walks by spikes: errors against the truth, and distances from the exact
posterior.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cogmap.experiments.spiking.recursion import Measured
from cogmap.geometry.arrays import Floats

Metrics = dict[str, float]


def walk_metrics(walks: Sequence[Measured]) -> Metrics:
    """Return by rule, over all steps of all walks, the root mean square error against the truth;
    and beside the exact posterior, on average, the total variation distance, the error of the mean
    in exact standard deviations, the standard deviation over the exact one, and the number of
    samples. `..._sd` is over the walks.
    """
    metrics: Metrics = {
        "rmse_exact_m": _rms_m([each.exact_m - each.walk.true_m for each in walks]),
        "rmse_path_integration_m": _rms_m([each.alone_m - each.walk.true_m for each in walks]),
    }
    for rule in walks[0].tracks:
        tracks = [each.tracks[rule] for each in walks]
        errors_m = [each.tracks[rule].mean_m - each.walk.true_m for each in walks]
        distances = np.array([track.distance.mean() for track in tracks])

        metrics[f"rmse_{rule}_m"] = _rms_m(errors_m)
        metrics[f"total_variation_{rule}"] = float(distances.mean())
        metrics[f"total_variation_{rule}_sd"] = float(distances.std())
        metrics[f"mean_error_{rule}"] = _mean([track.mean_error_sd for track in tracks])
        metrics[f"sd_ratio_{rule}"] = _mean([track.sd_ratio for track in tracks])
        metrics[f"samples_{rule}"] = _mean([track.samples for track in tracks])

    is_corrected = [bool(borders) for each in walks for borders in each.walk.borders]
    metrics["corrected_share"] = float(np.mean(is_corrected))
    return metrics


def _rms_m(errors_m: Sequence[Floats]) -> float:
    """Return the root mean square length of (n, 2) errors, those of all walks."""
    squared_m2 = np.square(np.concatenate(errors_m)).sum(axis=1)
    return float(np.sqrt(squared_m2.mean()))


def _mean(values: Sequence[Floats]) -> float:
    return float(np.concatenate(values).mean())
