"""Loops closed as in the paper: by one sighting (§5.6), and by eq. 9 as it is printed."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.schemas.array import Matrix
from cogmap.schemas.nodes import (
    CORRECTION_ID,
    Correction,
    LoopClosure,
    Object,
    PathColumn,
    PathSegment,
    object_id,
)
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.mapping.path import POSE, segments
from cogmap.testing import agent, graph_of, landmark, task
from tests.support.world.loop_drive import QUIET, TOWER, LoopDrive, round_once
from tests.support.world.scenes import run

PAPER = msgspec.structs.replace(QUIET, closes_by="sighting", correct="eq9")
SEEN_FROM = 2
"""The last of the places from which the drive sees the tower at first, and the nearest."""


def _accepted(drive: LoopDrive) -> list[bool | None]:
    return [closure.accepted for closure in drive.desk.graph.of_kind(LoopClosure)]


def _poses(drive: LoopDrive) -> Floats:
    """The poses of the path, (n, 3)."""
    return rows_of(drive.desk.graph.of_kind(PathSegment))[:, POSE]


@pytest.mark.parametrize(("closes_by", "accepted"), [("sighting", [True]), ("agreement", [None])])
def test_one_sighting_closes_a_loop_if_one_is_enough(
    closes_by: str, accepted: list[bool | None]
) -> None:
    config = msgspec.structs.replace(PAPER, closes_by=closes_by)
    drive = round_once(LoopDrive(config))
    drive.meet(1, TOWER)
    drive.go(4, {})

    assert _accepted(drive) == accepted


def test_a_landmark_closes_one_loop_on_each_pass() -> None:
    drive = round_once(LoopDrive(PAPER))
    drive.meet(3, TOWER)
    drive.go(4, {})

    assert _accepted(drive) == [True]


def test_a_place_recognised_by_its_view_closes_no_loop_of_the_papers() -> None:
    drive = round_once(LoopDrive(PAPER))
    drive.meet(4)
    drive.go(4, {})

    assert _accepted(drive) == []


def test_eq_9_brings_the_end_of_a_loop_to_its_start_and_turns_nothing() -> None:
    drive = round_once(LoopDrive(PAPER))
    before = _poses(drive)
    before_m = drive.error_m()
    drive.meet(1, TOWER)
    drive.go(4, {})
    after = _poses(drive)[: len(before)]

    moved_m = np.hypot(*(after - before)[:, :2].T)
    assert drive.error_m() < 0.2 * before_m
    assert after[:, 2] == pytest.approx(before[:, 2])
    # In equal steps from the second place on after that from which the tower was nearest.
    assert moved_m[: SEEN_FROM + 2] == pytest.approx(0.0)
    assert np.diff(moved_m[SEEN_FROM + 1 :], 2) == pytest.approx(0.0, abs=1e-9)
    assert moved_m[-1] == pytest.approx(before_m, abs=0.4)


ROWS = 4


def _path(y_m: float) -> Floats:
    """The poses of places 10 m apart along x, (ROWS, 3), the last of them aside."""
    poses = np.zeros((ROWS, 3))
    poses[:, 0] = 10.0 * np.arange(ROWS)
    poses[-1, 1] = y_m
    return poses


def _corrected(correct: str, house: Object) -> Object:
    """The house, after its map was corrected so that the last place of the path comes 4 m back."""
    rows = np.zeros((ROWS, len(PathColumn)))
    rows[:, PathColumn.STAMP_S] = np.arange(ROWS)
    rows[:, POSE] = _path(4.0)
    moved = np.column_stack([np.arange(ROWS), _path(4.0), _path(0.0)])
    correction = Correction(id=CORRECTION_ID, rows=Matrix.of(moved))

    graph: Graph = graph_of(agent(), house, correction, *segments(rows))
    config = Config(correct=correct)
    graph.change(run(task("apply_correction"), graph, config).operations)
    found = graph.get(Object, object_id("house"))
    assert found is not None
    return found


def test_by_eq_9_an_object_shifts_with_the_nearest_place_of_the_path() -> None:
    """Ours moves it with the places from which it came to be known, the first ones here."""
    house = landmark("house", [(28.0, 6.0)] * 20, created_ns=0, last_seen_ns=10**9)

    by_eq9 = _corrected("eq9", house)
    assert (by_eq9.x_m, by_eq9.y_m) == pytest.approx((28.0, 2.0))
    ours = _corrected("heading", house)
    assert (ours.x_m, ours.y_m) == pytest.approx((28.0, 6.0))


def test_an_object_that_was_surveyed_stays() -> None:
    surveyed = landmark("house", [(28.0, 6.0)], surveyed=True)
    found = _corrected("eq9", surveyed)
    assert math.hypot(found.x_m - 28.0, found.y_m - 6.0) == 0.0
