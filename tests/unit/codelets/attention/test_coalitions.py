"""What attention codelets bring to the competition, and how active it is."""

from __future__ import annotations

import pytest

from cogmap.schemas.array import Matrix
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.graph import Link
from cogmap.schemas.nodes import (
    ROOT_MAP,
    AnyNode,
    LinkKind,
    Node,
    Object,
    Plan,
    PlanState,
    Self,
    map_id,
)
from cogmap.services.codelets.attention.coalitions import coalition
from cogmap.services.codelets.attention.novelty import Config
from cogmap.testing import agent, graph_of, landmark, percept, task
from tests.support.world.scenes import run

CONFIG = Config()
NOVEL_SIGHTINGS = CONFIG.novel_sightings


def _content(*activations: float, salience: float = 0.0) -> list[AnyNode]:
    return [
        landmark(f"house {index}", activation=activation, salience=salience)
        for index, activation in enumerate(activations)
    ]


def _activation(content: list[AnyNode]) -> float:
    return coalition("test", content, graph_of()).activation


def test_a_coalitions_activation_is_lidas_formula() -> None:
    neutral = _content(0.4, 0.8)
    salient = _content(0.4, 0.8, salience=-0.6)

    assert _activation(neutral) == pytest.approx((0.4 + 0.8) / 4)
    assert _activation(salient) == pytest.approx((0.4 + 0.8 + 1.2) / 4)


def test_a_link_is_as_active_and_salient_as_the_node_that_it_begins_at() -> None:
    (node,) = _content(0.4, salience=0.6)
    at = Link(source=node.id, target="place:map:0:0:0")
    near = Link(source=node.id, target="b", kind="near", weight=0.5)
    placed = graph_of(node, at)
    linked = coalition("test", [node], placed, [near])

    assert coalition("test", [node], placed).activation == pytest.approx(1.0 / 2)
    assert linked.links == [at, near]
    assert linked.activation == pytest.approx((1.0 + 1.0 + 0.5) / 6)


def test_a_coalition_is_of_the_maps_and_the_sub_maps_that_its_objects_are_on() -> None:
    one, other = _content(0.4, 0.8)
    within = Link(source=one.id, target=map_id(2), kind=LinkKind.WITHIN)
    graph = graph_of(one, other, within)

    assert coalition("test", [one, other], graph).maps == [ROOT_MAP, map_id(2)]


def test_a_coalition_leaves_the_route_of_a_plan_behind() -> None:
    route = Matrix.of([[0.0, 0.0], [1.0, 0.0]])
    plan = Plan(id="plan", state=PlanState.READY, length_m=1.0, route=route)
    (brought,) = coalition("test", [plan], graph_of(plan)).nodes

    assert isinstance(brought, Plan)
    assert (brought.route, brought.length_m) == (None, 1.0)


def test_total_activation_is_base_level_plus_current_at_most_one() -> None:
    node = Node(id="a", kind="thing", activation=0.7, base_level=0.6)

    assert _activation([node]) == 0.5


def test_activation_exceeds_a_half_only_where_content_is_salient() -> None:
    neutral = _content(1.0, 1.0, 1.0)
    salient = _content(1.0, 1.0, 1.0, salience=0.1)

    assert _activation(neutral) == 0.5
    assert _activation(salient) > 0.5


def _found(codelet: str, *nodes: AnyNode) -> list[AnyNode]:
    """The nodes of what an attention codelet finds while all objects are in view."""
    seen = [percept(node.label) for node in nodes if isinstance(node, Object)]
    answer = run(task(codelet, percepts=seen), graph_of(*nodes), CONFIG)

    found: list[AnyNode] = []
    for brought in answer.coalitions:
        found += brought.nodes
    return found


def test_attention_brings_the_agents_whereabouts_and_what_is_new_to_it() -> None:
    old = landmark("old", sightings=NOVEL_SIGHTINGS + 1)
    new = landmark("new", sightings=1)
    whereabouts = [node.id for node in _found("whereabouts", agent(), old, new)]
    novelty = [node.id for node in _found("novelty", agent(), old, new)]

    assert whereabouts == ["self", "object:new", "object:old"]
    assert novelty == ["self", "object:new"]


def test_without_anything_new_there_is_no_coalition_about_novelty() -> None:
    old = landmark("old", sightings=99)

    assert _found("novelty", agent(), old) == []


def test_an_object_is_the_more_salient_the_less_it_has_been_seen() -> None:
    saliences = []
    for sightings in (1, 3, 5):
        _, found = _found("novelty", agent(), landmark("new", sightings=sightings))
        assert isinstance(found, Object)
        saliences.append(found.salience)

    assert saliences == sorted(saliences, reverse=True)
    assert saliences[0] > saliences[-1] > 0


def test_coalitions_leave_samples_behind_and_keep_links_and_maps() -> None:
    at = Link(source="self", target="place:map:0:0:0")
    graph = graph_of(agent(), landmark("house", sightings=1), at)
    asked = task("whereabouts", percepts=[percept("house")])

    (found,) = run(asked, graph, CONFIG).coalitions
    own, house = found.nodes

    assert isinstance(own, Self)
    assert isinstance(house, Object)
    assert own.samples.shape == (1, 3)
    assert house.offsets_m is None
    assert found.links == [at]
    assert found.maps == ["map:0"]


def test_a_coalition_has_how_its_objects_were_perceived_to_stand_to_the_agent() -> None:
    graph = graph_of(agent(), landmark("house"), landmark("41a"))
    seen = [
        percept("41a", bearing_rad=0.2, range_m=12.0, name="house"),
        percept("house", range_sd_m=99.0),
        percept("shop"),
    ]

    (brought,) = run(task("whereabouts", percepts=seen), graph, CONFIG).coalitions

    ((name, relation),) = brought.relations.items()
    assert name == "object:41a"
    assert (relation.look, relation.range_m, relation.bearing_rad) == ("house", 12.0, 0.2)


def test_relations_make_a_coalition_no_more_active() -> None:
    graph = graph_of(agent(), landmark("house"))
    nodes: list[AnyNode] = [agent(), landmark("house")]

    related = coalition("test", nodes, graph, percepts=[percept("house")])

    assert related.relations
    assert related.activation == coalition("test", nodes, graph).activation


def test_what_was_felt_about_a_percept_makes_its_object_salient() -> None:
    graph = graph_of(agent(), landmark("bridge"), landmark("tower"))
    calm = [percept("bridge"), percept("tower")]
    afraid = [percept("bridge", feelings={Feeling.DANGER: 0.5}), percept("tower")]

    (before,) = run(task("whereabouts", percepts=calm), graph, CONFIG).coalitions
    (after,) = run(task("whereabouts", percepts=afraid), graph, CONFIG).coalitions

    assert [node.salience for node in before.nodes] == [0.0, 0.0, 0.0]
    assert [node.salience for node in after.nodes] == [0.0, -0.5, 0.0]
    assert after.activation > before.activation
