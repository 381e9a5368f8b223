"""When the codelets of map correction are called, and with what: the path grows, a loop closes, the map moves."""

from __future__ import annotations

import numpy as np

from bus.graph import Graph, object_id
from schemas.array import Array
from schemas.graph import Node, PlaceTile
from schemas.mind import Task
from schemas.sensing import Percept
from services.workspace.scene import SELF, Scene, task_of
from services.workspace.settings import Config

PATH, CLOSURE, CORRECTION = "path", "closure", "correction"


def path_tasks(scene: Scene, graph: Graph, spacing_m: float) -> list[Task]:
    """One where the agent is `spacing_m` or more from the path's last place."""
    agent, last = graph.nodes[SELF], _last(graph)
    if last is None:
        return [task_of(scene, graph, "path", [agent], [])]
    if last.samples is None:
        return []
    x_m, y_m = last.samples.numpy()[-1, 1:3].tolist()
    far = np.hypot(float(agent.attributes["x_m"]) - x_m, float(agent.attributes["y_m"]) - y_m) >= spacing_m
    return [task_of(scene, graph, "path", [agent, last], [])] if far else []


def shift_tasks(scene: Scene, graph: Graph) -> list[Task]:
    """One where a correction waits to be carried out: it gets the whole map."""
    if CORRECTION not in graph.nodes:
        return []
    agent, correction = graph.nodes[SELF], graph.nodes[CORRECTION]
    objects = [graph.nodes[name] for name in sorted(graph.nodes) if graph.nodes[name].kind == "object"]
    task = task_of(scene, graph, "map_shift", [agent, correction, *_of_kind(graph, PATH), *objects], [])
    task.tiles = [tile for tile in _tiles(graph) if tile.road.numpy().any()]
    return [task]


def correction_tasks(scene: Scene, graph: Graph, config: Config) -> list[Task]:
    """One where a landmark or a view comes again that was away for long, unless a loop was closed just now."""
    percepts, now_ns = scene.percepts, scene.percepts.stamp_ns
    closures = _of_kind(graph, CLOSURE)
    newest_ns = max((int(node.attributes["to_ns"]) for node in closures), default=-(2**62))
    if CORRECTION in graph.nodes or now_ns < newest_ns + config.closure_spacing_s * 1e9:
        return []
    long_ago_ns = now_ns - config.revisit_s * 1e9
    again = [percept for percept in percepts.objects if _was_away(graph, percept, long_ago_ns)]
    matches = [match for match in percepts.matches if match.view_ns <= long_ago_ns]
    if not again and not matches:
        return []
    known = [graph.nodes[object_id(percept.label)] for percept in again]
    nodes = [graph.nodes[SELF], *known, *_of_kind(graph, PATH), *closures]
    task = task_of(scene, graph, "map_correction", nodes, again)
    task.matches = matches
    return [task]


def _was_away(graph: Graph, percept: Percept, long_ago_ns: float) -> bool:
    node = graph.nodes.get(object_id(percept.label))
    return percept.whole and node is not None and int(node.attributes.get("stamp_ns", 2**62)) <= long_ago_ns


def _last(graph: Graph) -> Node | None:
    path = _of_kind(graph, PATH)
    return max(path, key=lambda node: int(node.attributes["number"]), default=None)


def _of_kind(graph: Graph, kind: str) -> list[Node]:
    return [graph.nodes[name] for name in sorted(graph.nodes) if graph.nodes[name].kind == kind]


def _tiles(graph: Graph) -> list[PlaceTile]:
    return [
        PlaceTile(
            x=x,
            y=y,
            side=len(tile.columns["road"]),
            cell_m=graph.cell_m,
            **{name: Array.of(column) for name, column in tile.columns.items()},
        )
        for (x, y), tile in sorted(graph.tiles.items())
    ]
