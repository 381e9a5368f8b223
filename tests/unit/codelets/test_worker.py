"""A worker does the tasks that it holds, each once the graph has the version it reads."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from cogmap.bus.codec import encode
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, ConfiguredCodelet
from cogmap.runtime.module import Module
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Assignment, Leases, Proposal, Task
from cogmap.schemas.graph import Cells, Delta, Link, Phase
from cogmap.schemas.nodes import (
    CORRECTION_ID,
    RECOLLECTION_ID,
    Correction,
    Goal,
    LoopClosure,
    Need,
    Node,
    Object,
    PathSegment,
    Recollection,
    Self,
    goal_id,
    need_id,
)
from cogmap.schemas.sensing import PlaceMatch
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.module import build
from cogmap.services.codelets.table import own_codelets
from cogmap.testing import agent, graph_of, landmark, of_type, percept, task
from tests.support.world.scenes import configured, run, thing

CONFIG = Config(samples=60, kept_samples=30, landmark_samples=40)


def _self() -> Self:
    samples = np.random.default_rng(2).normal(0.0, 0.1, (50, 3))
    return agent(samples, x_m=0.0, y_m=0.0, heading_rad=0.0, stamp_ns=0)


def _house() -> Object:
    rng = np.random.default_rng(3)
    samples_m = rng.normal((10.0, 0.0), 0.5, (40, 2))
    return landmark("house", samples_m, sightings=1)


def _along_x(columns: int) -> np.ndarray:
    """(20, columns): stamp, pose and odometry of a place a metre and a second after another."""
    rows = np.zeros((20, columns))
    rows[:, 0] = np.arange(20)
    rows[:, 1] = np.arange(20)
    rows[:, 4] = np.arange(20)
    return rows


def _path() -> list[PathSegment]:
    rows = _along_x(11)
    return [
        PathSegment(id="path:0", number=0, rows=Matrix.of(rows[:15])),
        PathSegment(id="path:1", number=1, rows=Matrix.of(rows[15:])),
    ]


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
    rows = _along_x(7)
    rows[:, 5] = np.arange(20) * 0.1
    return Correction(id=CORRECTION_ID, rows=Matrix.of(rows))


def _recollection() -> Recollection:
    return Recollection(
        id=RECOLLECTION_ID,
        map="remembered:1",
        x_m=5.0,
        y_m=0.0,
        heading_rad=0.5,
        labels=["12a"],
        names=["house"],
        given_names=[""],
        functions=["home"],
        matched=["house"],
        objects=Matrix.of([[15.0, 0.0, 0.5, 0.5, 8.0, 6.0, 20.0]]),
    )


def _graph() -> Graph:
    """What every codelet finds something to do with."""
    goal = Goal(id=goal_id("house"), object="house")
    need = Need(id=need_id("energy"), label="energy", level=0.9, is_eased=True)
    twin = landmark("home", [(11.0, 0.0)], names={"house": 3.0}, width_m=8.0, sightings=3)
    known = (_self(), _house(), twin, *_path(), _closure(), _correction(), _recollection())
    return graph_of(*known, goal, need)


_KERB_M = Array.of(np.array([[4.0, 1.6], [4.6, 1.6]], np.float32))
_RAYS = Array.of(np.array([[0.1, 6.0], [0.0, 6.0]], np.float32))
_NEAR_RAYS = Array.of(np.array([[0.1, 2.0], [0.0, 2.0]], np.float32))


def _every_task() -> list[Task]:
    motions = Array.of(np.array([[2.0, 0.0, 1.0, 0.2, 0.05]]))
    road_m = Array.of(np.array([[2.0, 0.0], [3.0, 1.0]], np.float32))
    house = [percept("house", 0.0, 8.0)]
    return [
        task("apply_correction"),
        task("join_map"),
        task("sparse_path", about=["path:0"]),
        task("localization", motions=motions, percepts=house),
        task("object_place", percepts=[percept("tower")]),
        task("charging_place"),
        task("landmark", percepts=house),
        task("road_place", road_m=road_m),
        task("boundary", road_m=road_m, road_boundary_m=_KERB_M, scan=_RAYS),
        task("path", percepts=house),
        task("loop_detection", matches=[PlaceMatch(frame=0, view_ns=0, score=0.9)]),
        task("map_correction"),
        task("map_structure"),
        task("coarse_places"),
        task("sub_map_places"),
        task("route_plan"),
        task("whereabouts", percepts=house),
        task("novelty", percepts=house),
        task("expectation", percepts=house, scan=_RAYS),
        task("goal"),
        task("need"),
        task("danger", percepts=house, scan=_NEAR_RAYS),
        task("place_lost"),
        task("episode"),
        task("merging", about=["object:house", "object:home"]),
        task("parting", about=["object:house"]),
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


def _codelet(name: str) -> Codelet:
    (codelet,) = [codelet for codelet in own_codelets() if codelet.name == name]
    return codelet


def test_every_codelet_is_tried_here() -> None:
    tried = [asked.codelet for asked in _every_task()]
    known = [codelet.name for codelet in own_codelets()]

    assert tried == known


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
    operations = run(asked, _graph(), CONFIG).operations
    may_write = _codelet(asked.codelet).writes

    for node in of_type(Node, operations):
        assert type(node) in may_write
    for link in of_type(Link, operations):
        assert link.kind in may_write
    for cells in of_type(Cells, operations):
        assert cells.column in may_write


def test_a_proposal_names_its_task_and_the_version_that_was_read() -> None:
    worker = _worker()
    asked = task("road_place")
    proposal = _proposal(_answers(worker, asked))

    assert proposal.task_id == asked.task_id
    assert proposal.source == "w"
    assert proposal.base_version == 1


def test_a_task_that_another_worker_holds_is_not_done() -> None:
    asked = task("road_place")
    worker = _worker()

    assert worker.feed(asked) == []
    assert worker.feed(_leases(asked, "another")) == []


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

    assert worker.feed(asked) == []
    assert worker.feed(_leases(later)) == []
    assert worker.feed(later) == []
    assert _proposal(worker.feed(_delta(2))).base_version == 2


def test_an_unknown_codelet_is_a_failure_that_names_the_known_ones() -> None:
    worker = _worker()
    proposal = _proposal(_answers(worker, task("dreaming")))

    assert (
        "no codelet dreaming: there are apply_correction, join_map, sparse_path" in proposal.failure
    )
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
