"""Laps of one block, where what was driven before takes no more places of the path."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from cogmap.geometry.arrays import Floats
from cogmap.graph.path import rows_of
from cogmap.schemas.nodes import LoopClosure, PathSegment
from cogmap.services.codelets.mapping.path import POSE
from tests.support.world.loop_drive import LAP, QUIET, LoopDrive, round_once

NEVER_S = 1e9
VIEWS = 6
# A lap takes 16 s: its places are joined once it has been closed.
AFTER_S = 20.0


def _driven(correct: str, sparse_after_s: float) -> LoopDrive:
    """Three laps, of which two are recognised where they begin."""
    config = msgspec.structs.replace(QUIET, correct=correct, sparse_after_s=sparse_after_s)
    drive = round_once(LoopDrive(config))
    drive.meet(VIEWS)
    drive.go(LAP - VIEWS, {})
    drive.meet(VIEWS)
    drive.go(LAP - VIEWS, {})
    return drive


def _places_m(drive: LoopDrive) -> Floats:
    """(n, 2)"""
    return rows_of(drive.desk.graph.of_kind(PathSegment))[:, POSE][:, :2]


def _error_m(drive: LoopDrive) -> float:
    """How far places of the path are from where the robot drove, on average."""
    offset_m = _places_m(drive)[:, None] - drive.poses[:, :2]
    return float(np.hypot(*offset_m.transpose(2, 0, 1)).min(axis=1).mean())


@pytest.mark.parametrize("correct", ["positions", "heading"])
def test_a_lap_driven_again_takes_few_places_and_the_path_stays_right(correct: str) -> None:
    whole = _driven(correct, NEVER_S)
    sparse = _driven(correct, AFTER_S)

    assert len(_places_m(whole)) == 3 * LAP
    assert len(_places_m(sparse)) < 2.6 * LAP
    assert _error_m(sparse) < _error_m(whole) + 0.2
    assert sparse.desk.graph.count(LoopClosure) < whole.desk.graph.count(LoopClosure)
    assert sum(delta.rejected for delta in sparse.desk.deltas) == 0
