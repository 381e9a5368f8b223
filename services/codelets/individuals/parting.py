"""The parting codelet: one object of the map that turns out to be two becomes two, wherever it is
referred to (beyond the paper).

Two buildings that were taken for one are told apart once both have been seen from several sides:
what is seen of one building has one place, from wherever it is seen.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.estimation.pose_graph import matvec
from cogmap.geometry.arrays import Booleans, Floats
from cogmap.geometry.se2 import rotation_matrices, transform_from
from cogmap.graph.graph import Graph
from cogmap.graph.individuals import OVERLAP
from cogmap.graph.path import rows_of
from cogmap.runtime.codelet import Answer, Codelet, CycleContext, NoSettings
from cogmap.schemas.array import Matrix
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import DropNode, Link, Operation, Phase
from cogmap.schemas.nodes import (
    LinkKind,
    LoopClosure,
    Object,
    Observations,
    PathSegment,
    individual_label,
    nearest_place,
    object_id,
    observations_id,
)
from cogmap.services.codelets.localization.information import INDEPENDENT_RAD
from cogmap.services.codelets.mapping.observations import Sightings
from cogmap.services.codelets.mapping.path import POSE, STAMP, links_of
from cogmap.services.codelets.nodes import nodes_of

EVERY = 5
"""Cycles from one look at an object in view to the next."""

OFFSET = 2
"""Its cycles are not those of merging."""

ORIGIN = "parted"
"""What the labels of parted objects begin with."""

GATE = 3.0
"""An observation farther from a place, in standard deviations, is not of what stands there."""

MIN_OBSERVATIONS = 6
"""So many observations at least are of each of two objects. They are a metre of path apart."""


MAX_TRIED = 100
"""Observations of which each is tried as the place of most: a bound on the time."""


class Parts(NamedTuple):
    """The two places, (2,) each, at which what was taken for one object stands, and which of the m
    observations are of the second.
    """

    first_m: Floats
    second_m: Floats
    is_second: Booleans


def due(context: CycleContext, graph: Graph, config: NoSettings) -> list[Task]:
    """Return a task for one of the objects in view, in turn."""
    turn, offset = divmod(context.cycle, EVERY)
    if offset != OFFSET:
        return []

    in_view = {object_id(percept.label) for percept in context.percepts.objects}
    known = [node for node in nodes_of(graph, Object, sorted(in_view)) if not node.surveyed]
    often = [node for node in known if node.sightings >= 2 * MIN_OBSERVATIONS]
    if not often:
        return []
    return [context.task(CODELET.name, [often[turn % len(often)].id])]


def run(task: Task, graph: Graph, config: NoSettings) -> Answer:
    """Make a second object of what was seen elsewhere than the first stands, if that was seen from
    sides that err independently, and nothing else is known to stand there.
    """
    (name,) = task.about
    node = graph.get(Object, name)
    if node is None:
        raise MessageError(f"task {task.task_id}: the graph lacks {name}")

    path = rows_of(graph.of_kind(PathSegment))
    observed = nodes_of(graph, Observations, graph.links.sources(name, LinkKind.OBSERVES))
    observed.sort(key=lambda each: each.number)
    parts = parts_of(node, observed, path)
    if parts is None or _is_taken(node, parts, graph):
        return Answer()

    label = individual_label(task.cycle, 0, ORIGIN)
    share = float(parts.is_second.mean())
    second = msgspec.structs.replace(
        node,
        id=object_id(label),
        label=label,
        names={each: share * evidence for each, evidence in node.names.items()},
        given_name="",
        x_m=float(parts.second_m[0]),
        y_m=float(parts.second_m[1]),
        sightings=int(parts.is_second.sum()),
        seen_from_m=None,
        last_sighting=None,
    )
    first = msgspec.structs.replace(
        node,
        names={each: (1 - share) * evidence for each, evidence in node.names.items()},
        x_m=float(parts.first_m[0]),
        y_m=float(parts.first_m[1]),
        last_sighting=None,
        sightings=max(1, node.sightings - second.sightings),
    )
    operations: list[Operation] = []
    for each in (first, second):
        place = nearest_place(each.x_m, each.y_m, graph.cell_m(each.map), each.map)
        operations += [each, Link(source=each.id, target=place, kind=LinkKind.AT)]

    operations += _observations(observed, parts, label)
    operations += _closures(node, label, parts, path, graph)
    return Answer(operations)


CODELET = Codelet(
    name="parting",
    phase=Phase.ATTENTION,
    due=due,
    run=run,
    reads=frozenset(
        {Object, Observations, PathSegment, LoopClosure, LinkKind.OBSERVES, LinkKind.AT}
    ),
    writes=frozenset(
        {
            Object,
            Observations,
            LoopClosure,
            LinkKind.AT,
            LinkKind.OBSERVES,
            LinkKind.ALONG,
        }
    ),
)


def parts_of(node: Object, observed: list[Observations], path: Floats) -> Parts | None:
    """Find the two places at which the observations of an object from the places of a `path` state
    that it stands; None if one place explains them.
    """
    seen = Sightings.of(observed, path[:, STAMP])
    count = sum(len(each.rows.numpy()) for each in observed)
    if len(seen.place) < 2 * MIN_OBSERVATIONS or len(seen.place) < count:
        return None

    poses = path[seen.place][:, POSE]
    turn = rotation_matrices(poses[:, 2])
    at_m = poses[:, :2] + matvec(turn, seen.where_m)
    information = turn @ seen.information @ turn.mT

    first_m = _place_of_most(at_m, information)
    is_first = _are_at(first_m, at_m, information)
    away = ~is_first
    if away.sum() < MIN_OBSERVATIONS:
        return None

    second_m = _place_of_most(at_m[away], information[away])
    is_second = away & _are_at(second_m, at_m, information)
    views = poses[is_second, :2]
    if is_second.sum() < MIN_OBSERVATIONS or math.dist(first_m, second_m) < node.width_m:
        return None

    # A stretch of the way on which it was misjudged all the time is one mistake.
    way_m = math.dist(views.min(axis=0), views.max(axis=0))
    distance_m = float(np.median(np.hypot(*(views - second_m).T)))
    if way_m < INDEPENDENT_RAD * distance_m:
        return None

    return Parts(first_m, second_m, is_second)


def _place_of_most(at_m: Floats, information: Floats) -> Floats:
    """Find the place (2,) that most of the observations, (m, 2) with information (m, 2, 2), are of:
    the mean of those that are of one place with one of them.
    """
    tried = at_m[:: max(1, len(at_m) // MAX_TRIED)]
    together = [_are_at(place_m, at_m, information) for place_m in tried]
    most = together[int(np.argmax([each.sum() for each in together]))]
    pull = matvec(information[most], at_m[most]).sum(axis=0)
    return np.asarray(np.linalg.solve(information[most].sum(axis=0), pull))


def _are_at(place_m: Floats, at_m: Floats, information: Floats) -> Booleans:
    """Decide which of the observations, (m, 2) with information (m, 2, 2), are of a place (2,)."""
    residual_m = at_m - place_m
    squared = np.einsum("ma,mab,mb->m", residual_m, information, residual_m)
    return np.asarray(squared < GATE**2)


def _is_taken(node: Object, parts: Parts, graph: Graph) -> bool:
    """Decide whether another object stands where the second one would."""
    for other in graph.of_kind(Object):
        if other.id != node.id and other.map == node.map:
            apart_m = OVERLAP * (node.width_m + other.width_m) / 2
            if math.dist(parts.second_m, (other.x_m, other.y_m)) < apart_m:
                return True

    return False


def _observations(observed: list[Observations], parts: Parts, label: str) -> list[Operation]:
    """Let the observations of the second object be of it."""
    operations: list[Operation] = []
    start = 0
    for node in observed:
        rows = node.rows.numpy()
        is_second = parts.is_second[start : start + len(rows)]
        start += len(rows)
        if not is_second.any():
            continue

        moved = Observations(
            id=observations_id(node.number, label),
            base_level=1.0,
            number=node.number,
            landmark=label,
            rows=Matrix.of(rows[is_second]),
        )
        operations += [moved, *links_of(moved)]
        if is_second.all() and node.ranges is None:
            operations.append(DropNode(id=node.id))
        else:
            left = Matrix.of(rows[~is_second])
            operations.append(msgspec.structs.replace(node, rows=left))

    return operations


def _closures(
    node: Object, label: str, parts: Parts, path: Floats, graph: Graph
) -> list[Operation]:
    """Let the loop closures by the second object be by it, and drop those from one to the other."""
    operations: list[Operation] = []
    for closure in graph.of_kind(LoopClosure):
        if closure.cue != node.label or closure.range_alone:
            continue

        before, after = (
            path[max(0, int(path[:, STAMP].searchsorted(stamp_ns * 1e-9, side="right")) - 1), POSE]
            for stamp_ns in (closure.from_ns, closure.to_ns)
        )
        seen_rad = closure.bearing_rad
        seen_m = closure.range_m * np.array([math.cos(seen_rad), math.sin(seen_rad)])
        ends_m = (
            transform_from(before, np.array([closure.ahead_m, closure.left_m])),
            transform_from(after, seen_m),
        )
        of_second = {
            math.dist(end_m, parts.second_m) < math.dist(end_m, parts.first_m) for end_m in ends_m
        }
        if len(of_second) == 2:
            operations.append(DropNode(id=closure.id))
        elif True in of_second:
            operations.append(msgspec.structs.replace(closure, cue=label))

    return operations
