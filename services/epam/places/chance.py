"""How similar views of different places are by chance, estimated from all comparisons so far, and
how far beyond that a similarity is.

No threshold of similarity fits two cameras or two lights: the same place by day and by night is
less alike than two places in one light. So each remembered view is compared with what it usually
has in common with others, and each new view with what it has in common with all remembered ones.
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Floats

# A remembered view's mean and variance follow the last so many comparisons, and begin as if there
# had been PRIOR_VIEWS with the usual variance around a mean of 0, which standardized vectors have.
COMPARED_VIEWS = 60
PRIOR_VIEWS = 20
# The usual variance, before there were comparisons, and how many they last: that of vectors of some
# hundred independent values.
PRIOR_VARIANCE = 0.08**2
USUAL_VIEWS = 200


class Chance:
    """Running statistics of the similarities to each remembered view, the oldest first."""

    def __init__(self) -> None:
        self._mean = np.empty(0)
        self._variance = np.empty(0)
        self._count = np.empty(0)
        self._usual_variance = PRIOR_VARIANCE
        self._compared = 0

    def scores(self, similarities: Floats) -> Floats:
        """Return how many standard deviations the similarity to each of the oldest remembered views
        is over that of different places, and count it.
        """
        count = len(similarities)
        if not count:
            return np.empty(0)

        mean = self._mean[:count]
        variance = self._variance[:count]
        beyond = similarities - mean

        # Of a few views the mean is as good as unknown; so is their variance.
        known = count / (count + PRIOR_VIEWS)
        excess = beyond - known * beyond.mean()
        of_view = known * np.mean(excess**2) + (1 - known) * self._usual_variance
        scores = excess / np.sqrt((of_view + variance) / 2)

        self._count[:count] += 1
        comparisons = np.minimum(PRIOR_VIEWS + self._count[:count], COMPARED_VIEWS)
        mean += beyond / comparisons
        variance += (excess**2 - variance) / comparisons
        self._compared += 1
        usual_views = PRIOR_VIEWS + min(self._compared, USUAL_VIEWS)
        self._usual_variance += (float(np.mean(excess**2)) - self._usual_variance) / usual_views
        return np.asarray(scores)

    def remember(self, count: int) -> None:
        """Begin to estimate for `count` more views."""
        self._mean = np.concatenate([self._mean, np.zeros(count)])
        self._variance = np.concatenate([self._variance, np.full(count, self._usual_variance)])
        self._count = np.concatenate([self._count, np.zeros(count)])

    def forget(self, count: int) -> None:
        """Forget the `count` oldest views."""
        self._mean = self._mean[count:]
        self._variance = self._variance[count:]
        self._count = self._count[count:]
