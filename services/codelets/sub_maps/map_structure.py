"""The map structure codelet: objects that belong together get a sub-map (paper §5.3).

It runs beside the cycle. An object that arrives changes the sub-maps around it alone, so a task
reads no more of the map than those.
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Indices
from cogmap.graph.graph import Graph
from cogmap.graph.window import WEIGHT_COLUMNS
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import DropNode, DropPlaces, Links, Operation, Phase
from cogmap.schemas.nodes import ROOT_MAP, LinkKind, Map, Object, map_id, object_id
from cogmap.services.codelets.nodes import nodes_of
from cogmap.services.codelets.sub_maps.areas import (
    MOVED_M,
    area_covered,
    is_outdated,
    sub_map_node,
)
from cogmap.services.codelets.sub_maps.config import SECTION, Config
from cogmap.services.codelets.sub_maps.cut_links import CutLinks
from cogmap.services.codelets.sub_maps.members import (
    maps_around,
    members_of,
    next_number,
    number_of,
    positions_of,
    sub_maps_of,
)
from cogmap.services.codelets.sub_maps.sub_maps import NEW, SubMaps

# Views of an object before it gets into a sub-map.
MIN_SIGHTINGS = 2
# The distance up to which an object that arrives may change a sub-map.
REACH_M = 50.0
# So many objects without a sub-map, and such a share of those with one, have all sorted anew.
ALL_ANEW_FROM = 50
ALL_ANEW_SHARE = 0.25


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """Return one task about the objects in view that are in no sub-map yet, and about one sub-map,
    another in each cycle, if its objects are no longer where it says; about no node if so many
    objects are in none that all are sorted anew.
    """
    maps = sub_maps_of(graph)
    known = sum(len(graph.links.sources(node.id, LinkKind.WITHIN)) for node in maps)
    new = graph.count(Object) - known
    if new > max(ALL_ANEW_FROM, ALL_ANEW_SHARE * known):
        return [context.task(CODELET.name)]

    names = sorted(object_id(percept.label) for percept in context.percepts.objects)
    about = []
    for node in nodes_of(graph, Object, names):
        is_sure = node.surveyed or node.sightings >= MIN_SIGHTINGS
        if is_sure and _is_new(node, graph):
            about.append(node.id)

    if maps:
        checked = maps[context.cycle % len(maps)]
        if is_outdated(checked, members_of([checked], graph)):
            about.append(checked.id)

    return [context.task(CODELET.name, about)] if about else []


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Update the sub-maps around what the task is about, and the links of their objects to them."""
    if task.about:
        new = [node for node in nodes_of(graph, Object, task.about) if _is_new(node, graph)]
        moved = nodes_of(graph, Map, task.about)
        maps = maps_around(sub_maps_of(graph), new, moved, REACH_M)
    else:
        new = [node for node in graph.of_kind(Object) if _is_new(node, graph)]
        moved = []
        maps = sub_maps_of(graph)

    # The objects of these, those that arrive last, with the numbers of their sub-maps.
    known = members_of(maps, graph)
    objects = [*(node for nodes in known.values() for node in nodes), *new]
    labels = [number for number, nodes in known.items() for _ in nodes]
    numbers_before = np.array(labels + [NEW] * len(new), np.int64)
    all_anew = bool(moved) or not task.about
    numbers = _sorted(objects, numbers_before, graph, config, all_anew=all_anew)

    # Sub-maps that are new, or cover another area than before and so have another frame.
    operations: list[Operation] = []
    positions_m = positions_of(objects)
    for number in np.unique(numbers).tolist():
        area = area_covered(positions_m[numbers == number])
        before = graph.get(Map, map_id(number))
        if before is None or area.differs_from(before, MOVED_M):
            operations.append(sub_map_node(number, area, graph))
            if before is not None:
                operations.append(DropPlaces(map=before.id))

    weights = {}
    for index in np.flatnonzero(numbers != numbers_before).tolist():
        weights[objects[index].id] = {map_id(int(numbers[index])): 1.0}
    if weights:
        operations.append(Links(kind=LinkKind.WITHIN, weights=weights))

    kept = set(numbers.tolist())
    operations += [DropNode(id=node.id) for node in maps if number_of(node) not in kept]
    return Answer(operations)


CODELET = Codelet(
    name="map_structure",
    phase=Phase.BACKGROUND,
    due=due,
    run=run,
    reads=frozenset({Object, Map, LinkKind.WITHIN, *WEIGHT_COLUMNS}),
    writes=frozenset({Map, LinkKind.WITHIN}),
    config=Config,
    section=SECTION,
)


def _is_new(node: Object, graph: Graph) -> bool:
    sub_map = graph.links.target(node.id, LinkKind.WITHIN)
    is_in_none = sub_map is None or graph.get(Map, sub_map) is None
    return node.map == ROOT_MAP and is_in_none


def _sorted(
    objects: list[Object], before: Indices, graph: Graph, config: Config, *, all_anew: bool
) -> Indices:
    """Find the number of the sub-map that each object is in now, (n,). It was in `before`, (n,);
    objects that are NEW come last.
    """
    if not objects:
        return np.zeros(0, np.int64)

    positions_m = positions_of(objects)
    names = sorted({node.function for node in objects if node.function})
    code_of = {name: code for code, name in enumerate(names)}
    codes = [code_of.get(node.function, NEW) for node in objects]
    functions = np.array(codes, np.int64)

    cell_m = graph.cell_m()
    clear_m = np.array([node.width_m / 2 + cell_m for node in objects])
    boundaries = CutLinks.around(graph, positions_m)

    first = len(positions_m) if all_anew else int((before != NEW).sum())
    sub_maps = SubMaps(
        positions_m[:first],
        functions[:first],
        boundaries,
        config,
        kinds=len(names),
        clear_m=clear_m[:first],
        labels=before[:first],
        next_label=next_number(graph),
    )
    if all_anew:
        sub_maps.settle()

    for index in range(first, len(positions_m)):
        sub_maps.add(positions_m[index], int(functions[index]), float(clear_m[index]))
    return sub_maps.labels
