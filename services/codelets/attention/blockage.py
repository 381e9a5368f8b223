"""Road that the plan leads along, or that the agent drove over, and that is blocked now: a
prediction that fails. The rays of the range scan along it should pass, and end across it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats
from cogmap.geometry.se2 import transform_from, wrap_angle
from cogmap.graph.graph import Graph
from cogmap.schemas.array import Array
from cogmap.schemas.nodes import PLAN_ID, SELF_ID, Plan, Self, place_cell, place_id
from cogmap.services.codelets.attention.lanes import Lane, lanes

# Measured in six development towns: 18 of 19 blocked streets are conscious within 1.7 s.
# Farther away, rays are farther apart than a lane is wide; nearer, what stands there was seen
# before.
FARTHEST_M = 35.0
NEAREST_M = 4.0
# A lane that lies more aslant is seen from too far aside to tell if it is blocked.
MAX_SLANT_RAD = math.pi / 4
# Rays count that pass within so far of the middle of the lane. What they hit may be seen as far
# from the place before and behind it, and on both sides reaches at least so far across.
HALF_WIDTH_M = 2.5
ALONG_M = 1.0
ALONG_SHARE = 0.04
SPAN_M = 1.5
MIN_RAYS = 2
ENDING_SHARE = 0.75
# What is found so near to where a street was blocked is the same blockage.
SAME_M = 12.0


def blocked_places(scan: Array, agent: Self, graph: Graph) -> list[str]:
    """Return the ids of the place nodes at which rays of a scan end across a lane that the agent
    counts on: the nearest of the plan's route, and the nearest of where it drove.
    """
    rays = np.asarray(scan.numpy(), np.float64)
    cell_m = graph.cell_m(agent.map)
    blocked = []
    for lane in lanes(agent, graph):
        # The places that the agent looks along from not too far, the nearest first.
        away_m, slant_rad, _ = _as_seen(lane, agent)
        is_near = (away_m >= NEAREST_M) & (away_m <= FARTHEST_M) & (slant_rad <= MAX_SLANT_RAD)
        order = np.argsort(away_m[is_near], kind="stable")
        seen = lane.where(is_near)
        near = Lane(seen.position_m[order], seen.heading_rad[order])
        places_m = near.position_m[_is_blocked(near, rays, agent)]
        for x_m, y_m in places_m[:1].tolist():
            blocked.append(place_id(round(x_m / cell_m), round(y_m / cell_m), agent.map))

    return blocked


def expected_by(place: str, graph: Graph) -> str:
    """Return the id of what counted on a place node that is blocked: the plan, if its route leads
    past there, else the agent, which drove there.
    """
    plan = graph.get(Plan, PLAN_ID)
    cell = place_cell(place)
    if plan is None or plan.route is None or cell is None or plan.map != cell[0]:
        return SELF_ID

    at_m = np.array(cell[1:]) * graph.cell_m(plan.map)
    away_m = np.hypot(*(plan.route.numpy() - at_m).T)
    return PLAN_ID if float(away_m.min()) <= SAME_M else SELF_ID


def is_known(place: str, noted: Mapping[str, int], since_cycle: int, cell_m: float) -> bool:
    """Return whether a place node is near one that was noted in `since_cycle` or later, by id."""
    here = place_cell(place)
    for known, cycle in noted.items():
        there = place_cell(known)
        if here is None or there is None or here[0] != there[0] or cycle < since_cycle:
            continue
        if math.dist(here[1:], there[1:]) * cell_m <= SAME_M:
            return True

    return False


def _is_blocked(lane: Lane, rays: Floats, agent: Self) -> Booleans:
    """Decide for each place of a lane, (n,), whether most of the rays (k, 2), bearing and range
    each, that lead there end there, across the lane.
    """
    bearing_rad, range_m = rays.T
    away_m, slant_rad, lane_rad = _as_seen(lane, agent)
    half_rad = np.arctan2(HALF_WIDTH_M * np.cos(slant_rad), away_m)
    leads_there = np.abs(wrap_angle(bearing_rad - lane_rad[:, None])) <= half_rad[:, None]

    # Where rays end, along and across the lane from each of its places, (n, k).
    ahead = np.stack([np.cos(bearing_rad), np.sin(bearing_rad)], axis=-1)
    eye = np.array([agent.x_m, agent.y_m, agent.heading_rad])
    ends_m = transform_from(eye, range_m[:, None] * ahead)
    offset_m = ends_m - lane.position_m[:, None]
    cos = np.cos(lane.heading_rad)[:, None]
    sin = np.sin(lane.heading_rad)[:, None]
    along_m = offset_m[..., 0] * cos + offset_m[..., 1] * sin
    across_m = offset_m[..., 1] * cos - offset_m[..., 0] * sin

    is_near = np.abs(along_m) <= (ALONG_M + ALONG_SHARE * away_m)[:, None]
    has_ended = range_m > 0
    ends_there = leads_there & has_ended & is_near & (np.abs(across_m) <= HALF_WIDTH_M)

    number = ends_there.sum(axis=1)
    is_most = number >= np.maximum(MIN_RAYS, ENDING_SHARE * leads_there.sum(axis=1))
    leftmost_m = np.where(ends_there, across_m, -np.inf).max(axis=1, initial=-np.inf)
    rightmost_m = np.where(ends_there, across_m, np.inf).min(axis=1, initial=np.inf)
    is_blocked: Booleans = is_most & (leftmost_m - rightmost_m >= SPAN_M)
    return is_blocked


def _as_seen(lane: Lane, agent: Self) -> tuple[Floats, Floats, Floats]:
    """Compute how far away the places of a lane are, how much the lane there is aslant to the line
    of sight, and their bearings, (n,) each.
    """
    offset_m = lane.position_m - (agent.x_m, agent.y_m)
    direction_rad = np.arctan2(offset_m[:, 1], offset_m[:, 0])
    slant_rad = np.arccos(np.abs(np.cos(direction_rad - lane.heading_rad)))
    return np.hypot(*offset_m.T), slant_rad, direction_rad - agent.heading_rad
