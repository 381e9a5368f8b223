"""Places recognized by the sequence of views that leads to them: the paper's future work, for
places without a landmark in sight.

A single view may be ambiguous, so views are accumulated while the robot moves: a Bayes filter (a
hidden Markov model) holds the probability that the robot is where a remembered view was taken, or
somewhere new. How likely a view is at a place follows from how far its similarity is beyond what
different places have in common by chance (chance.py), which is estimated on the way: it is another
in every town, light and camera. From one view to the next the place advances by none to three
remembered ones, whatever the speed. A place that is recognized is not remembered again (Churchill
and Newman 2012), nor is one that is known, while it is not decided which: so memory grows with
what is new.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Bytes, Singles
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import PlaceMatch, RememberedView
from cogmap.services.epam.places.chance import Chance
from cogmap.services.epam.places.descriptor import CODE_BYTES
from cogmap.services.epam.places.standard import Standard

MATCH_THRESHOLD = 0.9
# By one on average, as memory has the spacing of views, or a little more, where it has gaps.
P_ADVANCE = (0.2, 0.5, 0.2, 0.1)
P_FOUND = 0.01
P_LOST = 0.02
# A score so far below the best of a new place is as likely at this place as at another. And what
# one more adds to the logarithm of the odds. That is far less than for independent views: places
# that look alike do so for several views, by three standard deviations, so it must last for longer.
# Chosen on the corridor of Milford (2013), where the same place has three on another walk, and on
# the towns of seeds 2007 to 2009, where it has seven in another light.
EVEN_BELOW_BEST = 0.3
LOG_ODDS_SLOPE = 0.6
MIN_LOG_ODDS = -3.0
MAX_LOG_ODDS = 3.0
NEIGHBOURS = 4
# A view that differs less from the last, in standard deviations, shows a robot at rest.
CHANGE_AT_REST = 0.25
# So many last views do not match.
RECENT_VIEWS = 30
# Of views: some hours of driving; each takes 5 KB.
CAPACITY = 20_000
INITIAL_CAPACITY = 256
# Several are forgotten at once, since all other vectors move up.
FORGOTTEN_SHARE = 0.05


class PlaceRecognizer:
    """The views remembered, at most `capacity`, the oldest being forgotten, and the probability
    that the robot is at each of them again.
    """

    def __init__(self, capacity: int = CAPACITY) -> None:
        self._capacity = capacity
        self._views: list[RememberedView] = []
        self._vectors: Singles = np.empty((INITIAL_CAPACITY, CODE_BYTES), np.float32)
        self._step_of_view = np.empty(0, np.int64)
        self._standard = Standard()
        self._chance = Chance()
        self._is_restored = False

        self._belief = np.empty(0)
        self._p_new = 1.0

        self._step = 0
        self._last_code: Bytes | None = None
        self._nearest: int | None = None
        self._best_score: float | None = None
        self._is_known = False
        self._matches: list[PlaceMatch] = []

    @property
    def all(self) -> Iterator[RememberedView]:
        """Return every view remembered, the oldest first."""
        return iter(self._views)

    @property
    def nearest(self) -> RememberedView | None:
        """Return the view that the last one is most like, by itself, of those that may match."""
        return None if self._nearest is None else self._views[self._nearest]

    def observe(
        self, frame: int, view_ns: int, code: Bytes | None, learning: bool = True
    ) -> tuple[list[PlaceMatch], list[RememberedView]]:
        """Return at most one remembered view that this one matches, and the view itself if it is
        remembered, which needs `learning`.

        `code` is uint8 (CODE_BYTES,), None of a view that shows no place. At rest the last match is
        returned again.
        """
        if code is None:
            return [], []

        if self._is_restored:
            self._standard.begin_drive()
            self._is_restored = False

        last = self._last_code
        if last is not None and self._standard.change(code, last) < CHANGE_AT_REST:
            return list(self._matches), []

        self._last_code = code
        self._step += 1
        vector = self._standard.add(code)
        self._update_belief(vector)
        self._matches = self._likeliest_match()
        is_known = self._is_known or bool(self._matches)
        if not is_known and self._best_score is not None:
            self._chance.add_best(self._best_score)
        if is_known or not learning:
            return list(self._matches), []

        view = RememberedView(frame=frame, view_ns=view_ns, code=Array.of(code))
        self._remember([view], vector[None])
        return [], [view]

    def restore(self, views: Iterable[RememberedView]) -> None:
        """Remember `views` again, the oldest first, before another drive; the robot is where the
        last one was taken. Raises MessageError if a code has another type or size.
        """
        restored = list(views)
        if not restored:
            return

        codes = []
        for view in restored:
            code = view.code
            if (code.dtype, code.shape) != ("|u1", (CODE_BYTES,)):
                raise MessageError(
                    f"remembered view {view.frame}: expected a uint8 code of {CODE_BYTES}, "
                    f"got {code.dtype} {code.shape}; delete EPAM's journal"
                )
            codes.append(code.numpy().astype(np.uint8, copy=False))

        vectors = np.stack([self._standard.add(code) for code in codes])
        self._step += len(restored)
        self._remember(restored, vectors)
        self._last_code = codes[-1]
        self._is_restored = True

    def _update_belief(self, vector: Singles) -> None:
        """Advance the filter by one step: prediction, then the evidence of `vector`."""
        if not self._views:
            return

        # The robot has advanced by none to three remembered views.
        count = len(self._views)
        predicted = np.zeros(count)
        for steps, p_advance in enumerate(P_ADVANCE[:count]):
            predicted[steps:] += p_advance * self._belief[: count - steps]

        found = P_FOUND * self._p_new
        p_new = 1.0 - (1 - P_LOST) * predicted.sum() - found

        prior = (1 - P_LOST) * predicted + found / len(predicted)

        # How much likelier each remembered view's place makes the observed one than another place;
        # recent views do not match.
        old = int(np.searchsorted(self._step_of_view, self._step - RECENT_VIEWS, side="right"))
        similarities = (self._vectors[:old] @ vector).astype(np.float64)
        self._nearest = int(similarities.argmax()) if old else None
        scores, self._is_known = self._chance.judge(similarities)
        self._best_score = float(scores.max()) if old else None
        log_odds = LOG_ODDS_SLOPE * (scores - self._chance.best + EVEN_BELOW_BEST)

        # The limit is of the likeliest: cut off one by one, its neighbours would be as likely.
        beyond = max(0.0, float(log_odds.max(initial=0.0)) - MAX_LOG_ODDS)
        ratios = np.zeros(count)
        ratios[:old] = np.exp(np.maximum(log_odds - beyond, MIN_LOG_ODDS))

        belief = prior * ratios
        total = belief.sum() + p_new
        self._belief = belief / total
        self._p_new = p_new / total

    def _likeliest_match(self) -> list[PlaceMatch]:
        """Return the likeliest remembered view, if its probability with its neighbours' reaches the
        threshold.
        """
        if not self._views:
            return []

        best = int(self._belief.argmax())
        neighbours = slice(max(0, best - NEIGHBOURS), best + NEIGHBOURS + 1)
        score = min(1.0, float(self._belief[neighbours].sum()))
        if score < MATCH_THRESHOLD:
            return []

        view = self._views[best]
        return [PlaceMatch(frame=view.frame, view_ns=view.view_ns, score=score)]

    def _remember(self, views: list[RememberedView], vectors: Singles) -> None:
        before = len(self._views)
        count = before + len(views)
        if count > len(self._vectors):
            larger = np.empty((2 * count, CODE_BYTES), np.float32)
            larger[:before] = self._vectors[:before]
            self._vectors = larger

        self._views += views
        self._vectors[before:count] = vectors
        steps = np.arange(self._step - len(views), self._step) + 1
        self._step_of_view = np.concatenate([self._step_of_view, steps])
        self._belief = np.concatenate([self._belief, np.zeros(len(views))])
        if count <= self._capacity:
            return

        oldest = count - round(self._capacity * (1 - FORGOTTEN_SHARE))
        self._p_new += float(self._belief[:oldest].sum())
        kept = self._vectors[oldest:count]
        self._vectors[: len(kept)] = kept
        self._views = self._views[oldest:]
        self._step_of_view = self._step_of_view[oldest:]
        self._nearest = None
        self._belief = self._belief[oldest:]
