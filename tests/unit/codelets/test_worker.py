from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.bus.codec import encode
from schemas.array import Array
from schemas.base import Message
from schemas.cognition import Coalitions, Task
from schemas.graph import Cells, Link, Node, Proposal
from schemas.sensing import PlaceMatch
from services.codelets.attention import NOVEL_SIGHTINGS, attend, coalition_activation
from services.codelets.mapping.object_place import ROAD_REACH_M, place_object, place_road
from services.codelets.module import BUILDERS, Config, build
from tests.support.scenes import node, percept, task

CONFIG = Config(samples=60, kept_samples=30, landmark_samples=40)


def _self(x_m: float = 0.0, y_m: float = 0.0, heading_rad: float = 0.0, sd: float = 0.0) -> Node:
    samples = np.random.default_rng(2).normal((x_m, y_m, heading_rad), sd, (50, 3))
    return node("self", samples, "self", x_m=x_m, y_m=y_m, heading_rad=heading_rad, stamp_ns=0)


def _object(label: str = "house", sightings: int = 1) -> Node:
    samples = np.random.default_rng(3).normal((10.0, 0.0), 0.5, (40, 2))
    return node(f"object:{label}", samples, label=label, sightings=sightings)


def _path() -> Node:
    rows = np.zeros((20, 9))
    rows[:, 0] = rows[:, 1] = rows[:, 4] = np.arange(20)
    return node("path:0", rows, "path", number=0)


def _closure() -> Node:
    facts = {
        "ahead_m": 0.0,
        "left_m": 0.0,
        "range_m": 0.0,
        "bearing_rad": 0.0,
        "sd_m": 2.0,
        "sd_rad": 0.2,
    }
    return node(
        "closure:1:view-0", None, "closure", from_ns=0, to_ns=15 * 10**9, by="view-0", **facts
    )


def _correction() -> Node:
    rows = np.zeros((20, 7))
    rows[:, 0] = rows[:, 1] = rows[:, 4] = np.arange(20)
    rows[:, 5] = np.arange(20) * 0.1
    return node("correction", rows, "correction")


def _every_task() -> list[Task]:
    motions = Array.of(np.array([[2.0, 0.0, 1.0, 0.2, 0.05]]))
    road_m = Array.of(np.array([[2.0, 0.0], [3.0, 1.0]], np.float32))
    return [
        task(
            "localization",
            _self(),
            _object(),
            motions=motions,
            percepts=[percept("house", 0.0, 8.0)],
        ),
        task("landmark", _self(), _object(), percepts=[percept("house")]),
        task("object_place", _self(sd=0.1), percepts=[percept("house")]),
        task("road_place", _self(), road_m=road_m),
        task("path", _self(), _path()),
        task("revisit", _path(), matches=[PlaceMatch(frame=0, view_ns=0, score=0.9)]),
        task("map_shift", _self(), _path(), _object(), _correction()),
        task("map_correction", _path(), _closure()),
        task("attention", _self(), _object()),
    ]


def _said(asked: Task, instance: str = "w") -> list[Message]:
    return build(CONFIG, instance).feed(asked)


def _proposal(said: list[Message]) -> Proposal:
    assert isinstance(said[-1], Proposal)
    return said[-1]


def test_every_codelet_is_tried_here() -> None:
    assert [asked.codelet for asked in _every_task()] == [*BUILDERS, "map_correction", "attention"]


@pytest.mark.parametrize("asked", _every_task(), ids=lambda asked: asked.codelet)
def test_the_same_task_gives_the_same_bytes_at_any_time_on_any_worker(asked: Task) -> None:
    old = build(CONFIG, "w")
    for other in _every_task():
        old.feed(other)
    again = old.feed(asked)
    asked.worker = "another"
    fresh = _said(asked, "another")
    for message in (*again, *fresh):
        message.seq = 0
        message.source = ""
        if isinstance(message, Proposal):
            message.worker = ""
    assert [encode(message) for message in again] == [encode(message) for message in fresh]
    assert _proposal(again).failure == ""


@pytest.mark.parametrize("asked", _every_task(), ids=lambda asked: asked.codelet)
def test_an_answer_names_its_task_its_worker_and_the_version_that_it_is_based_on(
    asked: Task,
) -> None:
    asked.base_version = 17
    proposal = _proposal(_said(asked))
    assert (proposal.task_id, proposal.worker, proposal.base_version) == (asked.task_id, "w", 17)


def test_a_task_for_another_worker_is_ignored() -> None:
    assert [_said(asked, "v") for asked in _every_task()] == [[]] * len(_every_task())


def test_a_codelet_that_there_is_not_is_said_to_be_missing_with_those_there_are() -> None:
    proposal = _proposal(_said(task("dreaming", _self())))
    assert proposal.failure.startswith("no codelet dreaming: there are localization, landmark")
    assert proposal.operations == []


@pytest.mark.parametrize("codelet", [*BUILDERS])
def test_a_task_that_lacks_what_its_codelet_reads_is_answered_with_a_failure(codelet: str) -> None:
    proposal = _proposal(_said(task(codelet)))
    assert proposal.failure.startswith(f"{codelet}: ")
    assert proposal.operations == []


def test_an_attention_task_without_content_brings_coalitions_without_any() -> None:
    said = _said(task("attention"))
    assert [type(message) for message in said] == [Coalitions, Proposal]
    assert isinstance(said[0], Coalitions)
    assert said[0].coalitions == []


def test_what_is_recognised_for_the_first_time_gets_a_node_with_samples_where_it_is_seen() -> None:
    seen = percept("house", math.pi / 2, 10.0, range_sd_m=0.5, bearing_sd_rad=0.01, width_m=7.0)
    found, link = place_object(
        task("object_place", _self(3.0, 4.0, math.pi / 2), percepts=[seen]), CONFIG
    )
    assert isinstance(found, Node)
    assert (found.id, found.kind, found.attributes["label"]) == ("object:house", "object", "house")
    assert (found.attributes["x_m"], found.attributes["y_m"]) == pytest.approx((-7.0, 4.0), abs=0.3)
    assert found.attributes["x_sd_m"] == pytest.approx(0.5, rel=0.35)
    assert found.attributes["width_m"] == 7.0
    assert found.samples is not None
    assert found.samples.shape == (CONFIG.landmark_samples, 2)
    assert link == Link(source="object:house", target="place:-7:4")


def test_an_agent_unsure_of_its_heading_is_unsure_across_of_where_a_far_object_stands() -> None:
    samples = np.zeros((500, 3))
    samples[:, 2] = np.random.default_rng(1).normal(0.0, 0.1, 500)
    seen = percept("house", 0.0, 30.0, range_sd_m=0.2, bearing_sd_rad=0.001)
    asked = task("object_place", node("self", samples, "self"), percepts=[seen])
    found = place_object(asked, Config(landmark_samples=2000))[0]
    assert isinstance(found, Node)
    assert found.attributes["y_sd_m"] == pytest.approx(3.0, rel=0.1)
    assert float(found.attributes["x_sd_m"]) < 0.5


def _road(asked: Task) -> dict[tuple[int, int], float]:
    _, road = place_road(asked, CONFIG)
    assert isinstance(road, Cells)
    assert road.column == "road"
    cells = road.cells.numpy().tolist()
    values = road.values.numpy().tolist()
    return {(i, j): value for (i, j), value in zip(cells, values, strict=True)}


def test_road_is_marked_on_the_place_nodes_where_it_lies_as_seen_from_where_the_agent_is() -> None:
    road_m = Array.of(np.array([[4.0, 0.0]] * 3 + [[4.0, 2.0]], np.float32))
    assert _road(task("road_place", _self(10.0, 20.0, math.pi / 2), road_m=road_m)) == {
        (10, 24): 1.0,
        (8, 24): pytest.approx(1 / 3),
    }


def test_a_coarser_grid_gets_the_same_road_on_fewer_nodes() -> None:
    road_m = Array.of(np.array([[4.0, 0.0], [4.6, 0.4], [8.0, 0.0]], np.float32))
    assert sorted(_road(task("road_place", _self(), road_m=road_m, cell_m=4.0))) == [(1, 0), (2, 0)]


def test_road_seen_from_afar_is_not_believed() -> None:
    road_m = Array.of(np.array([[2.0, 0.0], [ROAD_REACH_M + 1, 0.0]], np.float32))
    assert list(_road(task("road_place", _self(), road_m=road_m))) == [(2, 0)]


def test_the_place_node_that_the_agent_stands_on_is_active_even_where_no_road_is_seen() -> None:
    (here,) = place_road(task("road_place", _self(-3.4, 2.6)), CONFIG)
    assert isinstance(here, Cells)
    assert (here.column, here.cells.numpy().tolist(), here.values.numpy().tolist()) == (
        "activation",
        [[-3, 3]],
        [1.0],
    )


def _content(*activations: float, salience: float = 0.0) -> list[Node]:
    return [
        Node(id=f"{index}", kind="object", activation=activation, attributes={"salience": salience})
        for index, activation in enumerate(activations)
    ]


def test_a_coalitions_activation_is_lidas_formula() -> None:
    assert coalition_activation(_content(0.4, 0.8), 1.0) == pytest.approx((0.4 + 0.8) / 4)
    assert coalition_activation(_content(0.4, 0.8), 0.5) == pytest.approx(0.5 * (0.4 + 0.8) / 4)
    assert coalition_activation(_content(0.4, 0.8, salience=-0.6), 1.0) == pytest.approx(
        (0.4 + 0.8 + 1.2) / 4
    )


def test_a_nodes_total_activation_is_base_level_and_current_together_at_most_one() -> None:
    content = [Node(id="a", kind="object", activation=0.7, base_level=0.6)]
    assert coalition_activation(content, 1.0) == 0.5


def test_neutral_content_tops_out_at_exactly_a_half_and_only_salience_goes_beyond() -> None:
    assert coalition_activation(_content(1.0, 1.0, 1.0), 1.0) == 0.5
    assert coalition_activation(_content(1.0, 1.0, 1.0, salience=0.1), 1.0) > 0.5


def _coalitions(*nodes: Node) -> dict[str, list[Node]]:
    found = attend(task("attention", *nodes), CONFIG).coalitions
    return {coalition.codelet: coalition.content for coalition in found}


def test_attention_brings_where_the_agent_is_among_what_it_sees_and_what_is_new_to_it() -> None:
    found = _coalitions(_self(), _object("old", NOVEL_SIGHTINGS + 1), _object("new", 1))
    assert [item.id for item in found["whereabouts"]] == ["self", "object:old", "object:new"]
    assert [item.id for item in found["novelty"]] == ["self", "object:new"]


def test_without_anything_new_there_is_no_coalition_about_novelty() -> None:
    assert list(_coalitions(_self(), _object("old", 99))) == ["whereabouts"]


def test_an_object_is_the_more_salient_the_less_it_has_been_seen() -> None:
    content = [_coalitions(_object("new", sightings))["novelty"][0] for sightings in (1, 3, 5)]
    salience = [float(item.attributes["salience"]) for item in content]
    assert salience == sorted(salience, reverse=True)
    assert salience[-1] > 0


def test_coalitions_leave_samples_behind() -> None:
    found = _coalitions(_self(), _object())
    assert all(item.samples is None for content in found.values() for item in content)
