"""The buildings and barriers of a town that a camera would see, by the town's ground plan."""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.robot import calibration
from cogmap.services.sim.public import (
    Place,
    Surroundings,
    barriers,
    column_camera,
    outlines,
    town_sensors,
)


class Visibility:
    """A camera's view of a town with all the buildings that it began with."""

    def __init__(self, place: Place) -> None:
        self._plots = place.plots
        self._camera = column_camera.ColumnCamera(calibration())
        self._surroundings = Surroundings(place)
        self._barriers_m = {}
        for name, barrier in barriers(place.roads).items():
            self._barriers_m[name] = outlines([barrier.solid])

    def building(self, at: Floats, number: int) -> bool:
        """Decide whether at least half of a building would be seen from x, y, heading: its middle
        is in the image, and others hide no more than half of it.
        """
        plot = self._plots[number]
        direction_rad = math.atan2(plot.y_m - at[1], plot.x_m - at[0])
        bearing_rad = math.remainder(direction_rad - at[2], math.tau)
        if abs(bearing_rad) > self._camera.half_field_of_view_rad:
            return False

        near = self._surroundings.near(float(at[0]), float(at[1]))
        walls = self._camera.nearest(at, near.walls_m).segment
        shown = near.plot[walls[walls != column_camera.NOTHING]]
        columns = int((shown == number).sum())

        alone = self._camera.nearest(at, near.walls_m[near.plot == number]).segment
        needed = max(town_sensors.MIN_COLUMNS, int((alone != column_camera.NOTHING).sum()) / 2)
        return columns >= needed

    def barrier(self, at: Floats, street: str, reach_m: float) -> bool:
        """Decide whether a barrier that closes a street would be seen, within so many metres."""
        barrier_m = self._barriers_m[street]
        middle_m = barrier_m.reshape(-1, 2).mean(axis=0)
        if np.hypot(*(middle_m - at[:2])) > reach_m:
            return False

        near = self._surroundings.near(float(at[0]), float(at[1]))
        walls = self._camera.nearest(at, near.walls_m).inverse_m
        barrier = self._camera.nearest(at, barrier_m).inverse_m
        return int((barrier > walls).sum()) >= town_sensors.MIN_COLUMNS
