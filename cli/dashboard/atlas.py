"""The learned map, and the true town beside it, as the page draws them. Pure."""

from __future__ import annotations

import numpy as np

from cogmap.cli.dashboard.parts import (
    Cuts,
    District,
    Flat,
    Layer,
    MapGoal,
    MapObject,
    MapPart,
    TrueStreet,
    Truth,
    flat,
)
from cogmap.cli.dashboard.pictures import PNG, costs_png, data_url, places_png
from cogmap.cli.launch.goals import name_of
from cogmap.geometry import se2
from cogmap.geometry.arrays import Floats
from cogmap.geometry.hulls import hull_m
from cogmap.graph.cuts import cut_links_m
from cogmap.graph.graph import Graph
from cogmap.graph.individuals import called
from cogmap.graph.path import rows_of
from cogmap.graph.window import Extent
from cogmap.schemas.nodes import (
    NEVER_NS,
    PLAN_ID,
    ROOT_MAP,
    Goal,
    LinkKind,
    LoopClosure,
    Map,
    Object,
    PathColumn,
    Plan,
    is_coarse_map,
)
from cogmap.schemas.sensing import Building, Pose, TrueTown
from cogmap.services.codelets.public import PlanningConfig, place_costs

MAX_SAMPLES = 24
"""Samples of an object's place that are drawn: enough to see their spread."""

SPREADS = 2.0


def map_part(graph: Graph) -> MapPart:
    """Return the root map of `graph` as it is drawn."""
    rows = rows_of(graph.path)
    return MapPart(
        objects=[_object(node) for node in graph.of_kind(Object) if node.map == ROOT_MAP],
        path=flat(rows[:, [PathColumn.X_M, PathColumn.Y_M]]),
        closures=flat(_closures_m(graph, rows)),
        districts=_districts(graph),
        goals=_goals(graph),
        route=_route(graph),
    )


def cuts_part(graph: Graph) -> Cuts:
    """Return the links that are cut on the root map."""
    return Cuts(links=flat(cut_links_m(graph)))


def places_part(graph: Graph) -> Layer:
    """Return the place nodes of the root map as a picture."""
    extent = graph.places.extent(ROOT_MAP)
    return _layer(extent, graph.cell_m(), places_png(graph)) if extent.shape[0] else Layer()


def costs_part(graph: Graph, planning: PlanningConfig) -> Layer:
    """Return what it costs to drive over the places of the root map, by the settings `planning`,
    as a picture.
    """
    agent = graph.agent
    if agent is None or agent.map != ROOT_MAP or not graph.places.extent(ROOT_MAP).shape[0]:
        return Layer()

    costs = place_costs(graph, agent, planning)
    cost = costs.cost()
    west, south = costs.grid.origin
    width, height = cost.shape
    extent = Extent((west, south), (west + width, south + height))
    return _layer(extent, costs.grid.cell_m, costs_png(cost))


def _layer(extent: Extent, cell_m: float, png: bytes) -> Layer:
    west, south = extent.lower
    width, height = extent.shape
    return Layer(
        picture=data_url(PNG, png),
        west_m=(west - 0.5) * cell_m,
        south_m=(south - 0.5) * cell_m,
        width_m=width * cell_m,
        height_m=height * cell_m,
    )


def _object(node: Object) -> MapObject:
    samples_m = node.positions_m()
    step = max(1, len(samples_m) // MAX_SAMPLES)
    return MapObject(
        label=node.label,
        name=node.name,
        at_m=(round(node.x_m, 2), round(node.y_m, 2)),
        spread_m=(round(SPREADS * node.x_sd_m, 2), round(SPREADS * node.y_sd_m, 2)),
        samples=flat(samples_m[::step]) if node.offsets_m is not None else [],
    )


def _closures_m(graph: Graph, rows: Floats) -> Floats:
    """Return both ends of each closure that holds, where the path was then, (n, 2, 2)."""
    closures = [node for node in graph.of_kind(LoopClosure) if node.accepted]
    if not closures or not len(rows):
        return np.zeros((0, 2, 2))

    times_s = rows[:, PathColumn.STAMP_S]
    ends_s = np.array([(node.from_ns, node.to_ns) for node in closures]) / 1e9
    places = np.searchsorted(times_s, ends_s).clip(0, len(rows) - 1)
    ends_m: Floats = rows[places][:, :, [PathColumn.X_M, PathColumn.Y_M]]
    return ends_m


def _districts(graph: Graph) -> list[District]:
    districts = []
    for node in graph.of_kind(Map):
        if node.id == ROOT_MAP or is_coarse_map(node.id):
            continue

        members = graph.links.sources(node.id, LinkKind.WITHIN)
        objects = [found for name in members if (found := graph.get(Object, name)) is not None]
        corners_m = hull_m(np.array([(each.x_m, each.y_m) for each in objects]).reshape(-1, 2))
        if corners_m is not None:
            districts.append(District(name=node.id, hull=flat(corners_m)))
    return districts


def _goals(graph: Graph) -> list[MapGoal]:
    goals = []
    for goal in graph.of_kind(Goal):
        meant = called(goal.object, graph) if goal.object else []
        x_m, y_m = (meant[0].x_m, meant[0].y_m) if meant else (goal.x_m, goal.y_m)
        if goal.object and not meant:
            continue

        at_m = (round(x_m, 2), round(y_m, 2))
        is_reached = goal.reached_ns != NEVER_NS
        goals.append(MapGoal(name=name_of(goal.id), at_m=at_m, is_reached=is_reached))
    return goals


def _route(graph: Graph) -> Flat:
    plan = graph.get(Plan, PLAN_ID)
    if plan is None or plan.route is None or plan.map != ROOT_MAP:
        return []
    return flat(plan.route.numpy())


def truth_part(
    town: TrueTown | None, start: Pose | None, path_m: list[tuple[float, float]]
) -> Truth:
    """Return the true town in the frame of the map, which is that of the true pose `start`; nothing
    where that is not known.
    """
    if town is None or start is None:
        return Truth()

    origin = np.array([start.x_m, start.y_m, start.heading_rad])
    truth = Truth(path=flat(se2.transform_to(origin, np.array(path_m).reshape(-1, 2))))
    for street in town.streets:
        line = flat(se2.transform_to(origin, np.array(street.line_m)))
        truth.streets.append(TrueStreet(line=line, is_closed=street.closed))

    corners_m = [_corners_m(building) for building in town.buildings]
    ends = np.cumsum([len(each) for each in corners_m])
    on_map_m = se2.transform_to(origin, np.vstack([np.zeros((0, 2)), *corners_m]))
    truth.buildings = [flat(each) for each in np.split(on_map_m, ends)[:-1]]
    return truth


def _corners_m(building: Building) -> Floats:
    """Return the corners of a building's footprint, (n, 2)."""
    if building.outline_m:
        return np.array(building.outline_m)

    half_m = np.array([building.width_m, building.depth_m]) / 2
    corners_m = half_m * np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])
    pose = np.array([building.pose.x_m, building.pose.y_m, building.pose.heading_rad])
    return se2.transform_from(pose, corners_m)
