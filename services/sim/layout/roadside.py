"""The place that a trajectory leads through: a street along it, and its landmarks as buildings that
face it. Pure.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from cogmap.errors import ConfigError
from cogmap.services.sim.layout.catalogue import CATALOGUE
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.plan import Plot, Point, Road
from cogmap.services.sim.trajectory import Line, Trajectory

# From the line to a building's front: more than HALF_WIDTH_M of the robot.
CLEAR_M = 1.0
_KINDS = {kind.name: kind for kind in CATALOGUE}


def along(trajectory: Trajectory, seed: int) -> Place:
    """Return the place around `trajectory`, whose landmarks are named after the catalogue: a road
    for each piece of the line, once if the line repeats it. Raises ConfigError if a landmark would
    stand on the line.
    """
    line = Line(np.array(trajectory.line_m, float))
    points: list[Point] = [(x, y) for x, y in line.points.tolist()]
    roads = [Road("way", start, end) for start, end in dict.fromkeys(pairwise(points))]

    places_m = np.array([(each.x_m, each.y_m) for each in trajectory.landmarks], float)
    places_m = places_m.reshape(-1, 2)
    to_line_m = line.nearest(places_m) - places_m

    plots = []
    for landmark, (x_m, y_m) in zip(trajectory.landmarks, to_line_m.tolist(), strict=True):
        kind = _KINDS[landmark.name]
        away_m = math.hypot(x_m, y_m)
        required_m = kind.depth_m / 2 + CLEAR_M
        if away_m < required_m:
            raise ConfigError(
                f"[sim] the {landmark.name} at ({landmark.x_m:g}, {landmark.y_m:g}) would stand in "
                f"the way: put it {required_m:g} m from the line at least, not {away_m:.1f}"
            )

        # A front looks to the right of its heading: to the line.
        heading_rad = math.remainder(math.atan2(x_m, -y_m), math.tau)
        plots.append(Plot(kind, landmark.x_m, landmark.y_m, heading_rad))

    return Place(seed=seed, roads=tuple(roads), plots=tuple(plots), props=(), start=line.at(0.0))
