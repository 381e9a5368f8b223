"""What could be seen of a town from a true pose, by its ground plan: with all buildings that once
stood there, and with barriers.
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Floats
from services.sim.driven.camera import NOTHING, ColumnCamera
from services.sim.driven.sensors import MIN_COLUMNS
from services.sim.driven.surroundings import Surroundings
from services.sim.layout.barriers import barriers
from services.sim.layout.boundaries import outlines
from services.sim.layout.place import Place
from services.sim.rendering.camera import calibration


class Eyes:
    """A camera in the town as it was built."""

    def __init__(self, place: Place) -> None:
        self._camera = ColumnCamera(calibration())
        self._surroundings = Surroundings(place)
        self._barriers_m = {}
        for name, barrier in barriers(place.roads).items():
            self._barriers_m[name] = outlines([barrier.solid])

    def buildings(self, at: Floats) -> set[int]:
        """The buildings that no other hides, by their places in the town, from x, y, heading."""
        near = self._surroundings.near(float(at[0]), float(at[1]))
        walls = self._camera.nearest(at, near.walls_m)
        shown = near.plot[walls.segment[walls.segment != NOTHING]]
        columns = np.bincount(shown, minlength=1)
        return {*np.flatnonzero(columns >= MIN_COLUMNS).tolist()}

    def sees_barrier(self, at: Floats, street: str, reach_m: float) -> bool:
        """Whether a barrier would be seen that closes a street, within so many metres."""
        barrier_m = self._barriers_m[street]
        middle_m = barrier_m.reshape(-1, 2).mean(axis=0)
        if np.hypot(*(middle_m - at[:2])) > reach_m:
            return False

        near = self._surroundings.near(float(at[0]), float(at[1]))
        walls = self._camera.nearest(at, near.walls_m).inverse_m
        barrier = self._camera.nearest(at, barrier_m).inverse_m
        return int((barrier > walls).sum()) >= MIN_COLUMNS
