from __future__ import annotations

import msgspec
import numpy as np
import pytest

from cogmap.bus.codec import encode
from cogmap.errors import MessageError
from schemas import topics
from schemas.array import Array
from schemas.base import Message
from schemas.codelets import Leases, Offer, Task
from schemas.cognition import Coalitions
from schemas.graph import Delta, Phase, SnapshotRequest
from schemas.nodes import LinkKind, Node, Self, object_id, percept_id
from tests.support.scenes import (
    Desk,
    agent,
    answer,
    landmark,
    motion,
    percept,
    percepts,
    stamp_ns,
    thing,
)


def _moved_self(frame: int, x_m: float = 1.0) -> Self:
    return agent(x_m=x_m, stamp_ns=stamp_ns(frame))


def _phases(desk: Desk) -> list[str]:
    return [delta.phase for delta in desk.deltas]


def test_percepts_wait_for_the_self_motion_up_to_them() -> None:
    desk = Desk("w1")

    assert desk.feed(percepts(1)) == []
    assert desk.feed(motion(0)) == []
    assert [type(said) for said in desk.feed(motion(1))] == [Delta, Task, Leases]


def test_self_motion_alone_begins_no_cycle() -> None:
    desk = Desk("w1")

    assert [desk.feed(motion(frame)) for frame in range(3)] == [[], [], []]


def test_a_cycle_commits_percepts_then_the_pose_then_objects_and_an_end() -> None:
    desk = Desk("w1")
    desk.drive(range(2), percept("house"))

    assert _phases(desk) == ["percepts", "localization", "objects", "end"] * 2
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
    assert [asked.codelet for asked in desk.take()] == ["whereabouts"]


def test_a_percept_below_the_threshold_is_no_object_of_the_map() -> None:
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


def test_answers_are_committed_in_the_order_of_their_tasks_not_of_arrival() -> None:
    said = []
    for order in ((0, 1, 2, 3), (2, 0, 3, 1)):
        desk = Desk("w1")
        desk.see(0, percept("a"), percept("b"))
        desk.feed(answer(desk.take()[0]))
        tasks = desk.take()
        for index in order:
            asked = tasks[index]
            written = [landmark(asked.task_id)] if asked.codelet == "object_place" else []
            desk.feed(answer(asked, written))
        said.append([encode(delta) for delta in desk.deltas])

        assert desk.deltas[-1].tasks == [asked.task_id for asked in tasks]

    assert said[0] == said[1]


def test_a_task_that_is_answered_twice_is_committed_once() -> None:
    desk = Desk("w1", "w2")
    desk.see(0)
    (asked,) = desk.take()

    assert desk.feed(answer(asked, [_moved_self(0)]))
    assert desk.feed(answer(asked, [_moved_self(0, 5.0)])) == []
    assert sum(asked.task_id in delta.tasks for delta in desk.deltas) == 1
    assert desk.agent.x_m == 1.0


def test_an_answer_to_what_was_never_asked_changes_nothing() -> None:
    desk = Desk("w1")
    desk.see(0)
    (asked,) = desk.take()
    other = msgspec.structs.replace(asked, task_id="9/localization")

    assert desk.feed(answer(other, [_moved_self(0)])) == []


def test_the_newest_view_is_next_and_its_motion_covers_those_skipped() -> None:
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
    assert desk.agent.x_m == pytest.approx(4 * 0.4, abs=0.1)


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
        "2/object_place/b",
        "2/landmark/a",
        "2/road_place",
        "2/path",
    ]


def test_a_percept_becomes_a_node_linked_to_the_object_it_is_of() -> None:
    desk = Desk("w1")
    desk.drive(range(1), percept("a"))
    assert desk.graph.links.target(percept_id("a"), LinkKind.INSTANCE) is None

    desk.drive(range(1, 2), percept("a"))
    assert desk.graph.links.target(percept_id("a"), LinkKind.INSTANCE) == object_id("a")
    assert desk.graph.links.sources(object_id("a"), LinkKind.INSTANCE) == (percept_id("a"),)


def test_a_task_names_what_it_is_about_and_the_version_to_read() -> None:
    desk = Desk("w1", cell_m=2.0)
    desk.drive(range(1), percept("a"))
    desk.see(1, percept("a"))
    (asked,) = desk.take()

    assert asked.about == ["self", "object:a"]
    assert (desk.graph.cell_m(), asked.version) == (2.0, desk.deltas[-1].version)
    assert asked.motions is not None
    assert asked.motions.shape == (1, 5)


@pytest.mark.parametrize("shape", [(3,), (2, 4), (0, 3)])
def test_self_motion_of_a_wrong_shape_is_refused_and_changes_nothing(
    shape: tuple[int, ...],
) -> None:
    desk = Desk("w1")
    desk.feed(percepts(0))
    bad = msgspec.structs.replace(motion(0), motions=Array.of(np.zeros(shape)))

    with pytest.raises(MessageError, match="self-motion of shape"):
        desk.feed(bad)
    assert desk.feed(motion(0))


def test_road_points_of_a_wrong_shape_are_refused() -> None:
    desk = Desk("w1")
    road_m = Array.of(np.zeros((2, 3), np.float32))
    bad = msgspec.structs.replace(percepts(0), road_m=road_m)

    with pytest.raises(MessageError, match="road points of shape"):
        desk.feed(bad)


def _restored(past: list[Message]) -> Desk:
    desk = Desk("w1")
    assert desk.module.restore is not None
    desk.module.restore(past)
    return desk


def test_a_restored_workspace_has_the_same_graph_and_continues_its_numbers() -> None:
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


def test_coalitions_are_published_once_after_the_phase_with_an_id_each() -> None:
    desk = Desk("w1")
    desk.drive(range(2), percept("a"))
    published = [item for item in desk.published if isinstance(item, Coalitions)]

    assert [item.cycle for item in published] == [1, 2]
    assert [coalition.id for coalition in published[1].coalitions] == [
        "2/whereabouts/0",
        "2/novelty/0",
    ]

    whereabouts = published[1].coalitions[0]
    assert [node.id for node in whereabouts.nodes] == ["self", "object:a"]
    assert {link.source for link in whereabouts.links} == {"self", "object:a"}
    assert whereabouts.maps == ["map:0"]


def test_offers_are_committed_at_the_next_cycle_by_source_and_number() -> None:
    desk = Desk("w1")
    for source, seq, name in (("b", 0, "x"), ("a", 1, "y"), ("a", 0, "z")):
        offer = Offer(cycle=0, operations=[thing(name)], source=source, seq=seq)
        assert desk.feed(offer) == []
    desk.see(0)
    first = desk.deltas[0]

    assert first.phase is Phase.PERCEPTS
    assert [item.id for item in first.operations if isinstance(item, Node)] == ["z", "y", "x"]


def test_an_offer_of_what_only_codelets_write_is_rejected_and_counted() -> None:
    desk = Desk("w1")
    desk.feed(Offer(cycle=0, operations=[_moved_self(0)], source="goal"))
    desk.drive(range(1))

    assert [delta.rejected for delta in desk.deltas if delta.rejected] == [1]
    assert "may not write nodes of kind self" in "".join(
        reason for delta in desk.deltas for reason in delta.reasons
    )


def test_in_lockstep_a_cycle_waits_for_the_offers_that_are_declared() -> None:
    desk = Desk("w1", offering=("memory",))
    desk.drive(range(1))
    ended = desk.deltas[-1].cycle
    desk.see(1)

    assert desk.deltas[-1].cycle == ended

    desk.feed(Offer(cycle=ended, operations=[thing("recalled")], source="memory"))
    assert desk.deltas[-1].cycle == ended + 1
    assert "recalled" in desk.graph.nodes


@pytest.mark.parametrize("committed", range(1, 4))
def test_an_interrupted_cycle_goes_on_from_its_last_commit(committed: int) -> None:
    whole = Desk("w1")
    whole.drive(range(3), percept("a"))
    interrupted = Desk("w1")
    interrupted.drive(range(2), percept("a"))
    past = whole.deltas[: len(interrupted.deltas) + committed]

    again = _restored([*past])
    again.drive(range(2, 3), percept("a"))

    assert again.digest == whole.digest
    assert [delta.version for delta in again.deltas] == [
        delta.version for delta in whole.deltas[len(past) :]
    ]


def test_an_offer_made_before_a_restart_is_not_committed_again() -> None:
    desk = Desk("w1")
    desk.drive(range(3))
    again = _restored([*desk.deltas])
    again.feed(Offer(cycle=1, operations=[thing("old")], source="goal"))
    again.feed(Offer(cycle=3, operations=[thing("new")], source="goal"))
    again.drive(range(3, 4))
    names = {
        item.id for delta in again.deltas for item in delta.operations if isinstance(item, Node)
    }

    assert names == {"new"}


def test_an_offered_node_is_as_active_as_it_states_when_it_enters() -> None:
    desk = Desk("w1")
    desk.drive(range(5))
    desk.feed(Offer(cycle=5, operations=[thing("goal")], source="goal"))
    desk.drive(range(5, 6))
    graph = desk.graph

    assert graph.activation(graph.nodes["goal"]) == 1.0
