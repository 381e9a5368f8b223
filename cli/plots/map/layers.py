"""The layers of the map: the paths, and what the agent has learned of the town."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse, Patch

from cogmap.cli.launch.drive_metrics import objects, position_m
from cogmap.cli.launch.individuals.buildings import NOTHING
from cogmap.cli.launch.individuals.judge import Judgement
from cogmap.cli.launch.observer import Observer
from cogmap.cli.plots.map.frame import Transform
from cogmap.cli.plots.map.markers import END_MARKER, START_MARKER
from cogmap.cli.plots.map.town import Handle
from cogmap.cli.plots.palette import ESTIMATE, FUSED, OBJECT, ROAD, ROAD_OPACITY, TRUE, WHEELS
from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.schemas.nodes import ROOT_MAP, TILE_SIDE, Object, PlaceColumn

DASHED = (0, (4, 2))
DOTTED = (0, (1, 1.2))
MIN_SAMPLES = 3


def start_m(observer: Observer) -> tuple[float, float] | None:
    """Return where the robot began, on the map; None if nobody knows."""
    start = observer.start
    if start is None:
        return None

    ((x_m, y_m),) = observer.to_map(np.array([[start.x_m, start.y_m]])).tolist()
    return x_m, y_m


def draw_true_path(axes: Axes, observer: Observer) -> list[Handle]:
    """Draw where the robot really was, and where it began and ended. Returns their legend."""
    start = start_m(observer)
    if start is None:
        return []

    path_m = observer.to_map(observer.true_path_m)
    axes.plot(*path_m.T, color=TRUE, lw=3.2, alpha=0.9, solid_capstyle="round", zorder=9)
    axes.plot(*start, **START_MARKER, zorder=11)
    axes.plot(*path_m[-1], **END_MARKER, zorder=11)
    return [
        Line2D([], [], color=TRUE, lw=3.2, label="true path"),
        Line2D([], [], label="start", **START_MARKER),
        Line2D([], [], label="end", **END_MARKER),
    ]


def draw_paths(axes: Axes, observer: Observer) -> list[Handle]:
    """Draw where the agent took itself to be, and what self-motion alone adds up to. Returns the
    legend of those that there are.
    """
    legend: list[Handle] = []
    for path_m, label, style in (
        (observer.estimated_path_m, "estimated path", _line(ESTIMATE, 1.5, "-", 10.0)),
        (observer.fused_path_m, "by fused self-motion alone", _line(FUSED, 1.4, DOTTED, 9.5)),
        (observer.wheels_path_m, "by wheels alone", _line(WHEELS, 1.6, DASHED, 8.0)),
    ):
        if len(path_m):
            (line,) = axes.plot(*observer.to_map(path_m).T, label=label, **style)
            legend.append(line)

    return legend


def draw_road(axes: Axes, graph: Graph) -> list[Handle]:
    """Draw the place nodes' road column, cell by cell. Returns its legend if there is any road."""
    red, green, blue = to_rgb(ROAD)
    cell_m = graph.cell_m()
    side_m = TILE_SIDE * cell_m
    legend: list[Handle] = []
    for (_, x, y), tile in graph.places.of_map(ROOT_MAP):
        if PlaceColumn.ROAD not in tile.columns:
            continue

        road = np.clip(tile.columns[PlaceColumn.ROAD].T, 0, 1)
        image = np.empty((*road.shape, 4))
        image[..., :3], image[..., 3] = (red, green, blue), ROAD_OPACITY * road
        west = (x * TILE_SIDE - 0.5) * cell_m
        south = (y * TILE_SIDE - 0.5) * cell_m
        extent = (west, west + side_m, south, south + side_m)
        axes.imshow(image, extent=extent, origin="lower", interpolation="nearest", zorder=3)
        legend = [Patch(fc=ROAD, alpha=ROAD_OPACITY, label="learned street")]

    return legend


def draw_objects(
    axes: Axes, graph: Graph, judgement: Judgement | None, to_map: Transform
) -> list[Handle]:
    """Draw each object node with its samples, twice their standard deviation, and a line to the
    middle of the building that most of its percepts show. Returns the legend of what there is.
    """
    drawn = objects(graph)
    if not drawn:
        return []

    for node in drawn:
        _draw_samples(axes, node)
        axes.plot(*position_m(node), "o", ms=5, mfc=OBJECT, mec="white", mew=0.8, zorder=7)

    label = "learned building, its samples and 2 SD"
    legend: list[Handle] = [Line2D([], [], marker="o", ls="", mfc=OBJECT, mec="white", label=label)]
    if judgement is not None:
        _draw_errors(axes, judgement, to_map)
        legend.append(Line2D([], [], color=OBJECT, lw=1.0, label="its error, to the true middle"))
    return legend


def _draw_errors(axes: Axes, judgement: Judgement, to_map: Transform) -> None:
    for each in judgement.individuals:
        if each.building == NOTHING:
            continue

        ends_m = np.array([each.at_m, judgement.buildings.centres_m[each.building]])
        axes.plot(*to_map(ends_m).T, color=OBJECT, lw=1.0, alpha=0.8, zorder=4)


def _draw_samples(axes: Axes, node: Object) -> None:
    if node.offsets_m is None or node.offsets_m.shape[0] < MIN_SAMPLES:
        return

    points_m = node.positions_m()
    axes.plot(*points_m.T, ".", ms=1.6, color=OBJECT, alpha=0.35, zorder=4)
    axes.add_patch(_two_sd(points_m))


def _two_sd(points_m: Floats) -> Ellipse:
    """Return the ellipse of twice the standard deviation of points (n, 2)."""
    spread, directions = np.linalg.eigh(np.cov(points_m.T))
    width_m, height_m = 4 * np.sqrt(np.maximum(spread, 0))
    angle = np.degrees(np.arctan2(directions[1, 0], directions[0, 0]))
    middle_m = points_m.mean(axis=0).tolist()
    return Ellipse(
        middle_m, width_m, height_m, angle=angle, fill=False, ec=OBJECT, lw=1.1, zorder=5
    )


def _line(colour: str, width: float, dashes: object, order: float) -> dict[str, Any]:
    return {"color": colour, "lw": width, "ls": dashes, "zorder": order}
