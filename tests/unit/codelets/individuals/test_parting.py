"""One object that turns out to be two."""

from __future__ import annotations

import math

import numpy as np

from cogmap.graph.graph import Graph
from cogmap.schemas.array import Matrix
from cogmap.schemas.graph import Link
from cogmap.schemas.nodes import (
    LinkKind,
    LoopClosure,
    Object,
    Observations,
    PathColumn,
    PathSegment,
    nearest_place,
    object_id,
    observations_id,
    segment_id,
)
from cogmap.services.codelets.individuals.parting import CODELET, EVERY, OFFSET
from cogmap.services.codelets.mapping.path import links_of
from cogmap.testing import agent, context, graph_of, landmark, percept, percepts, run_codelet, task

HERE_M = (10.0, 10.0)
THERE_M = (26.0, 10.0)
STEPS = 24


def _town(there_from: int, there_m: tuple[float, float] = THERE_M, *others: Object) -> Graph:
    """A map along whose path, a metre a step eastwards, one object was seen at HERE_M, and from
    step `there_from` on elsewhere, with a loop closure from the first step to each.
    """
    path = np.zeros((STEPS, len(PathColumn)))
    path[:, PathColumn.STAMP_S] = np.arange(STEPS)
    path[:, PathColumn.LAST_S] = np.arange(STEPS)
    path[:, PathColumn.X_M] = np.arange(STEPS)
    segment = PathSegment(id=segment_id(0), number=0, rows=Matrix.of(path))

    rows = []
    for step in range(STEPS):
        x_m, y_m = HERE_M if step < there_from else there_m
        rows.append([step, x_m - step, y_m, 0.5, 0.3, math.atan2(y_m, x_m - step), 1.0])
    observed = Observations(
        id=observations_id(0, "1a"), number=0, landmark="1a", rows=Matrix.of(np.array(rows))
    )

    node = landmark(
        "1a", [HERE_M], names={"house": 8.0, "inn": 4.0}, width_m=8.0, sightings=4 * STEPS
    )
    at = nearest_place(*HERE_M, 1.0)
    placed = Link(source=node.id, target=at, kind=LinkKind.AT)
    closures = [_closure(number, step, rows) for number, step in enumerate((2, STEPS - 1))]
    return graph_of(
        agent(), segment, node, observed, *links_of(observed), placed, *closures, *others
    )


def _closure(number: int, step: int, rows: list[list[float]]) -> LoopClosure:
    _, ahead_m, left_m, *_ = rows[0]
    _, forwards_m, beside_m, *_ = rows[step]
    return LoopClosure(
        id=f"closure:{number}:1a",
        from_ns=0,
        to_ns=step * 1_000_000_000,
        cue="1a",
        ahead_m=ahead_m,
        left_m=left_m,
        range_m=math.hypot(forwards_m, beside_m),
        bearing_rad=math.atan2(beside_m, forwards_m),
        sd_m=1.0,
        sd_rad=0.0,
    )


def _after(graph: Graph) -> Graph:
    graph.change(run_codelet(CODELET, task("parting", about=[object_id("1a")]), graph).operations)
    return graph


def _objects(graph: Graph) -> list[Object]:
    return sorted(graph.of_kind(Object), key=lambda node: node.x_m)


def test_an_object_in_view_that_was_seen_often_is_looked_at_in_turn() -> None:
    graph = _town(12)
    seen = context(percepts(0, percept("1a")), cycle=EVERY + OFFSET)
    between = context(percepts(0, percept("1a")), cycle=EVERY + OFFSET + 1)

    (asked,) = CODELET.due(seen, graph, CODELET.config())
    assert asked.about == [object_id("1a")]
    assert CODELET.due(between, graph, CODELET.config()) == []


def test_two_buildings_that_were_taken_for_one_become_two_where_each_is_seen() -> None:
    graph = _after(_town(12))

    first, second = _objects(graph)
    assert (first.label, math.dist((first.x_m, first.y_m), HERE_M) < 0.5) == ("1a", True)
    assert math.dist((second.x_m, second.y_m), THERE_M) < 0.5
    assert first.names["house"] + second.names["house"] == 8.0
    assert graph.links.target(second.id, LinkKind.AT) == nearest_place(second.x_m, second.y_m, 1.0)


def test_observations_and_closures_go_to_the_one_that_they_are_of() -> None:
    graph = _after(_town(12))
    _, second = _objects(graph)

    rows = {each.landmark: len(each.rows.numpy()) for each in graph.of_kind(Observations)}
    assert rows == {"1a": 12, second.label: 12}

    # The closure from one to the other is gone.
    (left,) = graph.of_kind(LoopClosure)
    assert (left.cue, left.to_ns) == ("1a", 2_000_000_000)


def test_what_is_explained_by_one_place_or_by_one_mistake_stays_one() -> None:
    for graph in (_town(STEPS), _town(12, (12.0, 10.0)), _town(STEPS - 3)):
        assert [node.label for node in _objects(_after(graph))] == ["1a"]


def test_nothing_is_parted_off_to_where_another_object_stands() -> None:
    graph = _town(12, THERE_M, landmark("2a", [(27.0, 10.0)], width_m=8.0))

    assert [node.label for node in _objects(_after(graph))] == ["1a", "2a"]
