from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from cogmap.bus.codec import encode
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, ConfiguredCodelet
from cogmap.runtime.module import Module
from schemas.array import Array, Matrix
from schemas.base import Message
from schemas.codelets import Assignment, Leases, Proposal, Task
from schemas.graph import Cells, Delta, Link, Phase
from schemas.nodes import (
    CORRECTION_ID,
    AnyNode,
    Correction,
    LoopClosure,
    Node,
    Object,
    PathSegment,
    PlaceColumn,
    Self,
)
from schemas.sensing import PlaceMatch
from services.codelets.attention.coalitions import coalition
from services.codelets.attention.novelty import NOVEL_SIGHTINGS
from services.codelets.config import Config
from services.codelets.mapping.road_place import ROAD_REACH_M
from services.codelets.module import build
from services.codelets.table import CODELETS
from tests.support.scenes import (
    agent,
    configured,
    graph_of,
    landmark,
    percept,
    run,
    task,
    thing,
)

CONFIG = Config(samples=60, kept_samples=30, landmark_samples=40)
VERSION = 5


def _self(x_m: float = 0.0, y_m: float = 0.0, heading_rad: float = 0.0, sd: float = 0.0) -> Self:
    samples = np.random.default_rng(2).normal((x_m, y_m, heading_rad), sd, (50, 3))
    return agent(samples, x_m=x_m, y_m=y_m, heading_rad=heading_rad, stamp_ns=0)


def _object(label: str = "house", sightings: int = 1) -> Object:
    samples = np.random.default_rng(3).normal((10.0, 0.0), 0.5, (40, 2))
    return landmark(label, samples, sightings=sightings)


def _path() -> PathSegment:
    rows = np.zeros((20, 9))
    rows[:, 0] = rows[:, 1] = rows[:, 4] = np.arange(20)
    return PathSegment(id="path:0", number=0, rows=Matrix.of(rows))


def _closure() -> LoopClosure:
    return LoopClosure(
        id="closure:1:view-0",
        from_ns=0,
        to_ns=15 * 10**9,
        cue="view-0",
        ahead_m=0.0,
        left_m=0.0,
        range_m=0.0,
        bearing_rad=0.0,
        sd_m=2.0,
        sd_rad=0.2,
    )


def _correction() -> Correction:
    rows = np.zeros((20, 7))
    rows[:, 0] = rows[:, 1] = rows[:, 4] = np.arange(20)
    rows[:, 5] = np.arange(20) * 0.1
    return Correction(id=CORRECTION_ID, rows=Matrix.of(rows))


def _graph() -> Graph:
    """What every codelet finds something to do with."""
    return graph_of(_self(sd=0.1), _object(), _path(), _closure(), _correction())


def _every_task() -> list[Task]:
    motions = Array.of(np.array([[2.0, 0.0, 1.0, 0.2, 0.05]]))
    road_m = Array.of(np.array([[2.0, 0.0], [3.0, 1.0]], np.float32))
    house = [percept("house", 0.0, 8.0)]
    return [
        task("apply_correction"),
        task("localization", motions=motions, percepts=house),
        task("object_place", percepts=[percept("tower")]),
        task("landmark", percepts=house),
        task("road_place", road_m=road_m),
        task("path", percepts=house),
        task("loop_detection", matches=[PlaceMatch(frame=0, view_ns=0, score=0.9)]),
        task("map_correction"),
        task("whereabouts", percepts=house),
        task("novelty", percepts=house),
    ]


def _worker(instance: str = "w") -> Module:
    worker = build(instance, configured(CONFIG))
    assert worker.graph is not None
    worker.graph.load(_graph().snapshot())
    return worker


def _leases(asked: Task, worker: str = "w") -> Leases:
    lease = Assignment(task_id=asked.task_id, worker=worker, attempt=0, version=asked.version)
    return Leases(assignments=[lease])


def _answers(worker: Module, asked: Task) -> list[Message]:
    return worker.feed(asked) + worker.feed(_leases(asked, worker.instance))


def _proposal(published: list[Message]) -> Proposal:
    (proposal,) = published
    assert isinstance(proposal, Proposal)
    return proposal


def _bytes(proposal: Proposal) -> bytes:
    return encode(msgspec.structs.replace(proposal, seq=0, source=""))


def test_every_codelet_is_tried_here() -> None:
    assert [asked.codelet for asked in _every_task()] == [codelet.name for codelet in CODELETS]


@pytest.mark.parametrize("asked", _every_task(), ids=lambda asked: asked.codelet)
def test_the_same_task_gives_the_same_bytes_at_any_time_on_any_worker(asked: Task) -> None:
    old = _worker()
    for other in _every_task():
        _answers(old, other)
    again = _proposal(_answers(old, asked))
    fresh = _proposal(_answers(_worker("another"), asked))

    assert _bytes(again) == _bytes(fresh)
    assert again.failure == ""


@pytest.mark.parametrize("asked", _every_task(), ids=lambda asked: asked.codelet)
def test_what_a_codelet_proposes_it_may_write(asked: Task) -> None:
    (codelet,) = [codelet for codelet in CODELETS if codelet.name == asked.codelet]

    for operation in run(asked, _graph(), CONFIG).operations:
        if isinstance(operation, AnyNode):
            assert type(operation) in codelet.writes
        elif isinstance(operation, Link):
            assert operation.kind in codelet.writes
        elif isinstance(operation, Cells):
            assert operation.column in codelet.writes


def test_a_proposal_names_its_task_and_the_version_that_was_read() -> None:
    worker = _worker()
    asked = task("road_place")
    proposal = _proposal(_answers(worker, asked))

    assert (proposal.task_id, proposal.source, proposal.base_version) == (asked.task_id, "w", 1)


def test_a_task_that_another_worker_holds_is_not_done() -> None:
    asked = task("road_place")
    worker = _worker()

    assert worker.feed(asked) + worker.feed(_leases(asked, "another")) == []


def test_a_task_and_its_lease_may_come_in_any_order() -> None:
    asked = task("road_place")
    worker = _worker()

    assert worker.feed(_leases(asked)) == []
    assert _proposal(worker.feed(asked)).task_id == asked.task_id


def _delta(version: int) -> Delta:
    operations = [thing(f"thing:{version}")]
    return Delta(version=version, cycle=1, phase=Phase.OBJECTS, operations=operations)


def test_a_task_waits_until_the_graph_has_reached_its_version() -> None:
    worker = _worker()
    asked = task("road_place", version=3)

    assert _answers(worker, asked) == []
    assert worker.feed(_delta(2)) == []
    assert _proposal(worker.feed(_delta(3))).base_version == 3


def test_a_lease_of_another_version_of_the_task_waits_for_that_task() -> None:
    worker = _worker()
    asked = task("road_place")
    later = msgspec.structs.replace(asked, version=2)

    assert worker.feed(asked) + worker.feed(_leases(later)) == []
    assert worker.feed(later) == []
    assert _proposal(worker.feed(_delta(2))).base_version == 2


def test_an_unknown_codelet_is_a_failure_that_names_the_known_ones() -> None:
    proposal = _proposal(_answers(_worker(), task("dreaming")))

    assert "no codelet dreaming: there are apply_correction, localization" in proposal.failure
    assert proposal.operations == []


def _raise(asked: Task, graph: Graph, config: Config) -> Answer:
    raise TypeError("a stranger's mistake")


def test_whatever_a_codelet_raises_is_a_failure_of_its_task() -> None:
    broken = Codelet(
        name="broken",
        phase=Phase.OBJECTS,
        due=lambda context, graph, config: [],
        run=_raise,
        reads=frozenset(),
        writes=frozenset(),
        config=Config,
        section="codelets",
    )
    worker = build("w", [ConfiguredCodelet(broken, CONFIG)])
    asked = task("broken", version=0)
    proposal = _proposal(_answers(worker, asked))

    assert proposal.failure == "broken: TypeError: a stranger's mistake"


@pytest.mark.parametrize(
    "codelet",
    ["apply_correction", "localization", "object_place", "landmark", "road_place", "path"],
)
def test_a_task_on_a_graph_that_lacks_what_it_reads_is_a_failure(codelet: str) -> None:
    worker = build("w", configured(CONFIG))
    asked = task(codelet, version=0, percepts=[percept("house")])
    proposal = _proposal(_answers(worker, asked))

    assert proposal.failure.startswith(f"{codelet}: ")
    assert proposal.operations == []


def test_a_new_object_gets_a_node_with_samples_where_it_is_seen() -> None:
    seen = percept("house", math.pi / 2, 10.0, range_sd_m=0.5, bearing_sd_rad=0.01, width_m=7.0)
    graph = graph_of(_self(3.0, 4.0, math.pi / 2))
    found, link = run(task("object_place", percepts=[seen]), graph, CONFIG).operations

    assert isinstance(found, Object)
    assert (found.id, found.label) == ("object:house", "house")
    assert (found.x_m, found.y_m) == pytest.approx((-7.0, 4.0), abs=0.3)
    assert found.x_sd_m == pytest.approx(0.5, rel=0.35)
    assert found.width_m == 7.0
    assert found.positions_m().shape == (CONFIG.landmark_samples, 2)
    assert link == Link(source="object:house", target="place:map:0:-7:4")


def test_an_unsure_heading_spreads_a_far_object_across_the_line_of_sight() -> None:
    samples = np.zeros((500, 3))
    samples[:, 2] = np.random.default_rng(1).normal(0.0, 0.1, 500)
    seen = percept("house", 0.0, 30.0, range_sd_m=0.2, bearing_sd_rad=0.001)
    asked = task("object_place", percepts=[seen])
    found = run(asked, graph_of(agent(samples)), Config(landmark_samples=2000)).operations[0]

    assert isinstance(found, Object)
    assert found.y_sd_m == pytest.approx(3.0, rel=0.1)
    assert found.x_sd_m < 0.5


def _road(node: Self, road_m: Array, cell_m: float = 1.0) -> dict[tuple[int, int], float]:
    graph = graph_of(node, cell_m=cell_m)
    _, road = run(task("road_place", road_m=road_m), graph, CONFIG).operations
    assert isinstance(road, Cells)
    assert road.column is PlaceColumn.ROAD
    cells = road.cells.numpy().tolist()
    values = road.values.numpy().tolist()
    return {(i, j): value for (i, j), value in zip(cells, values, strict=True)}


def test_road_is_marked_on_the_place_nodes_where_it_is_seen_from_the_pose() -> None:
    road_m = Array.of(np.array([[4.0, 0.0]] * 3 + [[4.0, 2.0]], np.float32))

    assert _road(_self(10.0, 20.0, math.pi / 2), road_m) == {
        (10, 24): 1.0,
        (8, 24): pytest.approx(1 / 3),
    }


def test_a_coarser_grid_gets_the_same_road_on_fewer_nodes() -> None:
    road_m = Array.of(np.array([[4.0, 0.0], [4.6, 0.4], [8.0, 0.0]], np.float32))

    assert sorted(_road(_self(), road_m, cell_m=4.0)) == [(1, 0), (2, 0)]


def test_road_seen_from_afar_is_not_believed() -> None:
    road_m = Array.of(np.array([[2.0, 0.0], [ROAD_REACH_M + 1, 0.0]], np.float32))

    assert list(_road(_self(), road_m)) == [(2, 0)]


def test_the_place_node_under_the_agent_is_active_even_without_road_in_view() -> None:
    (here,) = run(task("road_place"), graph_of(_self(-3.4, 2.6)), CONFIG).operations

    assert isinstance(here, Cells)
    assert here.column is PlaceColumn.ACTIVATION
    assert (here.cells.numpy().tolist(), here.values.numpy().tolist()) == ([[-3, 3]], [1.0])


def _content(*activations: float, salience: float = 0.0) -> list[AnyNode]:
    return [
        landmark(f"house {index}", activation=activation, salience=salience)
        for index, activation in enumerate(activations)
    ]


def _activation(content: list[AnyNode], base_level: float = 1.0) -> float:
    return coalition("test", content, graph_of(), base_level).activation


def test_a_coalitions_activation_is_lidas_formula() -> None:
    assert _activation(_content(0.4, 0.8)) == pytest.approx((0.4 + 0.8) / 4)
    assert _activation(_content(0.4, 0.8), 0.5) == pytest.approx(0.5 * (0.4 + 0.8) / 4)

    salient = _content(0.4, 0.8, salience=-0.6)
    assert _activation(salient) == pytest.approx((0.4 + 0.8 + 1.2) / 4)


def test_total_activation_is_base_level_plus_current_at_most_one() -> None:
    node = Node(id="a", kind="thing", activation=0.7, base_level=0.6)

    assert _activation([node]) == 0.5


def test_activation_exceeds_a_half_only_where_content_is_salient() -> None:
    assert _activation(_content(1.0, 1.0, 1.0)) == 0.5
    assert _activation(_content(1.0, 1.0, 1.0, salience=0.1)) > 0.5


def _found(codelet: str, *nodes: AnyNode) -> list[AnyNode]:
    """The nodes of what an attention codelet finds while all objects are in view."""
    seen = [percept(node.label) for node in nodes if isinstance(node, Object)]
    answer = run(task(codelet, percepts=seen), graph_of(*nodes), CONFIG)
    return [node for each in answer.coalitions for node in each.nodes]


def test_attention_brings_the_agents_whereabouts_and_what_is_new_to_it() -> None:
    nodes = (_self(), _object("old", NOVEL_SIGHTINGS + 1), _object("new", 1))

    assert [item.id for item in _found("whereabouts", *nodes)] == [
        "self",
        "object:new",
        "object:old",
    ]
    assert [item.id for item in _found("novelty", *nodes)] == ["self", "object:new"]


def test_without_anything_new_there_is_no_coalition_about_novelty() -> None:
    assert _found("novelty", _self(), _object("old", 99)) == []


def test_an_object_is_the_more_salient_the_less_it_has_been_seen() -> None:
    salience = []
    for sightings in (1, 3, 5):
        found = _found("novelty", _self(), _object("new", sightings))[1]
        assert isinstance(found, Object)
        salience.append(found.salience)

    assert salience == sorted(salience, reverse=True)
    assert salience[-1] > 0


def test_coalitions_leave_samples_behind_and_keep_links_and_maps() -> None:
    at = Link(source="self", target="place:map:0:0:0")
    graph = graph_of(_self(sd=0.1), _object(), at)
    (found,) = run(task("whereabouts", percepts=[percept("house")]), graph, CONFIG).coalitions
    own, house = found.nodes

    assert isinstance(own, Self)
    assert isinstance(house, Object)
    assert own.samples.shape == (1, 3)
    assert house.offsets_m is None
    assert (found.links, found.maps) == ([at], ["map:0"])
