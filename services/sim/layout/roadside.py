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
from cogmap.services.sim.trajectory import Landmark, Line, Trajectory

CLEAR_M = 1.0
_KINDS = {kind.name: kind for kind in CATALOGUE}


def along(trajectory: Trajectory, seed: int) -> Place:
    """The place around `trajectory`, whose landmarks are named after the catalogue. Raises
    ConfigError where one of them would stand on the line.
    """
    line = Line(np.array(trajectory.line_m, float))
    return Place(
        seed=seed,
        roads=_roads(line),
        plots=_plots(trajectory.landmarks, line),
        props=(),
        start=line.at(0.0),
    )


def _roads(line: Line) -> tuple[Road, ...]:
    """A road for each piece of the line, once where the line repeats it."""
    points: list[Point] = [(x, y) for x, y in line.points.tolist()]
    pieces = dict.fromkeys(pairwise(points))

    roads = [Road("way", start, end) for start, end in pieces]
    return tuple(roads)


def _plots(landmarks: list[Landmark], line: Line) -> tuple[Plot, ...]:
    places = [(each.x_m, each.y_m) for each in landmarks]
    places_m = np.array(places, float).reshape(-1, 2)
    to_line_m = line.nearest(places_m) - places_m

    plots = []
    for landmark, (x_m, y_m) in zip(landmarks, to_line_m.tolist(), strict=True):
        plots.append(_plot(landmark, x_m, y_m))

    return tuple(plots)


def _plot(landmark: Landmark, to_line_x_m: float, to_line_y_m: float) -> Plot:
    """The landmark's building, its front towards the line."""
    kind = _KINDS[landmark.name]
    away_m = math.hypot(to_line_x_m, to_line_y_m)
    required_m = kind.depth_m / 2 + CLEAR_M
    if away_m < required_m:
        raise ConfigError(
            f"[sim] the {landmark.name} at ({landmark.x_m:g}, {landmark.y_m:g}) would stand in the "
            f"way: put it {required_m:g} m from the line at least, not {away_m:.1f}"
        )

    # A front looks to the right of its heading.
    heading_rad = math.remainder(math.atan2(to_line_x_m, -to_line_y_m), math.tau)

    return Plot(kind, landmark.x_m, landmark.y_m, heading_rad)
