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

PATH, SIGHTED, CLOSURE, CORRECTION = "path", "sighted", "closure", "correction"


def path_tasks(scene: Scene, graph: Graph, spacing_m: float) -> list[Task]:
    """One where the agent is `spacing_m` or more from the path's last place, or sees what it had not from there."""
    agent, last = graph.nodes[SELF], _last(graph)
    if last is None or last.samples is None:
        return [task_of(scene, graph, "path", [agent], scene.percepts.objects)]
    number = int(last.attributes["number"])
    stamp_s, x_m, y_m = last.samples.numpy()[-1, :3].tolist()
    far = np.hypot(float(agent.attributes["x_m"]) - x_m, float(agent.attributes["y_m"]) - y_m) >= spacing_m
    known = {each.label: graph.nodes.get(f"{SIGHTED}:{number}:{each.label}") for each in scene.percepts.objects}
    new = [each for each in scene.percepts.objects if far or not _seen_from(known[each.label], stamp_s)]
    if not far and not new:
        return []
    sighted = [node for each in new if (node := known[each.label]) is not None]
    return [task_of(scene, graph, "path", [agent, last, *sighted], new)]


def _seen_from(sighted: Node | None, stamp_s: float) -> bool:
    """Whether the last of a landmark's sightings is from the place of the path at `stamp_s`."""
    return sighted is not None and sighted.samples is not None and float(sighted.samples.numpy()[-1, 0]) >= stamp_s


def shift_tasks(scene: Scene, graph: Graph) -> list[Task]:
    """One where a correction waits to be carried out: it gets the whole map."""
    if CORRECTION not in graph.nodes:
        return []
    agent, correction = graph.nodes[SELF], graph.nodes[CORRECTION]
    objects = [graph.nodes[name] for name in sorted(graph.nodes) if graph.nodes[name].kind == "object"]
    way = [*_of_kind(graph, PATH), *_of_kind(graph, SIGHTED)]
    task = task_of(scene, graph, "map_shift", [agent, correction, *way, *objects], [])
    task.tiles = [tile for tile in _tiles(graph) if tile.road.numpy().any()]
    return [task]


def correction_tasks(scene: Scene, graph: Graph, config: Config) -> list[Task]:
    """One where a landmark or a view comes again that was away for long, unless a loop was closed just now."""
    percepts, now_ns = scene.percepts, scene.percepts.stamp_ns
    long_ago_ns = now_ns - config.revisit_s * 1e9
    again = [percept for percept in percepts.objects if _was_away(graph, percept, long_ago_ns)]
    matches = [match for match in percepts.matches if match.view_ns <= long_ago_ns]
    if CORRECTION in graph.nodes or not (again or matches):
        return []
    closures = _of_kind(graph, CLOSURE)
    newest_ns = max((int(node.attributes["to_ns"]) for node in closures), default=-(2**62))
    if now_ns < newest_ns + config.closure_spacing_s * 1e9:
        return []
    known = [graph.nodes[object_id(percept.label)] for percept in again]
    nodes = [graph.nodes[SELF], *known, *_of_kind(graph, PATH), *_of_kind(graph, SIGHTED), *closures]
    task = task_of(scene, graph, "map_correction", nodes, again)
    task.matches = matches
    return [task]


def _was_away(graph: Graph, percept: Percept, long_ago_ns: float) -> bool:
    node = graph.nodes.get(object_id(percept.label))
    return percept.whole and node is not None and int(node.attributes.get("stamp_ns", 2**62)) <= long_ago_ns


def _last(graph: Graph) -> Node | None:
    """The last node of the path, whose nodes are numbered from 0: found without a look at the rest of the map."""
    number = 0
    while f"{PATH}:{number}" in graph.nodes:
        number += 1
    return graph.nodes.get(f"{PATH}:{number - 1}")


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
