"""When map correction is due: the longer the path, the less often."""

from __future__ import annotations

from typing import Literal

import msgspec
import numpy as np
import pytest

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import CycleContext
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.nodes import (
    LoopClosure,
    Object,
    PathColumn,
    PathSegment,
    object_id,
    segment_id,
)
from cogmap.schemas.sensing import Percepts
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.correction.due import GROWN_PLACES, MIN_ROWS
from cogmap.services.codelets.correction.map_correction import CODELET
from cogmap.services.codelets.mapping.observations import Viewpoint, extended
from cogmap.services.codelets.mapping.path import links_of
from cogmap.services.player.public import sighting
from cogmap.testing import graph_of

CONFIG = Config(closure_spacing_s=2.0, revisit_s=100.0)
A_SECOND_NS = 1_000_000_000
NO_POINTS = Array.of(np.zeros((0, 2), np.float32))
NO_MOTIONS = Array.of(np.zeros((0, 5)))


def _segment(number: int) -> PathSegment:
    rows = Matrix.of(np.zeros((1, len(PathColumn))))
    return PathSegment(id=segment_id(number), number=number, rows=rows)


def _closure(at_s: int, accepted: bool | None) -> LoopClosure:
    return LoopClosure(
        id=f"closure:{at_s}",
        from_ns=0,
        to_ns=at_s * A_SECOND_NS,
        cue="inn",
        ahead_m=1.0,
        left_m=0.0,
        range_m=1.0,
        bearing_rad=0.0,
        sd_m=1.0,
        sd_rad=0.0,
        accepted=accepted,
    )


def _graph(segments: int) -> Graph:
    """A path whose closures were judged at 10 s, and one that was not, at 11 s."""
    path = [_segment(number) for number in range(segments)]
    judged = [_closure(at_s, True) for at_s in (8, 9, 10)]
    return graph_of(*path, *judged, _closure(11, None))


def _is_due(graph: Graph, at_s: int, config: Config = CONFIG) -> bool:
    percepts = Percepts(stamp_ns=at_s * A_SECOND_NS, frame=at_s, objects=[], road_m=NO_POINTS)
    context = CycleContext(1, percepts, NO_MOTIONS)
    return bool(CODELET.due(context, graph, config))


def test_a_short_path_is_corrected_as_often_as_loops_close() -> None:
    assert not _is_due(_graph(8), at_s=11)
    assert _is_due(_graph(8), at_s=12)


def test_a_path_ten_times_as_long_is_corrected_a_tenth_as_often() -> None:
    assert not _is_due(_graph(80), at_s=29)
    assert _is_due(_graph(80), at_s=30)


def _with_fresh(*range_m: float, is_sparse: bool = True) -> Graph:
    """Closures that were not judged yet, from 11 s on, of what stood 1 m ahead."""
    graph = _graph(8)
    graph.change([msgspec.structs.replace(_segment(0), is_sparse=is_sparse)])
    for number, seen_m in enumerate(range_m):
        closure = _closure(11 + number, None)
        graph.change([msgspec.structs.replace(closure, range_m=seen_m)])
    return graph


@pytest.mark.parametrize(
    ("range_m", "is_due"),
    [
        ((1.5, 1.5, 1.5), False),
        ((4.0, 4.0, 4.0), True),
        ((4.0, 4.0, 1.0), False),
    ],
    ids=["explained", "unexplained", "too few"],
)
def test_closures_that_the_path_explains_wait(range_m: tuple[float, ...], is_due: bool) -> None:
    assert _is_due(_with_fresh(*range_m), 14, Config(revisit_s=100.0)) is is_due


@pytest.mark.parametrize(("explained", "is_due"), [(26, True), (37, False)])
def test_a_tenth_of_closures_that_the_path_does_not_explain_waits(
    explained: int, is_due: bool
) -> None:
    graph = _with_fresh(*[1.0] * explained, *[4.0] * 4)

    assert _is_due(graph, 53, Config(revisit_s=100.0)) is is_due


def test_the_first_closures_of_a_path_do_not_wait() -> None:
    path = [_segment(number) for number in range(8)]
    graph = graph_of(*path, *[_closure(at_s, None) for at_s in (11, 12, 13)])

    assert _is_due(graph, 14, Config(revisit_s=100.0))


def test_no_closure_waits_while_no_part_of_the_path_is_sparse() -> None:
    graph = _with_fresh(1.5, 1.5, 1.5, is_sparse=False)

    assert _is_due(graph, 14, Config(revisit_s=100.0))


def _grown(
    places: int,
    landmarks: Literal["buildings", "points"] = "points",
    *,
    bearing_sd_rad: float = 0.02,
    began_s: int = 0,
    name: str = "post",
) -> bool:
    """Whether a correction is due at the moment that a path without closures, along which a
    landmark is seen, has gained the last of so many places.
    """
    rows = np.zeros((places, len(PathColumn)))
    rows[:, PathColumn.STAMP_S] = began_s + np.arange(places)
    segment = PathSegment(id=segment_id(0), number=0, rows=Matrix.of(rows))
    viewpoint = Viewpoint(number=0, stamp_s=began_s, step=np.zeros(3), range_gain=0.0)
    percept = sighting("post", 0.0, 2.0, bearing_sd_rad=bearing_sd_rad, range_sd_m=0.1)
    post = Object(id=object_id("post"), label="post", names={name: 1.0}, x_m=2.0, y_m=0.0)
    observed = extended(None, viewpoint, percept)
    graph = graph_of(segment, post, observed, *links_of(observed))
    return _is_due(graph, began_s + places - 1, Config(landmarks=landmarks))


def test_a_path_among_points_is_corrected_as_it_grows() -> None:
    whole = 3 * GROWN_PLACES

    assert whole > MIN_ROWS
    assert _grown(whole)
    assert not _grown(whole - 1)


def test_a_path_among_buildings_is_corrected_by_closures_alone() -> None:
    assert not _grown(3 * GROWN_PLACES, "buildings")


def test_a_path_among_beacons_without_bearings_waits_for_closures() -> None:
    assert not _grown(3 * GROWN_PLACES, bearing_sd_rad=float(np.pi))


def test_a_map_from_before_the_path_stays_as_the_path_grows() -> None:
    assert not _grown(3 * GROWN_PLACES, began_s=100.0)


def test_a_path_among_points_without_names_waits_for_closures() -> None:
    assert not _grown(3 * GROWN_PLACES, name="")
