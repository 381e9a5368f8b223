"""A loop that a landmark alone has closed, while the path had turned too far."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import integrate, relative, transform_to
from cogmap.graph.graph import Graph
from cogmap.schemas.array import Matrix
from cogmap.schemas.codelets import Task
from cogmap.schemas.nodes import (
    Correction,
    CorrectionColumn,
    LoopClosure,
    PathColumn,
    PathSegment,
)
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.correction import map_correction
from cogmap.services.codelets.mapping.path import ODOMETRY, POSE, STAMP

SIDE = 20
LAP = 4 * SIDE
STEP_M = 3.0
PLACES = 8
SEEN_FROM = range(2, 7)
LANDMARK_M = np.array([[18.0, 14.0]])
TOO_FAR_RAD = 4.4
CONFIG = Config(path_spacing_m=STEP_M / 2)


def _rows() -> tuple[Floats, Floats]:
    """True poses once round a square and on, and the path as felt, its corners turned too far."""
    steps = np.tile([STEP_M, 0.0, 0.0], (LAP + PLACES, 1))
    steps[SIDE - 1 :: SIDE, 2] = math.pi / 2
    truth = integrate(np.zeros(3), steps)
    steps[steps[:, 2] > 0, 2] += TOO_FAR_RAD / 4
    felt = integrate(np.zeros(3), steps)

    rows = np.zeros((len(felt), len(PathColumn)))
    rows[:, STAMP] = np.arange(len(felt))
    rows[:, POSE] = felt
    rows[:, ODOMETRY] = felt
    rows[1:, PathColumn.VARIANCE_M2] = np.cumsum(np.full(len(steps), 0.09))
    rows[1:, PathColumn.VARIANCE_RAD2] = np.cumsum(1e-4 + (0.3 * steps[:, 2]) ** 2)
    return truth, rows


def _closure(place: int, cue: str, there_m: Floats, here_m: Floats, sd_rad: float) -> LoopClosure:
    ahead_m, left_m = there_m.tolist()
    x_m, y_m = here_m.tolist()
    return LoopClosure(
        id=f"closure:{place}:{cue}",
        activation=0.0,
        base_level=1.0,
        from_ns=place * 10**9,
        to_ns=(place + LAP) * 10**9,
        cue=cue,
        ahead_m=ahead_m,
        left_m=left_m,
        range_m=math.hypot(x_m, y_m),
        bearing_rad=math.atan2(y_m, x_m),
        sd_m=2.5 if sd_rad else 1.0,
        sd_rad=sd_rad,
    )


def _corrected(graph: Graph) -> Floats:
    """The (n, 3) poses that map correction finds; what becomes of the closures is in the graph."""
    task = Task(stamp_ns=0, task_id="t", codelet="map_correction", cycle=1, version=0)
    answer = map_correction.run(task, graph, CONFIG)
    graph.change(answer.operations)
    (correction,) = graph.of_kind(Correction)
    new = slice(CorrectionColumn.NEW_X_M, CorrectionColumn.NEW_HEADING_RAD + 1)
    return correction.rows.numpy()[:, new]


def _path(rows: Floats) -> PathSegment:
    return PathSegment(id="path:0", activation=0.0, base_level=1.0, number=0, rows=Matrix.of(rows))


def test_views_of_places_turn_a_path_back_that_a_landmark_alone_had_closed() -> None:
    truth, rows = _rows()
    graph = Graph()
    by_landmark = []
    for place in SEEN_FROM:
        there_m = transform_to(truth[place], LANDMARK_M)[0]
        here_m = transform_to(truth[place + LAP], LANDMARK_M)[0]
        by_landmark.append(_closure(place, "landmark", there_m, here_m, 0.0))
    graph.change([_path(rows), *by_landmark])
    rows[:, POSE] = _corrected(graph)
    turned_rad = relative(truth[-1:], rows[-1:, POSE])[0, 2]
    assert abs(turned_rad) > math.pi / 2

    nowhere_m = np.zeros(2)
    by_places = [_closure(place, "place", nowhere_m, nowhere_m, 0.05) for place in range(PLACES)]
    graph.change([_path(rows), *by_places])
    found = _corrected(graph)

    held = [graph.nodes[closure.id].accepted for closure in by_places]  # type: ignore[union-attr]
    assert all(held)
    again = relative(found[:PLACES], found[LAP : LAP + PLACES])
    assert np.abs(again).max(axis=0) == pytest.approx(0, abs=0.5)
