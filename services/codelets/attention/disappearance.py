"""Objects that should be in view and are not: a prediction of the map that fails."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import wrap_angle
from cogmap.graph.graph import Graph
from cogmap.schemas.codelets import Task
from cogmap.schemas.nodes import LinkKind, Object, Self, object_id, place_id
from cogmap.services.codelets.attention.config import Expectation
from cogmap.services.codelets.nodes import nodes_of

# The scan hits the front of a building, whose position is its middle: a ray that goes beyond
# passes.
BEYOND_M = 1.5
BEYOND_SHARE = 0.05
# Rays near the middle of an object, as a share of its apparent half width, do not graze it.
MIDDLE_SHARE = 0.6
MIN_RAYS = 2
# That perception misses an object counts once; that rays pass where it stood as well, twice.
UNSEEN = 1
PASSED = 2
# What hides an object less far than so from its middle leaves most of it in sight.
SEEN_SHARE = 0.3
# An object hides what is behind it in as much as this of its width, as it may be deeper than wide.
HIDING_SHARE = 1.15
# Of more objects than this, only those at place nodes in view are visited.
MANY_OBJECTS = 300


def missing_objects(task: Task, agent: Self, graph: Graph, settings: Expectation) -> dict[str, int]:
    """The established objects, by id, that `agent` should see in the view of `task` and does not,
    with how much that counts: the range scan passes where they stood, or nothing that is known
    hides them. None while its position is uncertain.
    """
    if task.scan is None or not _is_certain(agent, settings):
        return {}

    rays = np.asarray(task.scan.numpy(), np.float64)
    if not len(rays):
        return {}

    half_view_rad = float(np.abs(rays[:, 0]).max())
    in_view = {object_id(percept.label) for percept in task.percepts}
    around = _around(agent, graph, settings, half_view_rad)
    missing = {}
    for node in around:
        if node.id in in_view or not _is_expected(node, agent, settings):
            continue

        counts = _absence(node, agent, rays, around, settings)
        if counts:
            missing[node.id] = counts

    return dict(sorted(missing.items()))


def _around(agent: Self, graph: Graph, settings: Expectation, half_view_rad: float) -> list[Object]:
    """The objects of the agent's map, where there are many those that stand inside its view."""
    if graph.count(Object) > MANY_OBJECTS:
        return nodes_of(graph, Object, _at_places_ahead(agent, graph, settings, half_view_rad))
    return [node for node in graph.of_kind(Object) if node.map == agent.map]


def _at_places_ahead(
    agent: Self, graph: Graph, settings: Expectation, half_view_rad: float
) -> Iterator[str]:
    """The ids of what is linked to a place node inside the view, or a cell beside it."""
    cell_m = graph.cell_m(agent.map)
    here = np.array([agent.x_m, agent.y_m])
    reach = math.ceil(settings.farthest_m / cell_m) + 1
    steps = np.arange(-reach, reach + 1)
    around = np.stack(np.meshgrid(steps, steps, indexing="ij"), -1).reshape(-1, 2)
    cells = around + np.rint(here / cell_m).astype(np.int64)

    offset_m = cells * cell_m - here
    away_m = np.hypot(offset_m[:, 0], offset_m[:, 1])
    aside_rad = np.abs(_bearing_rad(offset_m, agent))
    slack_rad = np.arctan2(cell_m, np.maximum(away_m, cell_m))
    is_inside = aside_rad <= half_view_rad + slack_rad
    is_near = away_m <= settings.farthest_m + cell_m

    for i, j in cells[is_inside & is_near].tolist():
        yield from graph.links.sources(place_id(i, j, agent.map), LinkKind.AT)


def _is_expected(node: Object, agent: Self, settings: Expectation) -> bool:
    is_known = node.sightings >= settings.established_sightings and not node.misses
    is_certain = math.hypot(node.x_sd_m, node.y_sd_m) <= settings.largest_sd_m
    if node.map != agent.map or not is_known or not is_certain:
        return False

    away_m = math.dist((node.x_m, node.y_m), (agent.x_m, agent.y_m))
    return settings.nearest_m <= away_m <= settings.farthest_m


def _absence(
    node: Object, agent: Self, rays: Floats, around: Iterable[Object], settings: Expectation
) -> int:
    """PASSED where the rays (n, 2), bearing and range each, pass where an object stood; UNSEEN
    where they end well before it, and perception would see it, as nothing that is known hides it:
    what is low stops rays and hides no building. Else 0: what they hit there may be the object.
    """
    away_m = math.dist((node.x_m, node.y_m), (agent.x_m, agent.y_m))
    half_rad = math.atan2(MIDDLE_SHARE * node.width_m / 2, away_m)
    aside_rad = wrap_angle(rays[:, 0] - _bearing_of(node, agent))
    ranges_m = rays[np.abs(aside_rad) <= half_rad, 1]
    if len(ranges_m) < MIN_RAYS:
        return 0

    beyond_m = away_m * (1 + BEYOND_SHARE) + BEYOND_M
    has_passed = (ranges_m == 0) | (ranges_m > beyond_m)
    if float(has_passed.mean()) >= settings.passed_share:
        return PASSED
    if abs(_bearing_of(node, agent)) > settings.field_of_view_rad / 2:
        return 0

    before_m = away_m - HIDING_SHARE * node.width_m / 2 - BEYOND_M
    has_ended = ~has_passed & (ranges_m < before_m)
    is_clear = float((has_passed | has_ended).mean()) >= settings.passed_share
    if is_clear and _is_in_sight(node, agent, around):
        return UNSEEN
    return 0


def _is_in_sight(node: Object, agent: Self, around: Iterable[Object]) -> bool:
    """Whether nothing on the map hides the middle of an object."""
    away_m = math.dist((node.x_m, node.y_m), (agent.x_m, agent.y_m))
    middle_rad = math.atan2(SEEN_SHARE * node.width_m / 2, away_m)
    for other in around:
        other_m = math.dist((other.x_m, other.y_m), (agent.x_m, agent.y_m))
        if other.id == node.id or other_m >= away_m:
            continue

        half_rad = math.atan2(HIDING_SHARE * other.width_m / 2, other_m)
        aside_rad = math.remainder(_bearing_of(other, agent) - _bearing_of(node, agent), math.tau)
        if abs(aside_rad) <= half_rad + middle_rad:
            return False

    return True


def _is_certain(agent: Self, settings: Expectation) -> bool:
    return math.hypot(agent.x_sd_m, agent.y_sd_m) <= settings.largest_sd_m


def _bearing_of(node: Object, agent: Self) -> float:
    direction_rad = math.atan2(node.y_m - agent.y_m, node.x_m - agent.x_m)
    return math.remainder(direction_rad - agent.heading_rad, math.tau)


def _bearing_rad(offset_m: Floats, agent: Self) -> Floats:
    """(n,): the bearings from the agent of (n, 2) offsets."""
    direction_rad = np.arctan2(offset_m[:, 1], offset_m[:, 0])
    bearing_rad: Floats = wrap_angle(direction_rad - agent.heading_rad)
    return bearing_rad
