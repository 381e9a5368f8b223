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
from cogmap.services.codelets.nodes import nodes_of

# An object is expected inside the view, not so near that it is cut off, and nearer than perception
# reaches; it and the agent are to be placed with at most this standard deviation.
NEAREST_M = 8.0
FARTHEST_M = 35.0
MAX_SD_M = 2.0
# Perception sees an object whole within this angle. Aside of it only rays that pass where an object
# stood show that it is gone.
FIELD_OF_VIEW_RAD = 1.28
# Share of the rays towards an object that pass where it stood, from which on it is missing.
PASSED_SHARE = 0.6
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
# An object is in sight if this share of its half width, beside its middle, is not hidden.
SEEN_SHARE = 0.3
# It hides what is behind it within this share of its width, as it may be deeper than wide.
HIDING_SHARE = 1.15
# Of more objects than this only those at place nodes in view are visited.
MAX_OBJECTS = 300


def missing_objects(
    task: Task, agent: Self, graph: Graph, established_sightings: int
) -> dict[str, int]:
    """Find the objects seen in so many views that `agent` should see in the view of `task` and does
    not. Return by id how much that counts: the range scan passes where they stood, or nothing that
    is known hides them. Find none while the agent's position is uncertain.
    """
    if task.scan is None or math.hypot(agent.x_sd_m, agent.y_sd_m) > MAX_SD_M:
        return {}

    rays = np.asarray(task.scan.numpy(), np.float64)
    if not len(rays):
        return {}

    if graph.count(Object) > MAX_OBJECTS:
        half_view_rad = float(np.abs(rays[:, 0]).max())
        around = nodes_of(graph, Object, _at_places_ahead(agent, graph, half_view_rad))
    else:
        around = [node for node in graph.of_kind(Object) if node.map == agent.map]

    in_view = {object_id(percept.label) for percept in task.percepts}
    missing = {}
    for node in around:
        if node.id in in_view or node.map != agent.map:
            continue
        if node.sightings < established_sightings or node.misses:
            continue

        is_certain = math.hypot(node.x_sd_m, node.y_sd_m) <= MAX_SD_M
        away_m = math.dist((node.x_m, node.y_m), (agent.x_m, agent.y_m))
        counts = 0
        if is_certain and NEAREST_M <= away_m <= FARTHEST_M:
            counts = _absence(node, agent, rays, around)
        if counts:
            missing[node.id] = counts

    return dict(sorted(missing.items()))


def _at_places_ahead(agent: Self, graph: Graph, half_view_rad: float) -> Iterator[str]:
    """Yield the ids of what is linked to a place node inside the view, or a cell beside it."""
    cell_m = graph.cell_m(agent.map)
    here = np.array([agent.x_m, agent.y_m])
    reach = math.ceil(FARTHEST_M / cell_m) + 1
    steps = np.arange(-reach, reach + 1)
    around = np.stack(np.meshgrid(steps, steps, indexing="ij"), -1).reshape(-1, 2)
    cells = around + np.rint(here / cell_m).astype(np.int64)

    offset_m = cells * cell_m - here
    away_m = np.hypot(offset_m[:, 0], offset_m[:, 1])
    direction_rad = np.arctan2(offset_m[:, 1], offset_m[:, 0])
    aside_rad = np.abs(wrap_angle(direction_rad - agent.heading_rad))
    slack_rad = np.arctan2(cell_m, np.maximum(away_m, cell_m))
    is_inside = aside_rad <= half_view_rad + slack_rad
    is_near = away_m <= FARTHEST_M + cell_m

    for i, j in cells[is_inside & is_near].tolist():
        yield from graph.links.sources(place_id(i, j, agent.map), LinkKind.AT)


def _absence(node: Object, agent: Self, rays: Floats, around: Iterable[Object]) -> int:
    """Return PASSED if the rays (n, 2), bearing and range each, pass where an object stood; UNSEEN
    if they end well before it, and perception would see it, as nothing that is known hides it: low
    things stop rays and hide no building. Else return 0: what they hit there may be the object.
    """
    away_m = math.dist((node.x_m, node.y_m), (agent.x_m, agent.y_m))
    half_rad = math.atan2(MIDDLE_SHARE * node.width_m / 2, away_m)
    aside_rad = wrap_angle(rays[:, 0] - _bearing_of(node, agent))
    ranges_m = rays[np.abs(aside_rad) <= half_rad, 1]
    if len(ranges_m) < MIN_RAYS:
        return 0

    beyond_m = away_m * (1 + BEYOND_SHARE) + BEYOND_M
    has_passed = (ranges_m == 0) | (ranges_m > beyond_m)
    if float(has_passed.mean()) >= PASSED_SHARE:
        return PASSED
    if abs(_bearing_of(node, agent)) > FIELD_OF_VIEW_RAD / 2:
        return 0

    before_m = away_m - HIDING_SHARE * node.width_m / 2 - BEYOND_M
    has_ended = ~has_passed & (ranges_m < before_m)
    is_clear = float((has_passed | has_ended).mean()) >= PASSED_SHARE
    if not is_clear:
        return 0

    # It is in sight if nothing on the map hides its middle.
    middle_rad = math.atan2(SEEN_SHARE * node.width_m / 2, away_m)
    for other in around:
        other_m = math.dist((other.x_m, other.y_m), (agent.x_m, agent.y_m))
        if other.id == node.id or other_m >= away_m:
            continue

        hidden_rad = math.atan2(HIDING_SHARE * other.width_m / 2, other_m)
        other_rad = math.remainder(_bearing_of(other, agent) - _bearing_of(node, agent), math.tau)
        if abs(other_rad) <= hidden_rad + middle_rad:
            return 0

    return UNSEEN


def _bearing_of(node: Object, agent: Self) -> float:
    direction_rad = math.atan2(node.y_m - agent.y_m, node.x_m - agent.x_m)
    return math.remainder(direction_rad - agent.heading_rad, math.tau)
