"""Two objects that turn out to be one."""

from __future__ import annotations

import numpy as np

from cogmap.graph.graph import Graph
from cogmap.schemas.array import Matrix
from cogmap.schemas.graph import Link
from cogmap.schemas.nodes import (
    Goal,
    LinkKind,
    LoopClosure,
    Object,
    ObservationColumn,
    Observations,
    goal_id,
    nearest_place,
    object_id,
    observations_id,
)
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.individuals.merging import CODELET, EVERY
from cogmap.services.codelets.mapping.path import links_of
from cogmap.testing import agent, context, graph_of, landmark, percept, percepts, run_codelet, task


def _house(label: str, x_m: float, **facts: object) -> Object:
    usual = {"names": {"house": 9.0}, "width_m": 8.0, "sightings": 9}
    return landmark(label, [(x_m, 0.0)], **(usual | facts))


def _observed(label: str, *stamps_s: float) -> Observations:
    rows = np.zeros((len(stamps_s), len(ObservationColumn)))
    rows[:, 0] = stamps_s
    name = observations_id(0, label)
    return Observations(id=name, number=0, landmark=label, rows=Matrix.of(rows))


def _map(*nodes: Object) -> Graph:
    places = [
        Link(source=node.id, target=nearest_place(node.x_m, node.y_m, 1.0), kind=LinkKind.AT)
        for node in nodes
    ]
    return graph_of(agent(), *nodes, *places)


def _due(graph: Graph, *seen: Percept, cycle: int = EVERY) -> list[list[str]]:
    asked = CODELET.due(context(percepts(0, *seen), cycle=cycle), graph, CODELET.config())
    return [each.about for each in asked]


def _after(graph: Graph, *labels: str) -> Graph:
    asked = task("merging", about=[object_id(label) for label in labels])
    graph.change(run_codelet(CODELET, asked, graph).operations)
    return graph


def test_two_that_look_alike_in_one_place_are_one() -> None:
    graph = _map(_house("1a", 10.0), _house("9b", 12.0))

    assert _due(graph, percept("1a")) == [[object_id("1a"), object_id("9b")]]
    assert _due(graph, percept("1a"), cycle=EVERY + 1) == []
    assert _due(graph) == []


def test_two_that_stand_apart_or_look_different_or_are_seen_together_are_two() -> None:
    apart = _map(_house("1a", 10.0), _house("9b", 18.0))
    different = _map(_house("1a", 10.0), _house("9b", 12.0, names={"inn": 9.0}))
    together = _map(_house("1a", 10.0), _house("9b", 12.0))
    new = _map(_house("1a", 10.0), _house("9b", 12.0, sightings=1))

    assert _due(apart, percept("1a")) == []
    assert _due(different, percept("1a")) == []
    assert _due(together, percept("1a"), percept("9b")) == []
    assert _due(new, percept("1a")) == []


def test_what_was_learned_of_both_is_known_of_the_one_that_was_seen_more_often() -> None:
    other = _house("9b", 13.0, sightings=3, names={"house": 2.0, "": 1.0}, given_name="our home")
    graph = _after(graph_of(agent(), _house("1a", 10.0), other), "1a", "9b")
    kept = graph.get(Object, object_id("1a"))

    assert kept is not None and object_id("9b") not in graph.nodes
    assert (kept.x_m, kept.sightings, kept.given_name) == (10.75, 12, "our home")
    assert kept.names == {"house": 11.0, "": 1.0}


def test_observations_closures_and_goals_are_of_the_one_then() -> None:
    seen = [_observed("1a", 1.0, 2.0), _observed("9b", 2.0, 3.0)]
    closure = LoopClosure(
        id="closure:5:9b",
        from_ns=0,
        to_ns=1,
        cue="9b",
        ahead_m=0.0,
        left_m=0.0,
        range_m=1.0,
        bearing_rad=0.0,
        sd_m=1.0,
        sd_rad=0.0,
    )
    goal = Goal(id=goal_id("home"), object="9b")
    links = [link for each in seen for link in links_of(each)]
    graph = graph_of(
        agent(), _house("1a", 10.0), _house("9b", 12.0, sightings=3), *seen, closure, goal, *links
    )

    after = _after(graph, "1a", "9b")
    (known,) = after.of_kind(Observations)
    (moved,) = after.of_kind(LoopClosure)
    (asked,) = after.of_kind(Goal)

    assert known.rows.numpy()[:, 0].tolist() == [1.0, 2.0, 3.0]
    assert after.links.sources(object_id("1a"), LinkKind.OBSERVES) == (known.id,)
    assert (moved.cue, asked.object) == ("1a", "1a")
