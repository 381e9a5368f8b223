"""The layers of the map: what the agent has learned of the town."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Ellipse
from matplotlib.transforms import Affine2D

from cogmap.cli.launch.drive_metrics import objects, position_m
from cogmap.cli.launch.individuals.buildings import NOTHING
from cogmap.cli.launch.individuals.judge import Judgement
from cogmap.cli.launch.observer import Observer
from cogmap.cli.plots.palette import OBJECT, ROAD, ROAD_OPACITY
from cogmap.graph.graph import Graph
from cogmap.schemas.nodes import ROOT_MAP, TILE_SIDE, Object, PlaceColumn
from cogmap.schemas.sensing import Pose


def draw_road(axes: Axes, observer: Observer, graph: Graph) -> None:
    """Draw the place nodes' road column, cell by cell."""
    red, green, blue = to_rgb(ROAD)
    pose = observer.map_frame or Pose(x_m=0.0, y_m=0.0, heading_rad=0.0)
    frame = Affine2D().rotate(pose.heading_rad).translate(pose.x_m, pose.y_m) + axes.transData
    cell_m = graph.cell_m()
    side_m = TILE_SIDE * cell_m
    for (_, x, y), tile in graph.places.of_map(ROOT_MAP):
        if PlaceColumn.ROAD not in tile.columns:
            continue
        road = np.clip(tile.columns[PlaceColumn.ROAD].T, 0, 1)
        image = np.empty((*road.shape, 4))
        image[..., :3], image[..., 3] = (red, green, blue), ROAD_OPACITY * road
        west = (x * TILE_SIDE - 0.5) * cell_m
        south = (y * TILE_SIDE - 0.5) * cell_m
        extent = (west, west + side_m, south, south + side_m)
        axes.imshow(
            image, extent=extent, origin="lower", interpolation="nearest", transform=frame, zorder=3
        )


def draw_objects(axes: Axes, observer: Observer, graph: Graph, judgement: Judgement | None) -> None:
    """Draw each object node with its samples, twice their standard deviation, and a line to the
    middle of the building that most of its percepts show.
    """
    if judgement is not None:
        _draw_errors(axes, judgement)

    for node in objects(graph):
        middle = observer.to_world(np.array([position_m(node)]))[0]
        _draw_samples(axes, observer, node)
        axes.plot(*middle, "o", ms=5, mfc=OBJECT, mec="white", mew=0.8, zorder=7)


def _draw_errors(axes: Axes, judgement: Judgement) -> None:
    for each in judgement.individuals:
        if each.building == NOTHING:
            continue

        ends_m = np.array([each.at_m, judgement.buildings.centres_m[each.building]])
        axes.plot(*ends_m.T, color=OBJECT, lw=1.0, alpha=0.8, zorder=4)


def _draw_samples(axes: Axes, observer: Observer, node: Object) -> None:
    if node.offsets_m is None or node.offsets_m.shape[0] < 3:
        return
    points = observer.to_world(node.positions_m())
    axes.plot(*points.T, ".", ms=1.6, color=OBJECT, alpha=0.35, zorder=4)
    spread, directions = np.linalg.eigh(np.cov(points.T))
    width, height = 4 * np.sqrt(np.maximum(spread, 0))
    angle = np.degrees(np.arctan2(directions[1, 0], directions[0, 0]))
    ellipse = Ellipse(
        points.mean(axis=0).tolist(),
        width,
        height,
        angle=angle,
        fill=False,
        ec=OBJECT,
        lw=1.1,
        zorder=5,
    )
    axes.add_patch(ellipse)
