"""The place that a way leads through: a street along it, and its landmarks as buildings that look
to it. Pure.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from cogmap.errors import ConfigError
from services.sim.layout.catalogue import CATALOGUE
from services.sim.layout.plan import Plot, Road
from services.sim.layout.town import Place
from services.sim.scripted.trajectory import Line, Way

CLEAR_M = 1.0
_KINDS = {kind.name: kind for kind in CATALOGUE}


def along(way: Way, seed: int) -> Place:
    """What is drawn of `way`, whose landmarks are named after the catalogue. Raises ConfigError
    where one of them would stand in the robot's way.
    """
    line = Line(np.array(way.line_m, float))
    points: list[tuple[float, float]] = [(x, y) for x, y in line.points.tolist()]
    roads = tuple(Road("way", a, b) for a, b in dict.fromkeys(itertools.pairwise(points)))
    return Place(seed, roads, _plots(way, line), (), line.at(0.0))


def _plots(way: Way, line: Line) -> tuple[Plot, ...]:
    where = np.array([(each.x_m, each.y_m) for each in way.landmarks], float).reshape(-1, 2)
    feet = line.nearest(where)
    plots = []
    for landmark, (x_m, y_m) in zip(way.landmarks, (feet - where).tolist(), strict=True):
        kind = _KINDS[landmark.name]
        away_m = math.hypot(x_m, y_m)
        if away_m < kind.depth_m / 2 + CLEAR_M:
            raise ConfigError(
                f"[sim] the {landmark.name} at ({landmark.x_m:g}, {landmark.y_m:g}) would stand in the way: put it "
                f"{kind.depth_m / 2 + CLEAR_M:g} m from the line at least, not {away_m:.1f}"
            )
        # A front looks to the right of its heading.
        plots.append(
            Plot(kind, landmark.x_m, landmark.y_m, math.remainder(math.atan2(x_m, -y_m), math.tau))
        )
    return tuple(plots)
