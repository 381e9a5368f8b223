"""The peer of sub-maps: scikit-learn's mixture, and its index of agreement."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from benchmarks.optional import scikit_learn
from cogmap.geometry.arrays import Floats, Indices

MAX_COMPONENTS = 24
MAX_ITERATIONS = 1000
SEED = 0


def adjusted_rand_index(truth: Indices, labels: Indices) -> float:
    """Return the adjusted Rand index of two partitions (n,): 1 if they are the same, about 0 if
    they agree by chance alone.
    """
    metrics: Any = scikit_learn().metrics
    return float(metrics.adjusted_rand_score(truth, labels))


def gaussian_mixture(positions_m: Floats) -> Indices:
    """(n,): the labels that a Gaussian mixture with a Dirichlet-process prior gives to positions,
    (n, 2), by variational inference.
    """
    mixture: Any = scikit_learn().mixture
    model = mixture.BayesianGaussianMixture(
        n_components=min(MAX_COMPONENTS, len(positions_m)),
        weight_concentration_prior_type="dirichlet_process",
        max_iter=MAX_ITERATIONS,
        random_state=SEED,
    )
    with warnings.catch_warnings():
        # It warns if it has not converged after all iterations, and is taken as it is.
        warnings.simplefilter("ignore")
        labels = model.fit_predict(positions_m)

    return np.asarray(labels, np.int64)
