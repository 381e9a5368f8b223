"""What codes are usually like, as learned from those seen so far: each view is judged by what sets
it apart.

What all views of a drive have in common, its light, its camera, its kind of street, says nothing of
which place is seen. The mean of each value is subtracted, and channels that go together are made to
count once: their covariance is whitened, as for image retrieval (Jégou and Chum 2012).
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Bytes, Floats, Singles
from cogmap.services.epam.backbone import CHANNELS
from cogmap.services.epam.places.descriptor import CODE_BYTES, LEVELS, MIDDLE, PATCHES

# Of views: how long the mean remembers, and the covariance, which needs more of them. Half a
# minute of driving and more, so that they follow the light.
MEAN_VIEWS = 40
COVARIANCE_VIEWS = 120
# The mean of the backbone's photographs, and the variance that averages over patches have there,
# count as much as so many views.
PRIOR_MEAN_VIEWS = 10
PRIOR_COVARIANCE_VIEWS = 30
PRIOR_VARIANCE = 0.5
# Of the mean variance, added to that of each direction: what hardly varies is noise.
NOISE_SHARE = 0.1
# The whitening is computed anew every so many views: it takes a millisecond.
WHITENED_EVERY = 8


class Standard:
    """The running mean and covariance of codes; the same codes in the same order give the same."""

    def __init__(self) -> None:
        self._views = 0
        self._mean = np.zeros((CHANNELS, PATCHES))
        self._covariance = PRIOR_VARIANCE * np.eye(CHANNELS)
        self._whitening = _whitening(self._covariance)

    def change(self, code: Bytes, other: Bytes) -> float:
        """Return how much `code` differs from `other`, in standard deviations of what was seen."""
        difference = _values(code) - _values(other)
        variance = np.trace(self._covariance) / CHANNELS
        return float(np.sqrt(np.mean(difference**2) / variance))

    def begin_drive(self) -> None:
        """Begin a drive, in another light perhaps: what was usual before counts as little as what
        is usual on photographs, and gives way as fast.
        """
        self._views = 0

    def add(self, code: Bytes) -> Singles:
        """Count `code`, and return its vector of length 1, float32 (CODE_BYTES,): the inner product
        of two is the similarity of two views.
        """
        values = _values(code)
        mean_views = min(PRIOR_MEAN_VIEWS + self._views + 1, MEAN_VIEWS)
        covariance_views = min(PRIOR_COVARIANCE_VIEWS + self._views + 1, COVARIANCE_VIEWS)
        deviation = values - self._mean
        self._mean += deviation / mean_views

        spread = (1 - 1 / mean_views) * (deviation @ deviation.T) / PATCHES
        self._covariance += (spread - self._covariance) / covariance_views
        if self._views % WHITENED_EVERY == 0:
            self._whitening = _whitening(self._covariance)
        self._views += 1

        whitened = (self._whitening @ (values - self._mean)).ravel()
        length = max(float(np.linalg.norm(whitened)), 1e-9)
        return np.asarray(whitened / length, np.float32)


def _values(code: Bytes) -> Floats:
    """Return the features that a code stands for, (CHANNELS, PATCHES)."""
    assert code.shape == (CODE_BYTES,)
    return (code.astype(np.float64).reshape(CHANNELS, PATCHES) - MIDDLE) / LEVELS


def _whitening(covariance: Floats) -> Floats:
    """Return the symmetric matrix that makes the channels independent, with equal variances."""
    variances, directions = np.linalg.eigh(covariance)
    kept = np.maximum(variances, 0) + NOISE_SHARE * variances.mean()
    return np.asarray(directions / np.sqrt(kept) @ directions.T)
