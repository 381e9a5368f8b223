"""Places of the path that are passed again are joined into those where they stood already."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.estimation.pose_graph import residuals
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose, transform_from
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.runtime.codelet import CycleContext
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.graph import Link
from cogmap.schemas.nodes import (
    CORRECTION_ID,
    Correction,
    LinkKind,
    LoopClosure,
    Observations,
    PathColumn,
    PathSegment,
    object_id,
    observations_id,
    segment_id,
)
from cogmap.schemas.sensing import Percepts
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.correction.sparse_path import CODELET
from cogmap.services.codelets.mapping.path import (
    JOINED,
    LAST,
    ODOMETRY,
    POSE,
    STAMP,
    joins_of,
    links_of,
    steps_of,
)
from cogmap.testing import graph_of, task
from tests.support.world.scenes import run

CONFIG = Config(sparse_after_s=50.0, revisit_s=20.0)
NO_POINTS = Array.of(np.zeros((0, 2), np.float32))
NO_MOTIONS = Array.of(np.zeros((0, 5)))
AGAIN_S = 100.0
LATER_S = 200.0


def _along(x_m: Floats, since_s: float, y_m: float = 0.0, heading_rad: float = 0.0) -> Floats:
    """The rows of a path along x, a second from place to place, of which odometry is right."""
    rows = np.zeros((len(x_m), len(PathColumn)))
    rows[:, STAMP] = since_s + np.arange(len(x_m))
    rows[:, POSE] = np.column_stack([x_m, np.full(len(x_m), y_m), np.full(len(x_m), heading_rad)])
    rows[:, ODOMETRY] = rows[:, POSE]
    rows[:, LAST] = rows[:, STAMP]
    return rows


TURNED_OFF = _along(np.arange(3.0), AGAIN_S + 10.0, y_m=30.0)


def _segment(number: int, rows: Floats, is_sparse: bool = False) -> PathSegment:
    return PathSegment(
        id=segment_id(number), number=number, rows=Matrix.of(rows), is_sparse=is_sparse
    )


def _graph(again: Floats, *others: Observations | LoopClosure | Correction) -> Graph:
    """A path 20 m along x, then `again`, then elsewhere."""
    first = _segment(0, _along(np.arange(20.0), 0.0), is_sparse=True)
    last = _segment(2, _along(np.arange(5.0), LATER_S, y_m=90.0))
    links: list[Link] = []
    for node in others:
        if isinstance(node, Observations):
            links += links_of(node)
    return graph_of(first, _segment(1, again), last, *others, *links)


def _joined(graph: Graph) -> Graph:
    """The graph after the second segment was made sparse."""
    asked = task("sparse_path", about=[segment_id(1)])
    graph.change(run(asked, graph, CONFIG).operations)
    return graph


def _rows(graph: Graph, number: int) -> Floats:
    segment = graph.get(PathSegment, segment_id(number))
    assert segment is not None
    return segment.rows.numpy()


def _seen(number: int, stamp_s: float, forwards_m: float) -> Observations:
    """The inn, straight ahead of a place of the path."""
    row = [stamp_s, forwards_m, 0.0, 0.3, 0.1, 0.0, 1.0]
    return Observations(
        id=observations_id(number, "inn"), number=number, landmark="inn", rows=Matrix.of([row])
    )


def _closure(from_s: float, to_s: float, accepted: bool | None = True) -> LoopClosure:
    return LoopClosure(
        id=f"closure:{to_s}",
        from_ns=round(from_s * 1e9),
        to_ns=round(to_s * 1e9),
        cue="inn",
        ahead_m=5.0,
        left_m=1.0,
        range_m=5.0,
        bearing_rad=0.0,
        sd_m=0.3,
        sd_rad=0.0,
        accepted=accepted,
    )


def _is_due(graph: Graph, at_s: float) -> bool:
    percepts = Percepts(stamp_ns=round(at_s * 1e9), frame=1, objects=[], road_m=NO_POINTS)
    return bool(CODELET.due(CycleContext(1, percepts, NO_MOTIONS), graph, CONFIG))


def test_a_path_is_sparse_once_it_is_old_but_for_its_last_segment() -> None:
    graph = _graph(_along(np.arange(10.0), AGAIN_S))

    assert not _is_due(graph, AGAIN_S + 58.0)
    assert _is_due(graph, AGAIN_S + 59.0)
    assert not _is_due(_joined(graph), LATER_S + 900.0)


def test_no_place_is_joined_while_a_correction_waits_to_be_applied() -> None:
    rows = np.zeros((1, 7))
    correction = Correction(id=CORRECTION_ID, rows=Matrix.of(rows))

    assert not _is_due(_graph(_along(np.arange(10.0), AGAIN_S), correction), LATER_S)


def test_a_street_that_is_driven_again_takes_no_more_places() -> None:
    graph = _joined(_graph(_along(np.arange(10.0) + 0.4, AGAIN_S, y_m=0.5)))

    assert graph.get(PathSegment, segment_id(1)) is None
    assert len(_rows(graph, 0)) == 20
    assert graph.last_segment == graph.get(PathSegment, segment_id(2))
    assert _rows(graph, 2)[0, JOINED] == 10


@pytest.mark.parametrize(
    "again",
    [
        _along(np.arange(10.0), AGAIN_S, y_m=3.0),
        _along(np.arange(10.0), AGAIN_S, heading_rad=1.0),
        _along(np.arange(10.0, 20.0), 20.0),
    ],
    ids=["beside", "turned", "at once"],
)
def test_a_place_beside_or_headed_otherwise_or_seen_just_now_stays(again: Floats) -> None:
    graph = _joined(_graph(again))

    assert len(_rows(graph, 1)) == 10


def test_the_agent_was_lately_where_a_place_was_joined() -> None:
    graph = _joined(_graph(_along(np.arange(3.0, 6.0), AGAIN_S)))
    last_s = _rows(graph, 0)[:, LAST]

    assert last_s[3:6].tolist() == [AGAIN_S, AGAIN_S + 1.0, AGAIN_S + 2.0]
    assert last_s[6] == 6.0


def test_a_step_over_joined_places_is_as_uncertain_as_it_was_long() -> None:
    graph = _joined(_graph(np.vstack([_along(np.arange(10.0), AGAIN_S), TURNED_OFF])))
    rows = rows_of(graph.path)
    steps = steps_of(rows, CONFIG)
    over = int(np.flatnonzero(rows[:, STAMP] == AGAIN_S + 10.0)[0]) - 1

    assert rows[over + 1, JOINED] == 10
    assert steps.variance_m2[over] > 10 * steps.variance_m2[over + 1]


def test_what_stays_is_joined_to_where_the_agent_turned_off() -> None:
    again = np.vstack(
        [
            _along(np.arange(10.0) + 0.3, AGAIN_S, y_m=0.5),
            _along(np.arange(10.0, 14.0), AGAIN_S + 10.0, y_m=4.0),
            _along(np.arange(14.0, 17.0), AGAIN_S + 14.0, y_m=-0.5),
        ]
    )
    graph = _joined(_graph(again))
    path = graph.path
    rows = rows_of(path)
    joins = joins_of(path, rows[:, STAMP])

    assert len(_rows(graph, 1)) == 4
    assert len(joins) == 3
    assert residuals(rows[:, POSE], joins) == pytest.approx(np.zeros((3, 3)), abs=1e-9)


def test_what_was_seen_from_a_joined_place_is_seen_from_the_older_one() -> None:
    again = _along(np.array([3.3]), AGAIN_S, y_m=0.5, heading_rad=0.1)
    graph = _joined(_graph(again, _seen(1, AGAIN_S, 10.0)))
    found = graph.get(Observations, observations_id(0, "inn"))
    assert found is not None

    (row,) = found.rows.numpy()
    there_m = transform_from(_rows(graph, 0)[3, POSE], row[1:3])
    assert row[0] == 3.0
    assert there_m == pytest.approx(transform_from(again[0, POSE], np.array([10.0, 0.0])))
    assert graph.get(Observations, observations_id(1, "inn")) is None
    assert graph.links.sources(segment_id(0), LinkKind.ALONG) == (found.id,)
    assert graph.links.sources(object_id("inn"), LinkKind.OBSERVES) == (found.id,)


def test_a_place_keeps_what_it_saw_of_a_landmark_first() -> None:
    before = _seen(0, 3.0, 11.0)
    again = _along(np.array([3.3]), AGAIN_S)
    graph = _joined(_graph(again, before, _seen(1, AGAIN_S, 10.0)))

    assert graph.get(Observations, before.id) == before


def test_a_closure_to_a_joined_place_is_forgotten_one_from_it_follows() -> None:
    again = _along(np.arange(10.0) + 0.3, AGAIN_S, y_m=0.5)
    to_it = _closure(2.0, AGAIN_S + 2.0)
    from_it = _closure(AGAIN_S + 4.0, LATER_S)
    graph = _joined(_graph(again, to_it, from_it))

    (found,) = graph.of_kind(LoopClosure)
    assert found.id == from_it.id
    assert found.from_ns == 4_000_000_000
    assert (found.ahead_m, found.left_m) == pytest.approx((5.3, 1.5))


def test_of_closures_to_places_that_stay_the_accepted_are_kept() -> None:
    turned = _along(np.arange(10.0), AGAIN_S, heading_rad=np.pi / 2)
    judged = [
        _closure(2.0, AGAIN_S + 2.0),
        _closure(3.0, AGAIN_S + 3.0, accepted=False),
        _closure(4.0, AGAIN_S + 4.0, accepted=None),
    ]
    graph = _joined(_graph(turned, *judged))

    assert list(graph.of_kind(LoopClosure)) == judged[:1]


def test_a_join_leads_on_by_what_was_measured() -> None:
    """Belief is wrong by half a metre where a street turns off; the join states the odometry."""
    street = _along(np.arange(5.0), AGAIN_S)
    off = _along(np.array([4.0, 4.0]), AGAIN_S + 5.0, y_m=3.0)
    off[:, ODOMETRY] += (0.0, 0.5, 0.0)
    graph = _joined(_graph(np.vstack([street, off])))
    rows = rows_of(graph.path)
    joins = joins_of(graph.path, rows[:, STAMP])

    led = compose(rows[joins.i[-1], POSE], joins.measurement[-1])
    assert led == pytest.approx([4.0, 3.5, 0.0])


def test_what_the_segment_before_ended_with_is_joined_to_what_the_agent_came_back_to() -> None:
    back = _along(np.arange(5.0), AGAIN_S)
    elsewhere = _along(np.arange(3.0), AGAIN_S - 3.0, y_m=3.0)
    first = _segment(0, _along(np.arange(20.0), 0.0), is_sparse=True)
    graph = graph_of(
        first,
        _segment(1, elsewhere, is_sparse=True),
        _segment(2, np.vstack([back, _along(np.arange(2.0), AGAIN_S + 5.0, y_m=-3.0)])),
        _segment(3, _along(np.arange(5.0), LATER_S, y_m=90.0)),
    )
    graph.change(run(task("sparse_path", about=[segment_id(2)]), graph, CONFIG).operations)
    joins = joins_of(graph.path, rows_of(graph.path)[:, STAMP])

    assert joins.i.tolist() == [22, 4]
    assert joins.j.tolist() == [0, 23]


def test_a_correction_leaves_each_place_in_its_segment() -> None:
    graph = _joined(_graph(np.vstack([_along(np.arange(10.0), AGAIN_S), TURNED_OFF])))
    rows = rows_of(graph.path)
    higher = rows[:, POSE] + (0.0, 1.0, 0.0)
    correction = np.column_stack([rows[:, STAMP], rows[:, POSE], higher])
    graph.change([Correction(id=CORRECTION_ID, rows=Matrix.of(correction))])
    before = {segment.number: len(segment.rows.numpy()) for segment in graph.path}
    graph.change(run(task("apply_correction"), graph, CONFIG).operations)

    assert {segment.number: len(segment.rows.numpy()) for segment in graph.path} == before
    assert rows_of(graph.path)[:, POSE] == pytest.approx(higher)
    assert all(segment.is_sparse for segment in graph.path[:-1])


def test_a_place_where_the_agent_was_lost_is_not_where_it_came_from() -> None:
    street = _along(np.arange(5.0), AGAIN_S)
    street[:, ODOMETRY] += (40.0, 0.0, 0.0)
    elsewhere = _along(np.arange(4.0, 8.0), AGAIN_S + 5.0, y_m=5.0)
    graph = _joined(_graph(np.vstack([street, elsewhere])))

    assert len(joins_of(graph.path, rows_of(graph.path)[:, STAMP])) == 0


def test_a_segment_of_which_nothing_stays_leaves_its_join_to_the_one_before() -> None:
    elsewhere = _along(np.arange(3.0), AGAIN_S - 3.0, y_m=3.0)
    graph = graph_of(
        _segment(0, _along(np.arange(20.0), 0.0), is_sparse=True),
        _segment(1, elsewhere, is_sparse=True),
        _segment(2, _along(np.arange(5.0), AGAIN_S)),
        _segment(3, _along(np.arange(5.0), LATER_S, y_m=90.0)),
    )
    graph.change(run(task("sparse_path", about=[segment_id(2)]), graph, CONFIG).operations)
    joins = joins_of(graph.path, rows_of(graph.path)[:, STAMP])

    assert [segment.number for segment in graph.path] == [0, 1, 3]
    assert (joins.i.tolist(), joins.j.tolist()) == ([22], [0])
