"""Replays of a path that a correction publishes, and the synapses that they change."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from cogmap.geometry.arrays import Floats
from cogmap.schemas.cognition import Replay
from cogmap.schemas.graph import Delta, Phase
from cogmap.services.codelets.correction.joint import ROUNDS
from cogmap.testing import of_type, stamp_ns
from tests.support.world.loop_drive import QUIET, LoopDrive, round_once


def _replay(drive: LoopDrive) -> Replay:
    drive.meet(3)
    drive.go(4, {})
    (replay,) = of_type(Replay, drive.desk.published)
    return replay


def test_a_replay_is_published_once_after_the_commit_of_its_correction() -> None:
    drive = round_once(LoopDrive(workers=3))
    replay = _replay(drive)
    published = drive.desk.published
    before = published[: published.index(replay)]
    last = of_type(Delta, before)[-1]

    assert last.phase is Phase.BACKGROUND
    assert replay.source == "workspace"


def test_a_replay_counts_the_replays_of_the_rule_that_was_applied() -> None:
    with_headings = msgspec.structs.replace(QUIET, correct="heading")

    of_positions = _replay(round_once(LoopDrive()))
    of_headings = _replay(round_once(LoopDrive(with_headings)))

    assert of_positions.replays > 0
    assert of_headings.replays == 1 + ROUNDS


def test_a_replay_runs_backwards_and_shifts_each_place_less_than_the_last() -> None:
    replay = _replay(round_once(LoopDrive()))
    stamps = replay.stamps_ns.numpy().astype(np.int64)
    assert (np.diff(stamps) < 0).all()
    assert stamps[0] > stamps[-1] == stamp_ns(0)

    shifts = np.asarray(replay.shifts_m.numpy(), np.float64)
    shifts_m = np.hypot(shifts[:, 0], shifts[:, 1])
    assert (np.diff(shifts_m) <= 1e-9).all()
    assert shifts_m[-1] == pytest.approx(0.0)
    assert shifts_m[0] > 3.0
    assert (len(replay.closed), replay.undone) == (3, [])


def _strength(replay: Replay, positions_m: Floats) -> Floats:
    """The strength of the synapse of each pair of fields."""
    first, second = replay.pairs.numpy().astype(int).T
    apart_m = np.hypot(*(positions_m[first] - positions_m[second]).T)
    return np.exp(-replay.decay_per_m * apart_m)


def test_the_synapse_of_two_fields_grows_as_they_shift_together() -> None:
    replay = _replay(round_once(LoopDrive()))
    changes = np.asarray(replay.strength_changes.numpy(), np.float64)
    before_m = np.asarray(replay.positions_m.numpy(), np.float64)
    after_m = before_m + np.asarray(replay.shifts_m.numpy(), np.float64)
    expected = _strength(replay, after_m) - _strength(replay, before_m)
    assert changes == pytest.approx(expected)

    # The newest place is that of the third view, as was the third of all.
    first, second = replay.pairs.numpy().astype(int).T
    (same_place,) = np.flatnonzero((first == 0) & (second == len(before_m) - 3))
    assert changes[same_place] > 0.3
    assert changes[same_place] == pytest.approx(changes.max(), rel=0.01)
