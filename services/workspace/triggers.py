"""Which codelets a cycle calls, with what: the phases of a cycle, each after what the one before
committed.
"""

from __future__ import annotations

import msgspec
import numpy as np

from cogmap.graph.graph import Graph, object_id
from schemas.array import Array
from schemas.cognition import Task
from schemas.graph import Links, Node, Operation
from schemas.sensing import Percepts
from services.workspace.context import SELF, Scene, task_of
from services.workspace.loop_closure import path_tasks, seen_lately, shift_tasks

PHASES = ("shift", "localization", "objects", "attention")


def first_self(samples: int) -> Node:
    """The self node before anything is known: the agent's own origin, for certain."""
    where: dict[str, float | int | str | bool] = {
        "x_m": 0.0,
        "y_m": 0.0,
        "heading_rad": 0.0,
        "stamp_ns": -1,
    }
    zeros = Array.of(np.zeros((samples, 3)))
    return Node(
        id=SELF, kind="self", activation=1.0, base_level=1.0, attributes=where, samples=zeros
    )


def recognised(percepts: Percepts, threshold: float) -> Percepts:
    """Without the objects whose total activation is not over `threshold`: which they are is too
    unsure to map by.
    """
    objects = [percept for percept in percepts.objects if percept.activation > threshold]
    return (
        percepts
        if len(objects) == len(percepts.objects)
        else msgspec.structs.replace(percepts, objects=objects)
    )


def percept_operations(graph: Graph, percepts: Percepts) -> list[Operation]:
    """The PAM nodes over threshold, entering the workspace, each linked to the object that it is an
    instance of.
    """
    nodes: list[Operation] = []
    weights = {}
    for percept in percepts.objects:
        node = Node(
            id=f"percept:{percept.label}",
            kind="percept",
            activation=percept.activation,
            attributes={
                "label": percept.label,
                "bearing_rad": percept.bearing_rad,
                "range_m": percept.range_m,
            },
        )
        nodes.append(node)
        if object_id(percept.label) in graph.nodes:
            weights[node.id] = {object_id(percept.label): 1.0}
    return [*nodes, Links(kind="instance", weights=weights)] if weights else nodes


def tasks_for(phase: str, scene: Scene, graph: Graph, spacing_m: float) -> list[Task]:
    """The tasks of a phase, in the order in which their answers will be committed."""
    agent = graph.nodes[SELF]
    seen = {percept.label: percept for percept in scene.percepts.objects}
    known = [
        node for label in sorted(seen) if (node := graph.nodes.get(object_id(label))) is not None
    ]
    if phase == "shift":
        return shift_tasks(scene, graph)
    if phase == "localization":
        before = seen_lately(graph) if agent.attributes.get("others", False) else []
        nodes = {node.id: node for node in (agent, *known, *before)}
        return [
            task_of(
                scene, graph, "localization", list(nodes.values()), list(scene.percepts.objects)
            )
        ]
    if phase == "attention":
        bare = [_bare(node) for node in (agent, *known)]
        return [task_of(scene, graph, "attention", bare, [])]
    road = task_of(scene, graph, "road_place", [agent], [])
    return [*object_tasks(scene, graph), road, *path_tasks(scene, graph, spacing_m)]


def object_tasks(scene: Scene, graph: Graph) -> list[Task]:
    """One for each object in view: to be placed where it is new, to be located again where it is
    known.
    """
    agent = graph.nodes[SELF]
    seen = {percept.label: percept for percept in scene.percepts.objects}
    tasks = []
    for label in sorted(seen):
        node = graph.nodes.get(object_id(label))
        codelet, nodes = ("object_place", [agent]) if node is None else ("landmark", [agent, node])
        tasks.append(task_of(scene, graph, codelet, nodes, [seen[label]]))
    return tasks


def _bare(node: Node) -> Node:
    return Node(
        id=node.id,
        kind=node.kind,
        activation=node.activation,
        base_level=node.base_level,
        attributes=node.attributes,
    )
