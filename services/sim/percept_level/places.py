"""Place recognition without images, with the errors that it was measured to make. Pure."""

from __future__ import annotations

import numpy as np

from cogmap.schemas.sensing import PlaceMatch, Pose
from cogmap.services.sim.percept_level.percepts import PerceptErrors

# Views within this are of one place (`benchmarks perception`: 3 m and 30 degrees, here 20).
MAX_APART_M = 3.0
MAX_TURN_RAD = 0.35
# From which view on a place is recognized; so many last views do not match.
SEQUENCE_FRAMES = 4
RECENT_FRAMES = 20


class PlaceSim:
    """Recognizes places that the robot passes in the same direction a second time, by the views
    that lead up to them.
    """

    def __init__(self, errors: PerceptErrors, seed: int) -> None:
        self._errors = errors
        self._rng = np.random.default_rng([seed, 0x9F])

        self._views: list[tuple[int, int]] = []
        # Columns x, y, heading and frame; the first rows are those of `_views`.
        self._rows = np.zeros((256, 4))
        self._similar_frames = 0

    def recognize(self, frame: int, stamp_ns: int, pose: Pose) -> list[PlaceMatch]:
        """Return the remembered view that this one matches, if any; one near none is remembered.

        By mistake the match is any other view.
        """
        similar = self._similar(frame, pose)
        if similar is None:
            self._similar_frames = 0
            count = len(self._views)
            if count == len(self._rows):
                self._rows = np.vstack([self._rows, np.zeros_like(self._rows)])

            self._rows[count] = (pose.x_m, pose.y_m, pose.heading_rad, frame)
            self._views.append((frame, stamp_ns))
            return []

        self._similar_frames += 1
        if self._similar_frames < SEQUENCE_FRAMES:
            return []

        if self._rng.random() >= self._errors.place_recall:
            return []

        precision = self._errors.place_precision
        is_right = self._rng.random() < precision
        number = similar if is_right else int(self._rng.integers(len(self._views)))
        matched, view_ns = self._views[number]
        return [PlaceMatch(frame=matched, view_ns=view_ns, score=precision)]

    def _similar(self, frame: int, pose: Pose) -> int | None:
        """Return the nearest remembered view of about the same place and heading that is not
        recent.
        """
        if not self._views:
            return None

        rows = self._rows[: len(self._views)]
        apart_m = np.hypot(rows[:, 0] - pose.x_m, rows[:, 1] - pose.y_m)
        turn_rad = np.remainder(rows[:, 2] - pose.heading_rad + np.pi, 2 * np.pi) - np.pi
        is_recent = rows[:, 3] > frame - RECENT_FRAMES

        apart_m[(np.abs(turn_rad) > MAX_TURN_RAD) | is_recent] = np.inf
        nearest = int(apart_m.argmin())
        return nearest if apart_m[nearest] <= MAX_APART_M else None
