"""The map's layers of structure: links that are cut, sub-maps, goals, and the plan."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from cogmap.cli.launch.observer import Observer
from cogmap.cli.plots.palette import CUT, GOAL, PLAN, SEVERAL, SHORTCUT
from cogmap.geometry.hulls import hull_m
from cogmap.geometry.se2 import transform_from
from cogmap.graph.cuts import cut_links_m
from cogmap.graph.graph import Graph
from cogmap.graph.individuals import called
from cogmap.graph.window import ROAD_FROM
from cogmap.schemas.nodes import (
    NEVER_NS,
    PLAN_ID,
    ROOT_MAP,
    Goal,
    LinkKind,
    Map,
    Object,
    PlaceColumn,
    Plan,
    is_coarse_map,
)


def draw_structure(axes: Axes, observer: Observer, graph: Graph) -> list[Line2D]:
    """Draw all of these layers. Returns the lines of the legend for those that there are."""
    legend = []
    if _draw_cuts(axes, observer, graph):
        legend.append(Line2D([], [], color=CUT, lw=1.4, label="links cut"))
    if _draw_sub_maps(axes, observer, graph):
        label = "sub-maps, and the road on their own grids"
        legend.append(Line2D([], [], color=SEVERAL[1], marker=".", lw=6, alpha=0.3, label=label))
    if _draw_goals(axes, observer, graph):
        legend.append(Line2D([], [], color=GOAL, marker="*", ms=11, ls="", label="goals"))
    if _draw_plan(axes, observer, graph):
        legend.append(Line2D([], [], color=PLAN, lw=2.2, label="plan"))
    if _draw_shortcuts(axes, observer):
        legend.append(Line2D([], [], color=SHORTCUT, lw=7, label="way through streets new to it"))

    return legend


def _draw_cuts(axes: Axes, observer: Observer, graph: Graph) -> bool:
    """Draw each straight link that is cut as the side that its two place nodes share."""
    ends_m = cut_links_m(graph)
    if not len(ends_m):
        return False

    lines = observer.to_world(ends_m.reshape(-1, 2)).reshape(-1, 2, 2)
    axes.add_collection(LineCollection(list(lines), colors=CUT, linewidths=1.0, zorder=3.5))
    return True


def _draw_sub_maps(axes: Axes, observer: Observer, graph: Graph) -> bool:
    """Draw the hull of the objects of each sub-map, and those of its place nodes that are road."""
    others = [node for node in graph.of_kind(Map) if node.id != ROOT_MAP]
    maps = [node for node in others if not is_coarse_map(node.id)]
    has_any = False
    for number, sub_map in enumerate(maps):
        members = graph.links.sources(sub_map.id, LinkKind.WITHIN)
        objects = [node for name in members if (node := graph.get(Object, name)) is not None]
        corners_m = hull_m(np.array([(node.x_m, node.y_m) for node in objects]).reshape(-1, 2))
        if corners_m is None:
            continue

        colour = SEVERAL[number % len(SEVERAL)]
        cells, shares = graph.places.written_cells(sub_map.id, PlaceColumn.ROAD)
        pose = np.array([sub_map.x_m, sub_map.y_m, sub_map.heading_rad])
        road = cells[shares >= ROAD_FROM].astype(np.float64)
        road_m = observer.to_world(transform_from(pose, sub_map.cell_m * road))
        axes.plot(*road_m.T, ".", color=colour, ms=2.0, alpha=0.8, zorder=3.2)
        where_m = observer.to_world(corners_m)
        axes.add_patch(Polygon(where_m, fc=colour, ec=colour, alpha=0.16, lw=2, zorder=1.5))
        has_any = True

    return has_any


def _draw_goals(axes: Axes, observer: Observer, graph: Graph) -> bool:
    """Draw a star where each goal is, filled if it was reached."""
    goals = list(graph.of_kind(Goal))
    for goal in goals:
        where = called(goal.object, graph) if goal.object else []
        x_m, y_m = (where[0].x_m, where[0].y_m) if where else (goal.x_m, goal.y_m)
        point_m = observer.to_world(np.array([[x_m, y_m]]))[0]
        colour = GOAL if goal.reached_ns != NEVER_NS else "white"
        axes.plot(*point_m, "*", ms=16, mfc=colour, mec=GOAL, mew=1.4, zorder=12)

    return bool(goals)


def _draw_plan(axes: Axes, observer: Observer, graph: Graph) -> bool:
    """Draw the route of the plan as it is now."""
    plan = graph.get(Plan, PLAN_ID)
    if plan is None or plan.route is None:
        return False

    route_m = observer.to_world(np.asarray(plan.route.numpy(), np.float64))
    axes.plot(*route_m.T, color=PLAN, lw=2.2, alpha=0.9, zorder=8.5)
    return True


def _draw_shortcuts(axes: Axes, observer: Observer) -> bool:
    """Draw the parts of the way to goals through streets in which the robot had not been before."""
    steps_m = observer.shortcuts_m
    axes.add_collection(LineCollection(list(steps_m), colors=SHORTCUT, linewidths=9.0, zorder=8.8))
    return bool(len(steps_m))
