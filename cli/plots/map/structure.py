"""The map's layers of structure: links that are cut, sub-maps, goals, and the plan."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon

from cogmap.cli.launch.observer import Observer
from cogmap.cli.plots.map.markers import goal_marker
from cogmap.cli.plots.map.town import Handle
from cogmap.cli.plots.palette import CUT, PLAN, SHORTCUT, SUB_MAP
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

MARKED: dict[str, Any] = {"lw": 1.0, "ls": (0, (5, 2)), "fill": False}


def draw_structure(axes: Axes, observer: Observer, graph: Graph) -> list[Handle]:
    """Draw all of these layers. Returns the legend of those that there are."""
    legend: list[Handle] = []
    if _draw_cuts(axes, graph):
        legend.append(Line2D([], [], color=CUT, lw=1.4, label="links cut: no way across"))
    if _draw_sub_maps(axes, graph):
        legend.append(Patch(ec=SUB_MAP, label="sub-map, and the road on its own grid", **MARKED))
    legend += _draw_goals(axes, graph)
    if _draw_plan(axes, graph):
        legend.append(Line2D([], [], color=PLAN, lw=2.2, label="plan"))
    if _draw_shortcuts(axes, observer):
        legend.append(Line2D([], [], color=SHORTCUT, lw=7, label="way through streets new to it"))

    return legend


def goals_m(graph: Graph) -> list[tuple[Goal, tuple[float, float]]]:
    """Return the goals, and where they are on the map."""
    found = []
    for goal in graph.of_kind(Goal):
        where = called(goal.object, graph) if goal.object else []
        x_m, y_m = (where[0].x_m, where[0].y_m) if where else (goal.x_m, goal.y_m)
        if where or not goal.object:
            found.append((goal, (x_m, y_m)))

    return found


def _draw_cuts(axes: Axes, graph: Graph) -> bool:
    """Draw each straight link that is cut as the side that its two place nodes share."""
    ends_m = cut_links_m(graph)
    axes.add_collection(LineCollection(list(ends_m), colors=CUT, linewidths=1.0, zorder=3.5))
    return bool(len(ends_m))


def _draw_sub_maps(axes: Axes, graph: Graph) -> bool:
    """Draw the hull of the objects of each sub-map, and those of its place nodes that are road."""
    others = [node for node in graph.of_kind(Map) if node.id != ROOT_MAP]
    has_any = False
    for sub_map in others:
        if is_coarse_map(sub_map.id):
            continue

        members = graph.links.sources(sub_map.id, LinkKind.WITHIN)
        objects = [node for name in members if (node := graph.get(Object, name)) is not None]
        corners_m = hull_m(np.array([(node.x_m, node.y_m) for node in objects]).reshape(-1, 2))
        if corners_m is None:
            continue

        cells, shares = graph.places.written_cells(sub_map.id, PlaceColumn.ROAD)
        pose = np.array([sub_map.x_m, sub_map.y_m, sub_map.heading_rad])
        road = cells[shares >= ROAD_FROM].astype(np.float64)
        road_m = transform_from(pose, sub_map.cell_m * road)
        axes.plot(*road_m.T, ".", color=SUB_MAP, ms=1.6, alpha=0.7, zorder=3.2)
        axes.add_patch(Polygon(corners_m, fc=SUB_MAP, alpha=0.07, zorder=1.5))
        axes.add_patch(Polygon(corners_m, ec=SUB_MAP, zorder=1.6, **MARKED))
        has_any = True

    return has_any


def _draw_goals(axes: Axes, graph: Graph) -> list[Handle]:
    """Draw a star where each goal is, filled if it was reached. Returns the legend."""
    legend: dict[str, Handle] = {}
    for goal, position_m in goals_m(graph):
        is_reached = goal.reached_ns != NEVER_NS
        label = "goal, reached" if is_reached else "goal, not reached"
        marker = goal_marker(is_reached)
        axes.plot(*position_m, zorder=12, **marker)
        legend[label] = Line2D([], [], label=label, **marker)

    return list(legend.values())


def _draw_plan(axes: Axes, graph: Graph) -> bool:
    """Draw the route of the plan as it is now."""
    plan = graph.get(Plan, PLAN_ID)
    if plan is None or plan.route is None or plan.map != ROOT_MAP:
        return False

    route_m = np.asarray(plan.route.numpy(), np.float64)
    axes.plot(*route_m.T, color=PLAN, lw=2.2, alpha=0.9, zorder=8.5)
    return True


def _draw_shortcuts(axes: Axes, observer: Observer) -> bool:
    """Draw the parts of the way to goals through streets in which the robot had not been before."""
    steps_m = observer.shortcuts_m
    on_map_m = observer.to_map(steps_m.reshape(-1, 2)).reshape(-1, 2, 2)
    axes.add_collection(LineCollection(list(on_map_m), colors=SHORTCUT, linewidths=9.0, zorder=8.8))
    return bool(len(steps_m))
