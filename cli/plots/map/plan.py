"""Draws a town before anybody has driven in it: streets, buildings, start, and goals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.lines import Line2D

from cogmap.cli.plots.labels import place
from cogmap.cli.plots.map.frame import town_on_map
from cogmap.cli.plots.map.markers import START_MARKER, goal_marker
from cogmap.cli.plots.map.names import draw_names, labels_of
from cogmap.cli.plots.map.sheet import arrange, extent_m, new_map, write_title
from cogmap.cli.plots.map.town import draw_town
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_to
from cogmap.schemas.sensing import Pose, TrueTown

MARGIN_M = 5.0
NAME_PT = 9.0


def draw_plan(
    path: Path, town: TrueTown, start: Pose, goals: dict[str, tuple[float, float]], title: str
) -> None:
    """Write a picture of a town to `path`, as PNG or as PDF by its suffix, in the frame in which
    the agent is given goals; `goals` are places in it, by their names.
    """
    origin = np.array([start.x_m, start.y_m, start.heading_rad])

    def to_map(points_m: Floats) -> Floats:
        return transform_to(origin, points_m)

    shown = town_on_map(town, to_map)
    places_m = np.array([*goals.values()]).reshape(-1, 2)
    with new_map(path) as axes:
        legend = draw_town(axes, shown)
        axes.plot(0, 0, **START_MARKER, zorder=11)
        legend.append(Line2D([], [], label="start", **START_MARKER))
        if goals:
            axes.plot(*places_m.T, **goal_marker(True), zorder=12)
            legend.append(Line2D([], [], label="goal", **goal_marker(True)))

        points_m = np.vstack([extent_m(shown), places_m, np.zeros((1, 2))])
        arrange(axes, points_m, MARGIN_M, {"the town": legend})
        streets = {street.name for street in town.streets}
        write_title(axes, title, [f"streets: {len(streets)}; buildings: {len(town.buildings)}"])
        draw_names(axes, shown)

        marked = [("start", (0.0, 0.0))]
        marked += [(f"goal {name}", at_m) for name, at_m in goals.items()]
        place(axes, labels_of(axes, marked), NAME_PT)
