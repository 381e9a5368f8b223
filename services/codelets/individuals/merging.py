"""The merging codelet: two objects of the map that turn out to be one become one, wherever they are
referred to (beyond the paper).

A loop that has drifted brings known things back as new ones. Once the map is corrected, both stand
in one place.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import msgspec
import numpy as np

from cogmap.graph.graph import Graph
from cogmap.graph.individuals import is_same, names_of_both, reach_m
from cogmap.graph.likeness import MAX_APPEARANCES
from cogmap.runtime.codelet import Answer, Codelet, CycleContext, NoSettings
from cogmap.schemas.array import Matrix
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import DropNode, Link, Operation, Phase
from cogmap.schemas.nodes import (
    Goal,
    LinkKind,
    LoopClosure,
    Object,
    ObservationColumn,
    Observations,
    nearest_place,
    object_id,
    observations_id,
    place_id,
)
from cogmap.services.codelets.mapping.path import links_of
from cogmap.services.codelets.nodes import nodes_of

EVERY = 5
"""Cycles from one look around to the next: a correction brings two objects to one place, seldom."""

ESTABLISHED = 3
"""Objects that were seen less often are forgotten by themselves, if they are mistakes."""


def due(context: CycleContext, graph: Graph, config: NoSettings) -> list[Task]:
    """Return a task for the first two objects, of which one is in view, that are one."""
    if context.cycle % EVERY:
        return []

    in_view = {object_id(percept.label) for percept in context.percepts.objects}
    for node in nodes_of(graph, Object, sorted(in_view)):
        for other in _beside(node, graph):
            # What is seen as two in one view is two.
            are_two = other.id in in_view
            if not are_two and _are_one(node, other):
                return [context.task(CODELET.name, [node.id, other.id])]

    return []


def run(task: Task, graph: Graph, config: NoSettings) -> Answer:
    """Make the object that was seen more often of both, and let all that refers to the other refer
    to it.
    """
    both = nodes_of(graph, Object, task.about)
    if len(both) < 2 or not _are_one(*both):
        return Answer()

    kept, gone = sorted(both, key=lambda node: (-node.sightings, node.created_ns, node.id))
    one = merged(kept, gone)
    place = nearest_place(one.x_m, one.y_m, graph.cell_m(one.map), one.map)
    operations: list[Operation] = [one, Link(source=one.id, target=place, kind=LinkKind.AT)]
    operations += _observations(kept, gone, graph)
    for closure in graph.of_kind(LoopClosure):
        if closure.cue == gone.label:
            operations.append(msgspec.structs.replace(closure, cue=kept.label))
    for goal in graph.of_kind(Goal):
        if goal.object == gone.label:
            operations.append(msgspec.structs.replace(goal, object=kept.label))

    return Answer([*operations, DropNode(id=gone.id)])


CODELET = Codelet(
    name="merging",
    phase=Phase.ATTENTION,
    due=due,
    run=run,
    reads=frozenset({Object, Observations, LoopClosure, Goal, LinkKind.OBSERVES, LinkKind.AT}),
    writes=frozenset(
        {
            Object,
            Observations,
            LoopClosure,
            Goal,
            LinkKind.AT,
            LinkKind.OBSERVES,
            LinkKind.ALONG,
        }
    ),
)


def merged(kept: Object, gone: Object) -> Object:
    """Return the one object that two are: where both were seen, as often as both, with the names
    and looks of both.
    """
    weight = gone.sightings / (kept.sightings + gone.sightings)
    x_m = kept.x_m + weight * (gone.x_m - kept.x_m)
    y_m = kept.y_m + weight * (gone.y_m - kept.y_m)

    sides = [each.appearances.numpy() for each in (kept, gone) if each.appearances is not None]
    appearances = None
    if len({side.shape[1] for side in sides}) == 1:
        appearances = Matrix.of(np.vstack(sides)[:MAX_APPEARANCES], "<f2")

    last_seen = max(kept, gone, key=lambda node: node.last_seen_ns)
    return msgspec.structs.replace(
        kept,
        names=names_of_both(kept, gone),
        given_name=kept.given_name or gone.given_name,
        appearances=appearances,
        function=kept.function or gone.function,
        x_m=x_m,
        y_m=y_m,
        sightings=kept.sightings + gone.sightings,
        last_seen_ns=last_seen.last_seen_ns,
        last_sighting=last_seen.last_sighting,
        created_ns=min(kept.created_ns, gone.created_ns),
    )


def _are_one(one: Object, other: Object) -> bool:
    is_given = one.surveyed or other.surveyed
    is_sure = min(one.sightings, other.sightings) >= ESTABLISHED
    return is_sure and not is_given and is_same(one, other)


def _beside(node: Object, graph: Graph) -> Iterator[Object]:
    """Yield the other objects that stand so near that they may be the same."""
    cell_m = graph.cell_m(node.map)
    reach = math.ceil(reach_m(node, node) / cell_m)
    middle_i = round(node.x_m / cell_m)
    middle_j = round(node.y_m / cell_m)
    for i in range(middle_i - reach, middle_i + reach + 1):
        for j in range(middle_j - reach, middle_j + reach + 1):
            names = graph.links.sources(place_id(i, j, node.map), LinkKind.AT)
            for other in nodes_of(graph, Object, names):
                if other.id != node.id:
                    yield other


def _observations(kept: Object, gone: Object, graph: Graph) -> list[Operation]:
    """Let the observations of one object be of the other. A place keeps its first one of each."""
    operations: list[Operation] = []
    for node in nodes_of(graph, Observations, graph.links.sources(gone.id, LinkKind.OBSERVES)):
        before = graph.get(Observations, observations_id(node.number, kept.label))
        rows = node.rows.numpy()
        if before is not None:
            rows = np.vstack([before.rows.numpy(), rows])

        _, first = np.unique(rows[:, ObservationColumn.STAMP_S], return_index=True)
        after = Observations(
            id=observations_id(node.number, kept.label),
            base_level=1.0,
            number=node.number,
            landmark=kept.label,
            rows=Matrix.of(rows[first]),
        )
        operations.append(after)
        operations += links_of(after) if before is None else []
        operations.append(DropNode(id=node.id))

    return operations
