"""Places recognised by the views that lead to them: the paper's future work, for where no landmark
is in sight.

One look may deceive, so looks are gathered as the robot goes on: a Bayes filter (a hidden Markov
model) holds how probable it is that the robot is again where a remembered view was taken, or
somewhere new. From one view to the next the place moves on by none to three remembered ones,
whatever the speed. A place that is recognised is not remembered anew (Churchill and Newman 2012):
memory grows with what is new.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated

import msgspec
import numpy as np

from cogmap.errors import MessageError
from schemas.array import Array
from schemas.sensing import PlaceMatch, RememberedView
from services.epam.places.descriptor import (
    CODE_BYTES,
    MIDDLE,
    Code,
    Depth,
    Image,
    Vectors,
    something_near,
    vectors,
    view_codes,
)

# Chosen on laps in the towns of seeds 2007 to 2010, where every threshold from 0.6 on was right in
# all it said.
MOVES = (0.1, 0.4, 0.35, 0.15)
FOUND = 0.02
LOST = 0.03
SLOPE = 15.0
EVEN = 0.7
MOST_EVIDENCE = 3.0
BESIDE = 4
FEWEST = 256
FORGOTTEN_AT_ONCE = 0.05


class PlaceSettings(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A match is said from `threshold` on. Views as alike as `still` show the robot at rest, or
    nearly.

    The `recent` last views are no places to come back to; of more than `capacity` the oldest are
    forgotten.
    """

    threshold: Annotated[float, msgspec.Meta(gt=0, le=1)] = 0.9
    still: Annotated[float, msgspec.Meta(gt=0, le=1)] = 0.97
    recent: Annotated[int, msgspec.Meta(ge=1, le=10_000)] = 30
    capacity: Annotated[int, msgspec.Meta(ge=100, le=100_000)] = 20_000


class PlaceMemory:
    """The views of places where the robot has been, and how probable it is that it is at each of
    them again.
    """

    def __init__(self, settings: PlaceSettings | None = None) -> None:
        self._settings = settings or PlaceSettings()
        self._views: list[RememberedView] = []
        self._vectors: Vectors = np.empty((FEWEST, CODE_BYTES), np.float32)
        self._taken_at = np.empty(0, np.int64)
        self._belief = np.empty(0)
        self._somewhere_new = 1.0
        self._step = 0
        self._last: Vectors | None = None
        self._matches: list[PlaceMatch] = []

    @property
    def all(self) -> Iterator[RememberedView]:
        """Every view remembered, the oldest first."""
        return iter(self._views)

    def see(
        self, frame: int, view_ns: int, image: Image, depth_m: Depth
    ) -> tuple[list[PlaceMatch], list[RememberedView]]:
        """Which remembered view this one matches, one at most, and it itself if it is remembered.

        The image is uint8 (h, w, 3) with its depth (h, w), 0 unknown. At rest the last match
        stands. Where nothing stands near or there is nothing to see, it is a view of no place.
        """
        codes = view_codes(image) if something_near(depth_m) else None
        if codes is None:
            return [], []
        seen = vectors(codes)
        if self._last is not None and float(seen[MIDDLE] @ self._last) > self._settings.still:
            return list(self._matches), []
        self._last = seen[MIDDLE]
        self._step += 1
        self._go_on(seen)
        self._matches = self._probable()
        if self._matches:
            return list(self._matches), []
        view = RememberedView(frame=frame, view_ns=view_ns, code=Array.of(codes[MIDDLE]))
        self._remember([view], seen[MIDDLE : MIDDLE + 1])
        return [], [view]

    def recall(self, views: Iterable[RememberedView]) -> None:
        """Remember `views` again, the oldest first. Raises MessageError where a code is none of
        ours.
        """
        again = list(views)
        if again:
            seen = vectors(np.stack([_code(view) for view in again]))
            self._step += len(again)
            self._remember(again, seen)

    def _go_on(self, seen: Vectors) -> None:
        """One step of the filter: the place moves on, and what is `seen`, turned a little or not,
        speaks for it.
        """
        count = len(self._views)
        if not count:
            return
        alike = (self._vectors[:count] @ seen.T).max(axis=1).astype(np.float64)
        evidence = np.exp(np.clip(SLOPE * (alike - EVEN), -MOST_EVIDENCE, MOST_EVIDENCE))
        evidence[self._taken_at > self._step - self._settings.recent] = 0.0
        moved = np.zeros(count)
        for by, share in enumerate(MOVES[:count]):
            moved[by:] += share * self._belief[: count - by]
        kept = (1 - LOST) * moved.sum()
        found = FOUND * self._somewhere_new
        belief = ((1 - LOST) * moved + found / count) * evidence
        somewhere_new = 1.0 - kept - found
        total = belief.sum() + somewhere_new
        self._belief = belief / total
        self._somewhere_new = somewhere_new / total

    def _probable(self) -> list[PlaceMatch]:
        """The likeliest remembered view, if the probability of it and those beside it comes to the
        threshold.
        """
        if not self._views:
            return []
        best = int(self._belief.argmax())
        score = min(1.0, float(self._belief[max(0, best - BESIDE) : best + BESIDE + 1].sum()))
        if score < self._settings.threshold:
            return []
        view = self._views[best]
        return [PlaceMatch(frame=view.frame, view_ns=view.view_ns, score=score)]

    def _remember(self, views: list[RememberedView], seen: Vectors) -> None:
        """Keep the last views; where they become too many, the oldest go, several at once since all
        others move up.
        """
        before = len(self._views)
        count = len(self._views) + len(views)
        if count > len(self._vectors):
            larger = np.empty((2 * count, CODE_BYTES), np.float32)
            larger[:before] = self._vectors[:before]
            self._vectors = larger
        self._views += views
        self._vectors[before:count] = seen
        steps = np.arange(self._step - len(views), self._step) + 1
        self._taken_at = np.concatenate([self._taken_at, steps])
        self._belief = np.concatenate([self._belief, np.zeros(len(views))])
        if count > self._settings.capacity:
            self._forget(count - round(self._settings.capacity * (1 - FORGOTTEN_AT_ONCE)))

    def _forget(self, oldest: int) -> None:
        """Forget so many of the oldest views."""
        count = len(self._views)
        self._somewhere_new += float(self._belief[:oldest].sum())
        self._vectors[: count - oldest] = self._vectors[oldest:count]
        self._views = self._views[oldest:]
        self._taken_at = self._taken_at[oldest:]
        self._belief = self._belief[oldest:]


def _code(view: RememberedView) -> Code:
    if (view.code.dtype, view.code.shape) != ("|u1", (CODE_BYTES,)):
        raise MessageError(
            f"remembered view {view.frame}: expected a uint8 code of {CODE_BYTES}, "
            f"got {view.code.dtype} {view.code.shape}; delete EPAM's journal"
        )
    return view.code.numpy().astype(np.uint8, copy=False)
