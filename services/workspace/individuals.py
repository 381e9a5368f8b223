"""Decides of which individual object each percept is a sighting.

Perception recognises what an object looks like, and buildings may look alike. If it is certain
where the agent is, a percept far from every object of its name is of another object. That is the
one that was seen at its place recently, as two objects cannot stand in one place; without such a
one it is new. The same holds for a percept near an object of its name that was seen fewer than
ESTABLISHED times, which may itself be a mistake.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import NamedTuple

import msgspec
import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import moved_by
from cogmap.graph.graph import Graph
from cogmap.graph.individuals import APART_M
from cogmap.schemas import nodes
from cogmap.schemas.array import Array
from cogmap.schemas.nodes import NEVER_NS, Object, Self, individual_label, object_id
from cogmap.schemas.sensing import Percept, Percepts

GATE = 2.0
"""Beyond so many standard deviations a percept is of another object."""

ESTABLISHED = 3
"""An object that was seen so often stands where it is."""

MAX_INDIVIDUALS = 64
"""Objects that look alike, at most, for each percept is compared with all of them."""

NOT_ELSEWHERE_NS = 20_000_000_000
"""For so long it holds that the agent can be nowhere else; chosen, not tuned."""


class Candidate(NamedTuple):
    """The individual nearest to a percept: its label, whether the percept may be of it, and whether
    that is certain, for it was seen often or was given.

    `unused` is a label that no individual has yet, empty if there are too many. The percept is
    seen at (x, y) `seen_m`.
    """

    label: str
    is_near: bool
    is_established: bool
    unused: str
    seen_m: tuple[float, float]


def individuals(percepts: Percepts, graph: Graph, motions: Array) -> Percepts:
    """Label each of `percepts` by the individual object that it is of.

    `motions` are those since the self node was moved last.
    """
    agent = graph.agent
    if agent is None:
        return percepts

    before = np.array([agent.x_m, agent.y_m, agent.heading_rad])
    pose = moved_by(before, np.asarray(motions.numpy(), np.float64))
    candidates = [_candidate(percept, pose, agent, graph) for percept in percepts.objects]

    # It is certain where the agent is: it was found not long ago that it can be nowhere else, or an
    # object is seen where it stands that stood there before anything did not fit.
    found_ns = agent.misfits.not_elsewhere_ns
    is_here = found_ns != NEVER_NS and percepts.stamp_ns - found_ns <= NOT_ELSEWHERE_NS
    for candidate in candidates:
        node = graph.get(Object, object_id(candidate.label))
        if node is not None and candidate.is_near:
            is_here |= node.created_ns <= agent.misfits.last_fit_ns

    taken = {candidate.label for candidate in candidates if candidate.is_near}
    objects = []
    for percept, candidate in zip(percepts.objects, candidates, strict=True):
        label = candidate.label
        is_certain = candidate.is_near and candidate.is_established
        if is_here and not is_certain and candidate.unused:
            other = candidate.label if candidate.is_near else candidate.unused
            label = _standing_there(percept, candidate, graph, taken) or other
            taken.add(label)
        objects.append(msgspec.structs.replace(percept, label=label))

    return msgspec.structs.replace(percepts, objects=objects)


def as_entered(percepts: Percepts, graph: Graph) -> Percepts:
    """Return `percepts` by the labels with which they entered the graph in this cycle, before the
    workspace was interrupted.
    """
    label_of = {}
    for node in graph.of_kind(nodes.Percept):
        if node.cycle == graph.cycle:
            label_of[node.bearing_rad, node.range_m] = node.label

    objects = []
    for percept in percepts.objects:
        label = label_of.get((percept.bearing_rad, percept.range_m), percept.label)
        objects.append(msgspec.structs.replace(percept, label=label))

    return msgspec.structs.replace(percepts, objects=objects)


def _standing_there(
    percept: Percept, candidate: Candidate, graph: Graph, others: Collection[str]
) -> str:
    """Find the object that a percept can only be of, by where it is: the nearest that was seen
    recently, and is not among `others`. Return its label, empty if there is none.
    """
    agent = graph.agent
    assert agent is not None
    standing = ""
    nearest_m = math.inf
    for seen in graph.of_kind(nodes.Percept):
        node = graph.get(Object, object_id(seen.label))
        if node is None or node.sightings < ESTABLISHED or node.label in others:
            continue

        away_m = math.dist(candidate.seen_m, (node.x_m, node.y_m))
        near_m = min(APART_M, max(APART_M / 2, GATE * _sd_m(percept, agent, node)))
        if away_m <= near_m and away_m < nearest_m:
            nearest_m = away_m
            standing = node.label

    return standing


def _candidate(percept: Percept, pose: Floats, agent: Self, graph: Graph) -> Candidate:
    if not (percept.has_bearing and percept.has_range):
        return Candidate(percept.label, True, True, "", (math.nan, math.nan))

    x_m, y_m, heading_rad = pose.tolist()
    direction_rad = heading_rad + percept.bearing_rad
    seen_m = (
        x_m + percept.range_m * math.cos(direction_rad),
        y_m + percept.range_m * math.sin(direction_rad),
    )

    candidate = Candidate(percept.label, False, False, "", seen_m)
    nearest_m = math.inf
    unused = ""
    for number in range(1, MAX_INDIVIDUALS + 1):
        label = individual_label(percept.label, number)
        node = graph.get(Object, object_id(label))
        if node is None:
            unused = unused or label
            continue

        if node.surveyed:
            return Candidate(label, True, True, "", seen_m)

        away_m = math.dist(seen_m, (node.x_m, node.y_m))
        if away_m < nearest_m:
            nearest_m = away_m
            near_m = max(APART_M, GATE * _sd_m(percept, agent, node))
            is_established = node.sightings >= ESTABLISHED
            candidate = Candidate(label, away_m <= near_m, is_established, "", seen_m)

    return candidate._replace(unused=unused)


def _sd_m(percept: Percept, agent: Self, node: Object) -> float:
    """Return the standard deviation of the distance from where an object is seen to where it is."""
    bearing_sd_rad = math.hypot(percept.bearing_sd_rad, agent.heading_sd_rad)
    across_sd_m = percept.range_m * bearing_sd_rad
    return math.hypot(
        percept.range_sd_m,
        across_sd_m,
        agent.x_sd_m,
        agent.y_sd_m,
        node.x_sd_m,
        node.y_sd_m,
    )
