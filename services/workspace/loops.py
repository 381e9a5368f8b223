"""When the codelets of map correction are called, and with what: the path grows, a loop closes, the map moves."""

from __future__ import annotations

import math
from bisect import bisect_right

from bus.graph import Graph, object_id
from schemas.array import Array
from schemas.graph import Node, PlaceTile
from schemas.mind import Task
from services.workspace.scene import SELF, Scene, task_of
from services.workspace.settings import Config

PATH, SIGHTED, CLOSURE, CORRECTION = "path", "sighted", "closure", "correction"
MET = ""
ODOMETRY, ODOMETRY_FACTS = slice(4, 6), ("odometry_x_m", "odometry_y_m")


def path_tasks(scene: Scene, graph: Graph, spacing_m: float) -> list[Task]:
    """One where the path grows, or the agent sees what it had not seen from the path's last place."""
    agent, last, far = graph.nodes[SELF], _last(graph), _grows(graph, spacing_m)
    if last is None or last.samples is None:
        return [task_of(scene, graph, "path", [agent], scene.percepts.objects)]
    number, stamp_s = int(last.attributes["number"]), float(last.samples.numpy()[-1, 0])
    known = {each.label: graph.nodes.get(f"{SIGHTED}:{number}:{each.label}") for each in scene.percepts.objects}
    new = [each for each in scene.percepts.objects if far or not _seen_from(known[each.label], stamp_s)]
    if not far and not new:
        return []
    sighted = [node for each in new if (node := known[each.label]) is not None]
    return [task_of(scene, graph, "path", [agent, last, *sighted], new)]


def _grows(graph: Graph, spacing_m: float) -> bool:
    """Whether the agent has gone `spacing_m` from the path's last place, by path integration alone.

    Where it takes itself to be may jump, or hardly move while it is lost.
    """
    last = _last(graph)
    if last is None or last.samples is None:
        return True
    facts = graph.nodes[SELF].attributes
    before_m = last.samples.numpy()[-1, ODOMETRY].tolist()
    return math.dist([float(facts.get(key, 0.0)) for key in ODOMETRY_FACTS], before_m) >= spacing_m


def _seen_from(sighted: Node | None, stamp_s: float) -> bool:
    """Whether the last of a landmark's sightings is from the place of the path at `stamp_s`."""
    return sighted is not None and sighted.samples is not None and float(sighted.samples.numpy()[-1, 0]) >= stamp_s


def shift_tasks(scene: Scene, graph: Graph) -> list[Task]:
    """One where a correction waits to be carried out: it gets the whole map."""
    if CORRECTION not in graph.nodes:
        return []
    agent, correction = graph.nodes[SELF], graph.nodes[CORRECTION]
    found = [node for kind in (PATH, SIGHTED, "object") for node in _of_kind(graph, kind)]
    task = task_of(scene, graph, "map_shift", [agent, correction, *found], [])
    task.tiles = [tile for tile in _tiles(graph) if tile.road.numpy().any()]
    return [task]


def revisit_tasks(scene: Scene, graph: Graph, config: Config) -> list[Task]:
    """One where the path grows and a landmark or a view comes again that was away for long, or is passed by since.

    It gets the landmarks, and the path where they came to be known; or the closures that this pass began with.
    """
    percepts, now_ns = scene.percepts, scene.percepts.stamp_ns
    known = [percept for percept in percepts.objects if percept.whole and object_id(percept.label) in graph.nodes]
    if not (known or percepts.matches) or not _grows(graph, config.path_spacing_m):
        return []
    long_ago_ns, soon_ns = (now_ns - seconds * 1e9 for seconds in (config.revisit_s, config.closure_spacing_s))
    newest = _newest_closures(graph)
    again, nodes, since_ns = [], [], []
    for percept in known:
        landmark, closure = graph.nodes[object_id(percept.label)], newest.get(percept.label)
        if closure is not None and _until_ns(closure) > long_ago_ns:
            if _until_ns(closure) <= soon_ns:
                again.append(percept)
                nodes.append(closure)
        elif int(landmark.attributes.get("stamp_ns", 2**62)) <= long_ago_ns:
            again.append(percept)
            nodes.append(landmark)
            since_ns.append(int(landmark.attributes["since_ns"]))
    ready = MET not in newest or _until_ns(newest[MET]) <= soon_ns
    matches = [match for match in percepts.matches if ready and match.view_ns <= long_ago_ns]
    if not again and not matches:
        return []
    task = task_of(scene, graph, "revisit", [*nodes, *_segments(graph, since_ns)], again)
    task.matches = matches
    return [task]


def _until_ns(closure: Node) -> int:
    return int(closure.attributes["to_ns"])


def correction_tasks(scene: Scene, graph: Graph, config: Config) -> list[Task]:
    """One where there are closures that nobody has judged, unless some were judged just now."""
    closures = _of_kind(graph, CLOSURE)
    newest_ns = max((_until_ns(node) for node in closures if "holds" in node.attributes), default=-(2**62))
    soon = scene.percepts.stamp_ns < newest_ns + config.closure_spacing_s * 1e9
    if CORRECTION in graph.nodes or soon or all("holds" in node.attributes for node in closures):
        return []
    return [task_of(scene, graph, "map_correction", [*_of_kind(graph, PATH), *_of_kind(graph, SIGHTED), *closures], [])]


def _newest_closures(graph: Graph) -> dict[str, Node]:
    """The newest closure by each landmark, and that by a place met again."""
    newest: dict[str, Node] = {}
    for node in sorted(_of_kind(graph, CLOSURE), key=_until_ns):
        newest[MET if float(node.attributes["sd_rad"]) else str(node.attributes["by"])] = node
    return newest


def _segments(graph: Graph, since_ns: list[int]) -> list[Node]:
    """The nodes of the path from which on things came to be known, and those after them."""
    path = sorted(_of_kind(graph, PATH), key=lambda node: int(node.attributes["number"]))
    begins_s = [float(node.samples.numpy()[0, 0]) for node in path if node.samples is not None]
    first = [max(0, bisect_right(begins_s, stamp_ns * 1e-9) - 1) for stamp_ns in since_ns]
    return [path[number] for number in sorted({*first, *(number + 1 for number in first)}) if number < len(path)]


def _last(graph: Graph) -> Node | None:
    """The last node of the path, whose nodes are numbered from 0: found without a look at the rest of the map."""
    number = 0
    while f"{PATH}:{number}" in graph.nodes:
        number += 1
    return graph.nodes.get(f"{PATH}:{number - 1}")


def _of_kind(graph: Graph, kind: str) -> list[Node]:
    return sorted((node for node in graph.nodes.values() if node.kind == kind), key=lambda node: node.id)


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
