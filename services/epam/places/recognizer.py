"""Places recognized by the sequence of views that leads to them: the paper's future work, for
places without a landmark in sight.

A single view may be ambiguous, so views are accumulated while the robot moves: a Bayes filter (a
hidden Markov model) holds the probability that the robot is where a remembered view was taken, or
somewhere new. From one view to the next the place advances by none to three remembered ones,
whatever the speed. A place that is recognized is not remembered again (Churchill and Newman 2012),
so memory grows with what is new.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Bytes, Singles
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import PlaceMatch, RememberedView
from cogmap.services.epam.places.descriptor import (
    DESCRIPTOR_BYTES,
    UNSHIFTED,
    descriptors,
    has_near_structure,
    unit_vectors,
)

# Chosen on laps in the towns of seeds 2007 to 2010, in which every threshold of at least 0.6 gave
# no false match.
MATCH_THRESHOLD = 0.9
P_ADVANCE = (0.1, 0.4, 0.35, 0.15)
P_FOUND = 0.02
P_LOST = 0.03
LOG_ODDS_SLOPE = 15.0
EVEN_SIMILARITY = 0.7
MAX_LOG_ODDS = 3.0
NEIGHBOURS = 4
# Consecutive views that are more similar show a robot at rest.
SIMILARITY_AT_REST = 0.97
# So many last views do not match.
RECENT_VIEWS = 30
# Of views: some hours of driving; each takes 2 KB.
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
        self._vectors: Singles = np.empty((INITIAL_CAPACITY, DESCRIPTOR_BYTES), np.float32)
        self._step_of_view = np.empty(0, np.int64)

        self._belief = np.empty(0)
        self._p_new = 1.0

        self._step = 0
        self._last_vector: Singles | None = None
        self._matches: list[PlaceMatch] = []

    @property
    def all(self) -> Iterator[RememberedView]:
        """Return every view remembered, the oldest first."""
        return iter(self._views)

    def observe(
        self, frame: int, view_ns: int, image: Bytes, depth_m: Singles, learning: bool = True
    ) -> tuple[list[PlaceMatch], list[RememberedView]]:
        """Return at most one remembered view that this one matches, and the view itself if it is
        remembered, which needs `learning`.

        The image is uint8 (h, w, 3) with its depth (h, w), 0 unknown. At rest the last match is
        returned again. A view without near structure or contrast shows no place.
        """
        codes = descriptors(image) if has_near_structure(depth_m) else None
        if codes is None:
            return [], []

        vectors = unit_vectors(codes)
        vector = vectors[UNSHIFTED]
        last = self._last_vector
        if last is not None and float(vector @ last) > SIMILARITY_AT_REST:
            return list(self._matches), []

        self._last_vector = vector
        self._step += 1
        self._update_belief(vectors)
        self._matches = self._likeliest_match()
        if self._matches or not learning:
            return list(self._matches), []

        view = RememberedView(frame=frame, view_ns=view_ns, code=Array.of(codes[UNSHIFTED]))
        self._remember([view], vectors[UNSHIFTED : UNSHIFTED + 1])
        return [], [view]

    def restore(self, views: Iterable[RememberedView]) -> None:
        """Remember `views` again, the oldest first; the robot is where the last one was taken.
        Raises MessageError if a code has another type or size.
        """
        restored = list(views)
        if not restored:
            return

        codes = []
        for view in restored:
            code = view.code
            if (code.dtype, code.shape) != ("|u1", (DESCRIPTOR_BYTES,)):
                raise MessageError(
                    f"remembered view {view.frame}: expected a uint8 code of {DESCRIPTOR_BYTES}, "
                    f"got {code.dtype} {code.shape}; delete EPAM's journal"
                )
            codes.append(code.numpy().astype(np.uint8, copy=False))

        vectors = unit_vectors(np.stack(codes))
        self._step += len(restored)
        self._remember(restored, vectors)
        self._last_vector = vectors[-1]

    def _update_belief(self, vectors: Singles) -> None:
        """Advance the filter by one step: prediction, then the evidence of `vectors`, by the most
        similar turn of the view.
        """
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
        similarities = self._vectors[:count] @ vectors.T
        highest = similarities.max(axis=1).astype(np.float64)
        log_odds = LOG_ODDS_SLOPE * (highest - EVEN_SIMILARITY)
        ratios = np.exp(log_odds.clip(-MAX_LOG_ODDS, MAX_LOG_ODDS))
        ratios[self._step_of_view > self._step - RECENT_VIEWS] = 0.0

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
            larger = np.empty((2 * count, DESCRIPTOR_BYTES), np.float32)
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
        self._belief = self._belief[oldest:]
