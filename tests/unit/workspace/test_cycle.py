from __future__ import annotations

import numpy as np
import pytest

from cogmap.bus.codec import encode
from cogmap.errors import MessageError
from schemas import topics
from schemas.array import Array
from schemas.base import Message
from schemas.cognition import Task
from schemas.graph import Delta, Node, SnapshotRequest
from tests.support.scenes import Desk, answer, motion, node, percept, percepts, stamp_ns

SELF_ATTRIBUTES = {"x_m": 0.0, "y_m": 0.0, "heading_rad": 0.0, "stamp_ns": stamp_ns(0)}
SELF_SAMPLES = np.zeros((10, 3))


def _moved_self(frame: int, x_m: float = 1.0) -> Node:
    attributes = SELF_ATTRIBUTES | {"x_m": x_m, "stamp_ns": stamp_ns(frame)}
    return node("self", SELF_SAMPLES, "self", **attributes)


def _phases(desk: Desk) -> list[str]:
    return [delta.phase for delta in desk.deltas]


def test_percepts_wait_for_the_self_motion_up_to_them() -> None:
    desk = Desk("w1")
    assert desk.feed(percepts(1)) == []
    assert desk.feed(motion(0)) == []
    assert [type(said) for said in desk.feed(motion(1))] == [Delta, Task]


def test_self_motion_alone_begins_no_cycle() -> None:
    desk = Desk("w1")
    assert [desk.feed(motion(frame)) for frame in range(3)] == [[], [], []]


def test_a_cycle_commits_percepts_then_where_the_agent_is_then_objects_and_ends_with_decay() -> (
    None
):
    desk = Desk("w1")
    desk.drive(range(2), percept("house"))
    assert _phases(desk) == ["percepts", "localization", "objects", "decay"] * 2
    assert [delta.cycle for delta in desk.deltas] == [1] * 4 + [2] * 4


def test_a_phase_begins_when_every_task_of_the_one_before_is_answered() -> None:
    desk = Desk("w1")
    desk.see(0, percept("a"), percept("b"))
    (localization,) = desk.take()
    desk.feed(answer(localization))
    first, second, road, path = desk.take()
    assert [asked.task_id for asked in (first, second, road, path)] == [
        "1/object_place/a",
        "1/object_place/b",
        "1/road_place",
        "1/path",
    ]
    desk.feed(answer(second))
    desk.feed(answer(road))
    desk.feed(answer(path))
    assert desk.take() == []
    desk.feed(answer(first))
    assert [asked.codelet for asked in desk.take()] == ["attention"]


def test_what_is_recognised_with_too_little_activation_is_no_object_of_the_map() -> None:
    desk = Desk("w1")
    desk.see(0, percept("a"), percept("b", activation=0.7))
    (localization,) = desk.take()
    desk.feed(answer(localization))

    assert [seen.label for seen in localization.percepts] == ["a"]
    assert [asked.task_id for asked in desk.take()] == [
        "1/object_place/a",
        "1/road_place",
        "1/path",
    ]


def test_deltas_are_numbered_without_a_gap() -> None:
    desk = Desk("w1", "w2")
    desk.drive(range(6), percept("a"), percept("b", 0.4))
    assert [delta.version for delta in desk.deltas] == list(range(1, len(desk.deltas) + 1))
    assert [delta.seq for delta in desk.deltas] == list(range(len(desk.deltas)))


def test_answers_are_committed_in_the_order_of_the_tasks_whatever_the_order_they_come_in() -> None:
    said = []
    for order in ((0, 1, 2, 3), (2, 0, 3, 1)):
        desk = Desk("w1")
        desk.see(0, percept("a"), percept("b"))
        desk.feed(answer(desk.take()[0]))
        tasks = desk.take()
        for index in order:
            asked = tasks[index]
            desk.feed(answer(asked, [node(f"object:{asked.task_id}")]))
        said.append([encode(delta) for delta in desk.deltas])
        assert desk.deltas[-1].tasks == [asked.task_id for asked in tasks]
    assert said[0] == said[1]


def test_a_task_that_is_answered_twice_is_committed_once() -> None:
    desk = Desk("w1", "w2")
    desk.see(0)
    (asked,) = desk.take()
    assert desk.feed(answer(asked, [_moved_self(0)]))
    assert desk.feed(answer(asked, [_moved_self(0, 5.0)], worker="w2")) == []
    assert sum(asked.task_id in delta.tasks for delta in desk.deltas) == 1
    assert desk.graph.nodes["self"].attributes["x_m"] == 1.0


def test_an_answer_to_what_was_never_asked_changes_nothing() -> None:
    desk = Desk("w1")
    desk.see(0)
    (asked,) = desk.take()
    asked.task_id = "9/localization"
    assert desk.feed(answer(asked, [_moved_self(0)])) == []


def test_of_the_views_that_come_during_a_cycle_the_newest_is_next_and_the_motion_covers_those_passed_over() -> (
    None
):
    desk = Desk("w1")
    desk.drive(range(1))
    desk.see(1)
    desk.see(2)
    desk.see(3)
    assert [asked.cycle for asked in desk.tasks] == [2]
    desk.work()
    assert [delta.stamp_ns for delta in desk.deltas if delta.phase == "percepts"] == [
        stamp_ns(n) for n in (0, 1, 3)
    ]
    x_m = desk.graph.nodes["self"].attributes["x_m"]
    assert x_m == pytest.approx(4 * 0.4, abs=0.1)


def test_a_view_no_newer_than_the_last_cycles_is_passed_over() -> None:
    desk = Desk("w1")
    desk.drive(range(3))
    assert desk.feed(percepts(1)) == []
    assert desk.feed(percepts(2)) == []


def test_a_known_object_is_located_and_an_unknown_one_is_placed() -> None:
    desk = Desk("w1")
    desk.drive(range(1), percept("a"))
    desk.see(1, percept("a"), percept("b"))
    desk.feed(answer(desk.take()[0]))
    assert [asked.task_id for asked in desk.take()] == [
        "2/landmark/a",
        "2/object_place/b",
        "2/road_place",
        "2/path",
    ]


def test_a_percept_becomes_a_node_linked_to_the_object_that_it_is_an_instance_of() -> None:
    desk = Desk("w1")
    desk.drive(range(1), percept("a"))
    assert "instance" not in desk.graph.links
    desk.drive(range(1, 2), percept("a"))
    assert desk.graph.links["instance"] == {"percept:a": {"object:a": 1.0}}


def test_tasks_carry_all_that_a_worker_needs() -> None:
    desk = Desk("w1", cell_m=2.0)
    desk.drive(range(1), percept("a"))
    desk.see(1, percept("a"))
    (asked,) = desk.take()
    assert [item.id for item in asked.nodes] == ["self", "object:a"]
    assert (asked.cell_m, asked.base_version) == (2.0, desk.deltas[-1].version)
    assert asked.motions.shape == (1, 5)


@pytest.mark.parametrize("shape", [(3,), (2, 4), (0, 3)])
def test_self_motion_of_a_wrong_shape_is_refused_and_changes_nothing(
    shape: tuple[int, ...],
) -> None:
    desk = Desk("w1")
    desk.feed(percepts(0))
    bad = motion(0)
    bad.motions = Array.of(np.zeros(shape))
    with pytest.raises(MessageError, match="self-motion of shape"):
        desk.feed(bad)
    assert desk.feed(motion(0))


def test_road_points_of_a_wrong_shape_are_refused() -> None:
    desk = Desk("w1")
    bad = percepts(0)
    bad.road_m = Array.of(np.zeros((2, 3), np.float32))
    with pytest.raises(MessageError, match="road points of shape"):
        desk.feed(bad)


def _restored(past: list[Message]) -> Desk:
    desk = Desk("w1")
    assert desk.module.restore is not None
    desk.module.restore(past)
    return desk


def test_a_workspace_restored_from_its_deltas_or_from_a_snapshot_has_the_same_graph_and_goes_on_numbering() -> (
    None
):
    desk = Desk("w1")
    desk.drive(range(4), percept("a"), percept("b", 0.5))
    assert desk.module.compact is not None
    snapshot = desk.module.compact()
    restored = [
        _restored([*desk.deltas]),
        _restored([snapshot]),
        _restored([snapshot, desk.deltas[-1]]),
    ]
    assert {each.digest for each in restored} == {desk.digest}
    for each in restored:
        each.drive(range(4, 5), percept("a"))
        assert each.deltas[0].version == desk.deltas[-1].version + 1
        assert each.deltas[0].cycle == desk.deltas[-1].cycle + 1
    assert len({each.digest for each in restored}) == 1


def test_a_restored_workspace_passes_over_views_that_it_had_before() -> None:
    desk = Desk("w1")
    desk.drive(range(3))
    again = _restored([*desk.deltas])
    again.see(2)
    assert again.deltas == []


def test_replicas_that_apply_the_deltas_equal_the_workspace() -> None:
    desk = Desk("w1", "w2")
    desk.drive(range(8), percept("a"), percept("b", -0.5, 15.0))
    assert desk.graph.digest() == desk.digest


def test_a_snapshot_of_a_version_that_is_not_committed_yet_is_refused() -> None:
    desk = Desk("w1")
    desk.drive(range(1))
    _, handler = desk.module.served[topics.SNAPSHOT_REQUEST]
    newest = desk.deltas[-1].version
    assert handler(SnapshotRequest(at_least=newest)).version == newest
    with pytest.raises(MessageError, match="not committed yet"):
        handler(SnapshotRequest(at_least=newest + 1))
