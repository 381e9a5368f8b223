"""How similar views of different places are by chance, and how far beyond that a similarity is.

No threshold of similarity fits two cameras or two lights: one place by day and by night is less
alike than two places in one light. So each view is judged by its own similarities to all that is
remembered, nearly all of which are of other places. The more there are, the more the best of them
stands out by chance: that is estimated of the views of new places. A view of a known place, which
may not be recognized yet, is told from those by one similarity that is far beyond all others.
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Floats

# The variance that is usual counts as much as so many remembered views: of a few views it is as
# good as unknown.
PRIOR_VIEWS = 20
# Before there were comparisons, that of vectors of some hundred independent values; later the mean
# over the last so many views.
PRIOR_VARIANCE = 0.08**2
USUAL_VIEWS = 200
# A similarity is compared with those to so many views remembered around it: of about one drive, in
# one light.
WINDOW_VIEWS = 120
# The best score of a view of a new place, before there were any, how many views it follows, and how
# much one may count beyond it: places that are known, but not recognized yet, have far higher ones.
PRIOR_BEST = 2.0
BEST_VIEWS = 100
MOST_BEYOND = 0.5
# The greatest similarity of a view of a known place is so many standard deviations beyond the
# median of all. On the towns of seeds 2007 and 2008, on which it was chosen, 84 and 91 % of the
# views of known places were, in another light, and 0 and 1 % of those of new ones.
KNOWN_BEYOND = 7.0
# The standard deviation of normal values over the median of what they differ from their median.
# A few that are far off do not change it: places that were remembered on several laps.
SD_OVER_MEDIAN = 1.4826


class Chance:
    """The usual variance of similarities, and `best`, the usual best score of a view of a new
    place, as of the comparisons so far.
    """

    def __init__(self) -> None:
        self._variance = PRIOR_VARIANCE
        self._views = 0
        self.best = PRIOR_BEST

    def add_best(self, score: float) -> None:
        """Count the best score of a view of a new place."""
        self.best += (min(score, self.best + MOST_BEYOND) - self.best) / BEST_VIEWS

    def judge(self, similarities: Floats) -> tuple[Floats, bool]:
        """Return how many standard deviations each similarity of a view, to the remembered ones in
        their order, is over those to different places, and whether the place is known. Count them.

        Those to a known place widen the spread around it, as do those of its other views; they
        leave the median as it is, and the spread about that.
        """
        count = len(similarities)
        if not count:
            return np.empty(0), False

        around = self._beyond_those_around(similarities)
        beyond = self._beyond_median(similarities)
        is_known = bool(beyond.max() > KNOWN_BEYOND)
        return (beyond if is_known else around), is_known

    def _beyond_median(self, similarities: Floats) -> Floats:
        count = len(similarities)
        usual = np.median(similarities)
        spread = SD_OVER_MEDIAN * np.median(np.abs(similarities - usual))
        known = count / (count + PRIOR_VIEWS)
        variance = known * spread**2 + (1 - known) * self._variance
        return np.asarray((similarities - usual) / np.sqrt(variance))

    def _beyond_those_around(self, similarities: Floats) -> Floats:
        count = len(similarities)

        # The window around each view, which ends where memory ends.
        width = min(count, WINDOW_VIEWS)
        first = np.clip(np.arange(count) - width // 2, 0, count - width)
        sums = np.concatenate([[0.0], np.cumsum(similarities)])
        squares = np.concatenate([[0.0], np.cumsum(similarities**2)])
        mean = (sums[first + width] - sums[first]) / width
        square = (squares[first + width] - squares[first]) / width

        known = width / (width + PRIOR_VIEWS)
        expected = known * mean
        found = square - 2 * expected * mean + expected**2
        variance = known * np.maximum(found, 0) + (1 - known) * self._variance

        self._views = min(self._views + 1, USUAL_VIEWS)
        self._variance += (float(found.mean()) - self._variance) / (PRIOR_VIEWS + self._views)
        return np.asarray((similarities - expected) / np.sqrt(variance))
