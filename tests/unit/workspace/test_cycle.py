"""The phases of a cognitive cycle, from percepts to coalitions."""

from __future__ import annotations

from collections.abc import Iterable

import msgspec
import numpy as np
import pytest

from cogmap.bus.codec import encode
from cogmap.errors import MessageError
from cogmap.schemas import nodes, topics
from cogmap.schemas.array import Array
from cogmap.schemas.codelets import Leases, Task
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.graph import Delta, SnapshotRequest
from cogmap.schemas.nodes import LinkKind, Self, object_id, percept_id
from cogmap.testing import agent, landmark, percept, percepts, self_motion, stamp_ns
from tests.support.world.scenes import Desk, answer


def _moved_self(frame: int, x_m: float = 1.0) -> Self:
    return agent(x_m=x_m, stamp_ns=stamp_ns(frame))


def _names(tasks: Iterable[Task]) -> list[str]:
    return [asked.task_id for asked in tasks]


def _localized(desk: Desk) -> list[Task]:
    """The tasks that follow the answer to the localization of the cycle."""
    (localization,) = desk.take()
    desk.feed(answer(localization))
    return desk.take()


def test_percepts_wait_for_the_self_motion_up_to_them() -> None:
    desk = Desk("w1")
    assert desk.feed(percepts(1)) == []
    assert desk.feed(self_motion(0)) == []

    published = desk.feed(self_motion(1))
    assert [type(message) for message in published] == [Delta, Leases, Task]


def test_self_motion_alone_begins_no_cycle() -> None:
    desk = Desk("w1")

    for frame in range(3):
        assert desk.feed(self_motion(frame)) == []


def test_a_cycle_commits_percepts_the_pose_objects_what_attention_keeps_and_an_end() -> None:
    desk = Desk("w1")
    desk.drive(range(2), percept("house"))
    phases = [delta.phase for delta in desk.deltas]
    cycles = [delta.cycle for delta in desk.deltas]

    # In the second cycle novelty waits, and there is nothing to keep.
    assert phases == [
        *["percepts", "localization", "objects", "attention", "end"],
        *["percepts", "localization", "objects", "end"],
    ]
    assert cycles == [1] * 5 + [2] * 4


def test_a_phase_begins_when_every_task_of_the_one_before_is_answered() -> None:
    desk = Desk("w1")
    desk.see(0, percept("a"), percept("b"))
    first, *others = _localized(desk)
    assert _names([first, *others]) == [
        "1/object_place/a",
        "1/object_place/b",
        "1/road_place",
        "1/path",
    ]

    for asked in others:
        desk.feed(answer(asked))
    assert desk.take() == []

    desk.feed(answer(first))
    (whereabouts,) = desk.take()
    assert whereabouts.codelet == "whereabouts"


def test_deltas_are_numbered_without_a_gap() -> None:
    desk = Desk("w1", "w2")
    desk.drive(range(6), percept("a"), percept("b", 0.4))

    assert desk.deltas
    for number, delta in enumerate(desk.deltas):
        assert delta.seq == number
        assert delta.version == number + 1


def _committed(order: tuple[int, ...]) -> list[bytes]:
    """The deltas of a cycle whose tasks about objects are answered in that order."""
    desk = Desk("w1")
    desk.see(0, percept("a"), percept("b"))
    tasks = _localized(desk)
    for index in order:
        asked = tasks[index]
        written = [landmark(asked.task_id)] if asked.codelet == "object_place" else []
        desk.feed(answer(asked, written))

    assert desk.deltas[-1].tasks == _names(tasks)
    return [encode(delta) for delta in desk.deltas]


def test_answers_are_committed_in_the_order_of_their_tasks_not_of_arrival() -> None:
    in_order = _committed((0, 1, 2, 3))
    mixed = _committed((2, 0, 3, 1))

    assert mixed == in_order


def test_a_task_that_is_answered_twice_is_committed_once() -> None:
    desk = Desk("w1", "w2")
    desk.see(0)
    (asked,) = desk.take()
    first = answer(asked, [_moved_self(0)])
    second = answer(asked, [_moved_self(0, 5.0)])

    assert desk.feed(first)
    assert desk.feed(second) == []

    commits = [delta for delta in desk.deltas if asked.task_id in delta.tasks]
    assert len(commits) == 1
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
    for frame in (1, 2, 3):
        desk.see(frame)
    (asked,) = desk.tasks
    assert asked.cycle == 2

    desk.work()
    begun_ns = [delta.stamp_ns for delta in desk.deltas if delta.phase == "percepts"]
    assert begun_ns == [stamp_ns(0), stamp_ns(1), stamp_ns(3)]
    assert desk.agent.x_m == pytest.approx(4 * 0.4, abs=0.1)


def test_a_view_no_newer_than_the_last_cycles_is_ignored() -> None:
    desk = Desk("w1")
    desk.drive(range(3))

    assert desk.feed(percepts(1)) == []
    assert desk.feed(percepts(2)) == []


def test_a_known_object_is_located_and_an_unknown_one_is_placed() -> None:
    desk = Desk("w1")
    desk.drive(range(1), percept("a"))
    desk.see(1, percept("a"), percept("b"))

    assert _names(_localized(desk)) == [
        "2/object_place/b",
        "2/landmark",
        "2/road_place",
        "2/path",
    ]


def test_a_percept_becomes_a_node_linked_to_the_object_it_is_of() -> None:
    desk = Desk("w1")
    desk.drive(range(1), percept("a"))
    assert desk.graph.links.target(percept_id("a"), LinkKind.INSTANCE) is None

    desk.drive(range(1, 2), percept("a"))
    links = desk.graph.links
    assert links.target(percept_id("a"), LinkKind.INSTANCE) == object_id("a")
    assert links.sources(object_id("a"), LinkKind.INSTANCE) == (percept_id("a"),)


def test_a_percepts_node_is_as_salient_as_what_is_felt_about_it() -> None:
    desk = Desk("w1")
    desk.drive(range(1), percept("a", feelings={Feeling.DANGER: 0.5}), percept("b"))
    feared = desk.graph.get(nodes.Percept, percept_id("a"))
    plain = desk.graph.get(nodes.Percept, percept_id("b"))

    assert feared is not None
    assert plain is not None
    assert (feared.salience, plain.salience) == (-0.5, 0.0)


def test_a_task_names_what_it_is_about_and_the_version_to_read() -> None:
    desk = Desk("w1", cell_m=2.0)
    desk.drive(range(1), percept("a"))
    desk.see(1, percept("a"))
    (asked,) = desk.take()

    assert asked.about == ["self", "object:a"]
    assert asked.version == desk.deltas[-1].version
    assert asked.motions is not None
    assert asked.motions.shape == (1, 5)
    assert asked.since_ns == stamp_ns(0)
    assert desk.graph.cell_m() == 2.0


@pytest.mark.parametrize("shape", [(3,), (2, 4), (0, 3)])
def test_self_motion_of_a_wrong_shape_is_refused_and_changes_nothing(
    shape: tuple[int, ...],
) -> None:
    desk = Desk("w1")
    desk.feed(percepts(0))
    rows = Array.of(np.zeros(shape))
    bad = msgspec.structs.replace(self_motion(0), motions=rows)

    with pytest.raises(MessageError, match="self-motion of shape"):
        desk.feed(bad)
    assert desk.feed(self_motion(0))


def test_ground_points_of_a_wrong_shape_are_refused() -> None:
    desk = Desk("w1")
    points_m = Array.of(np.zeros((2, 3), np.float32))
    bad_road = msgspec.structs.replace(percepts(0), road_m=points_m)
    bad_boundary = msgspec.structs.replace(percepts(0), road_boundary_m=points_m)

    with pytest.raises(MessageError, match="road points of shape"):
        desk.feed(bad_road)
    with pytest.raises(MessageError, match="boundary points of shape"):
        desk.feed(bad_boundary)


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
