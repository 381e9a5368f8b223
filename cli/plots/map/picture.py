"""Draws map.png: the town as it is, and as the agent has come to know it.

All is drawn in the frame of the agent's map, in which `cogmap goal X Y` takes goals.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from cogmap.cli.launch.drive_metrics import RecordedMetrics, headline, judged
from cogmap.cli.launch.goals import name_of
from cogmap.cli.launch.observer import Observer
from cogmap.cli.launch.tally import Tally
from cogmap.cli.plots.draw import spoken
from cogmap.cli.plots.labels import Label, place
from cogmap.cli.plots.map import layers
from cogmap.cli.plots.map.frame import town_on_map
from cogmap.cli.plots.map.names import draw_names, labels_of
from cogmap.cli.plots.map.sheet import arrange, extent_m, new_map, write_title
from cogmap.cli.plots.map.structure import draw_structure, goals_m
from cogmap.cli.plots.map.town import draw_town
from cogmap.cli.plots.palette import INK
from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.schemas.nodes import Object
from cogmap.schemas.sensing import TrueTown
from cogmap.services.sim.layout.towns import called

MARGIN_M = 5.0
ROADSIDE_M = 20.0
"""The margin where no town is known: what was learned stands beside the path."""

MAX_NAMES = 40
"""Of a recording, names of more objects than that would hide the map."""

NAME_PT = 9.0


def draw(path: Path, tally: Tally, metrics: RecordedMetrics) -> None:
    """Write the map to `path`, as PNG or as PDF by its suffix."""
    observer = tally.observer
    graph = tally.replica.graph
    town = None if observer.town is None else town_on_map(observer.town, observer.to_map)
    with new_map(path) as axes:
        true = [] if town is None else draw_town(axes, town)
        true += layers.draw_true_path(axes, observer)
        learned = layers.draw_road(axes, graph)
        learned += layers.draw_objects(axes, graph, judged(tally), observer.to_map)
        learned += layers.draw_paths(axes, observer)
        learned += draw_structure(axes, observer, graph)

        legends = {"the town as it is": true, "what the agent made of it": learned}
        margin_m = ROADSIDE_M if town is None else MARGIN_M
        arrange(axes, _reached_m(observer, graph, town), margin_m, legends)
        _write_title(axes, metrics)
        if town is not None:
            draw_names(axes, town)
        place(axes, _labels(axes, observer, graph), NAME_PT)


def _reached_m(observer: Observer, graph: Graph, town: TrueTown | None) -> Floats:
    """Return points (n, 2) of the map that it shows: the town, the paths and the goals."""
    paths_m = [
        observer.true_path_m,
        observer.wheels_path_m,
        observer.fused_path_m,
        observer.estimated_path_m,
    ]
    on_map_m = [observer.to_map(path_m) for path_m in paths_m]
    goals = [at_m for _, at_m in goals_m(graph)]
    on_map_m.append(np.array(goals).reshape(-1, 2))
    if town is not None:
        on_map_m.append(extent_m(town))
    return np.vstack(on_map_m)


def _labels(axes: Axes, observer: Observer, graph: Graph) -> list[Label]:
    """Return the names of start and goals and, where no town is known, of what was learned."""
    start_m = layers.start_m(observer)
    marked = [] if start_m is None else [("start", start_m)]
    marked += [(f"goal {name_of(goal.id)}", at_m) for goal, at_m in goals_m(graph)]
    labels = labels_of(axes, marked)

    named = [node for node in graph.of_kind(Object) if node.name]
    if observer.town is None and len(named) <= MAX_NAMES:
        labels += [Label(spoken(node.name), node.x_m, node.y_m, INK) for node in named]
    return labels


def _write_title(axes: Axes, metrics: RecordedMetrics) -> None:
    """Write what was driven, what was learned on it, and how far positions err."""
    town = metrics.recording or called(metrics.town, metrics.seed)
    driven = f"{town}, driven through for {metrics.distance_m:.0f} m in {metrics.drive_s:.0f} s"
    learned = f"buildings: {headline(metrics)}; {metrics.road_m2:.0f} m² of street learned"
    errors = (
        f"position error {metrics.estimate.mean_m:.2f} m on average; "
        f"{metrics.fused_alone.mean_m:.2f} m by fused self-motion alone"
    )
    if metrics.wheels_alone.is_measured:
        errors = f"{errors}, {metrics.wheels_alone.mean_m:.2f} m by wheels alone"

    write_title(axes, driven, [learned, errors])
