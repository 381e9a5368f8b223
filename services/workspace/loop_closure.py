"""When the codelets of map correction are called, and with what: the path grows, a loop closes, the
map moves.
"""

from __future__ import annotations

import math

from cogmap.graph.graph import Graph, object_id
from schemas.array import Array
from schemas.cognition import Task
from schemas.graph import Node, PlaceTile
from services.workspace.config import Config
from services.workspace.context import SELF, Scene, task_of

PATH = "path"
SIGHTED = "sighted"
CLOSURE = "closure"
CORRECTION = "correction"
MET = ""
# Fewer views than that cannot agree: one alone may be of another place than it seems.
ENOUGH = 3
ODOMETRY = slice(4, 6)
ODOMETRY_FACTS = ("odometry_x_m", "odometry_y_m")


def path_tasks(scene: Scene, graph: Graph, spacing_m: float) -> list[Task]:
    """One where the path grows, or the agent sees what it had not seen from the path's last place."""
    agent = graph.nodes[SELF]
    last = _last(graph)
    far = _grows(graph, spacing_m)
    if last is None or last.samples is None:
        return [task_of(scene, graph, "path", [agent], scene.percepts.objects)]
    number = int(last.attributes["number"])
    stamp_s = float(last.samples.numpy()[-1, 0])
    known = {
        each.label: graph.nodes.get(f"{SIGHTED}:{number}:{each.label}")
        for each in scene.percepts.objects
    }
    new = [
        each for each in scene.percepts.objects if far or not _seen_from(known[each.label], stamp_s)
    ]
    if not far and not new:
        return []
    sighted = [node for each in new if (node := known[each.label]) is not None]
    return [task_of(scene, graph, "path", [agent, last, *sighted], new)]


def _grows(graph: Graph, spacing_m: float) -> bool:
    """Whether the agent has gone `spacing_m` from the path's last place, or has got lost there.

    That is by path integration alone: where it takes itself to be may jump, or hardly move while it
    is lost.
    """
    last = _last(graph)
    if last is None or last.samples is None:
        return True
    facts = graph.nodes[SELF].attributes
    if (
        facts.get("others", False)
        and float(last.samples.numpy()[-1, 0]) <= int(facts.get("fits_ns", 0)) * 1e-9
    ):
        return True
    before_m = last.samples.numpy()[-1, ODOMETRY].tolist()
    return math.dist([float(facts.get(key, 0.0)) for key in ODOMETRY_FACTS], before_m) >= spacing_m


def _seen_from(sighted: Node | None, stamp_s: float) -> bool:
    """Whether the last of a landmark's sightings is from the place of the path at `stamp_s`."""
    return (
        sighted is not None
        and sighted.samples is not None
        and float(sighted.samples.numpy()[-1, 0]) >= stamp_s
    )


def seen_lately(graph: Graph) -> list[Node]:
    """The end of the path, what was seen from there, and that: for an agent that is lost."""
    last = _last(graph)
    if last is None:
        return []
    number = int(last.attributes["number"])
    found = [last]
    for label in sorted(node.attributes["label"] for node in graph.of_kind("object")):
        sighted = graph.nodes.get(f"{SIGHTED}:{number}:{label}")
        found += [] if sighted is None else [sighted, graph.nodes[object_id(str(label))]]
    return found


def shift_tasks(scene: Scene, graph: Graph) -> list[Task]:
    """One where a correction waits to be carried out: it gets the whole map."""
    if CORRECTION not in graph.nodes:
        return []
    agent = graph.nodes[SELF]
    correction = graph.nodes[CORRECTION]
    found = [node for kind in (PATH, SIGHTED, "object") for node in graph.of_kind(kind)]
    task = task_of(scene, graph, "map_shift", [agent, correction, *found], [])
    task.tiles = [tile for tile in _tiles(graph) if tile.road.numpy().any()]
    return [task]


def revisit_tasks(scene: Scene, graph: Graph, config: Config) -> list[Task]:
    """One where a landmark comes again that was away for long, or the path grows along it since, or
    along a known way.

    It gets the landmarks, or the newest closures that they have made on this pass, and all
    sightings of them before.
    """
    percepts = scene.percepts
    now_ns = scene.percepts.stamp_ns
    known = [
        percept
        for percept in percepts.objects
        if percept.whole and object_id(percept.label) in graph.nodes
    ]
    if not (known or percepts.matches):
        return []
    grows = _grows(graph, config.path_spacing_m)
    long_ago_ns, soon_ns = (
        now_ns - seconds * 1e9 for seconds in (config.revisit_s, config.closure_spacing_s)
    )
    newest = _newest_closures(graph)
    again = []
    nodes = []
    for percept in known:
        landmark = graph.nodes[object_id(percept.label)]
        closure = newest.get(percept.label)
        if closure is not None and _until_ns(closure) > long_ago_ns:
            begun = closure if grows and _until_ns(closure) <= soon_ns else None
        else:
            begun = (
                landmark if int(landmark.attributes.get("stamp_ns", 2**62)) <= long_ago_ns else None
            )
        if begun is not None:
            again.append(percept)
            nodes += [begun, *_seen_along(graph, percept.label)]
    ready = grows and (MET not in newest or _until_ns(newest[MET]) <= soon_ns)
    matches = [match for match in percepts.matches if ready and match.view_ns <= long_ago_ns]
    if not again and not matches:
        return []
    path = {int(node.attributes["number"]) for node in nodes if node.kind == SIGHTED}
    nodes += [graph.nodes[f"{PATH}:{number}"] for number in sorted(path)]
    task = task_of(scene, graph, "revisit", nodes, again)
    task.matches = matches
    return [task]


def _until_ns(closure: Node) -> int:
    return int(closure.attributes["to_ns"])


def correction_tasks(scene: Scene, graph: Graph, config: Config) -> list[Task]:
    """One where there are closures not judged yet, and enough of late to agree; unless some were
    judged just now.
    """
    closures = graph.of_kind(CLOSURE)
    now_ns = scene.percepts.stamp_ns
    fresh = [node for node in closures if "holds" not in node.attributes]
    late = [node for node in closures if _until_ns(node) > now_ns - config.revisit_s * 1e9]
    if CORRECTION in graph.nodes or not fresh or len(late) < ENOUGH:
        return []
    judged_ns = max(
        (_until_ns(node) for node in closures if "holds" in node.attributes), default=-(2**62)
    )
    if now_ns < judged_ns + config.closure_spacing_s * 1e9:
        return []
    nodes = [*graph.of_kind(PATH), *graph.of_kind(SIGHTED), *closures]
    return [task_of(scene, graph, "map_correction", nodes, [])]


def _newest_closures(graph: Graph) -> dict[str, Node]:
    """The newest closure by each landmark, and that by a place met again."""
    newest: dict[str, Node] = {}
    for node in sorted(graph.of_kind(CLOSURE), key=_until_ns):
        newest[MET if float(node.attributes["sd_rad"]) else str(node.attributes["by"])] = node
    return newest


def _seen_along(graph: Graph, label: str) -> list[Node]:
    """All sightings of a landmark."""
    return [node for node in graph.of_kind(SIGHTED) if node.attributes["landmark"] == label]


def _last(graph: Graph) -> Node | None:
    """The last node of the path, whose nodes are numbered from 0: found without a look at the rest
    of the map.
    """
    number = 0
    while f"{PATH}:{number}" in graph.nodes:
        number += 1
    return graph.nodes.get(f"{PATH}:{number - 1}")


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
