"""Loops closed by the running mind: workspace and workers, percepts made up."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from cogmap.geometry.arrays import Floats
from schemas.cognition import Replay
from schemas.graph import Phase
from schemas.nodes import (
    CORRECTION_ID,
    ROOT_MAP,
    LinkKind,
    LoopClosure,
    Object,
    PathSegment,
    PlaceColumn,
    nearest_place,
    object_id,
)
from services.codelets.correction.joint import ROUNDS
from services.codelets.mapping.path import ODOMETRY, POSE, STAMP, rows_of
from tests.support.loop_drive import LAP, QUIET, SLIP, LoopDrive
from tests.support.scenes import Desk, stamp_ns

TOWER = {"tower": (8.0, 5.0)}
HOUSE = {"house": (40.0, 50.0)}


def _round_once(drive: LoopDrive) -> LoopDrive:
    drive.go(3, TOWER)
    drive.go(30, {})
    drive.go(5, HOUSE)
    drive.go(LAP - 38, {})
    return drive


def _closures(desk: Desk) -> list[LoopClosure]:
    return list(desk.graph.of_kind(LoopClosure))


def _rows(desk: Desk) -> Floats:
    return rows_of(desk.graph.of_kind(PathSegment))


def _object(desk: Desk, label: str) -> Object:
    found = desk.graph.get(Object, object_id(label))
    assert found is not None
    return found


def _accepted(desk: Desk) -> list[bool | None]:
    return [closure.accepted for closure in _closures(desk)]


def _path_error_m(drive: LoopDrive) -> float:
    rows = _rows(drive.desk)
    frames = np.rint(rows[:, STAMP] / (stamp_ns(0) * 1e-9) - 1).astype(int)
    return float(np.hypot(*(rows[:, POSE][:, :2] - drive.poses[frames, :2]).T).mean())


def test_the_path_has_places_at_its_spacing_and_steps_by_path_integration() -> None:
    drive = LoopDrive()
    drive.go(70, {})
    path = list(drive.desk.graph.of_kind(PathSegment))

    assert [item.id for item in path] == ["path:0", "path:1"]

    rows = rows_of(path)
    assert len(rows) == 70

    steps_m = np.hypot(*np.diff(rows[:, ODOMETRY][:, :2], axis=0).T)
    assert steps_m[:19] == pytest.approx(2.0)
    assert steps_m[19:39] == pytest.approx(2.0 * (1 + SLIP))


def test_an_agent_that_stands_still_adds_nothing_to_its_path() -> None:
    desk = Desk("w1")
    for frame in range(5):
        desk.see(frame, rows=((0.0, 0.0, 0.2, 0.0, 0.0),))
        desk.work()

    assert len(_rows(desk)) == 1


@pytest.mark.parametrize("by", ["landmark", "view"])
def test_a_closed_loop_corrects_the_path_the_agent_and_its_objects(by: str) -> None:
    drive = _round_once(LoopDrive())
    before_m = drive.error_m()
    path_m = _path_error_m(drive)
    house = _object(drive.desk, "house")
    drive.meet(3, TOWER if by == "landmark" else None)
    drive.go(5, {})

    assert _accepted(drive.desk) == [True] * 3
    assert drive.error_m() < 0.6 * before_m
    assert _path_error_m(drive) < path_m

    after = _object(drive.desk, "house")
    moved_m = math.hypot(after.x_m - house.x_m, after.y_m - house.y_m)
    assert 0.5 < moved_m < before_m

    place = nearest_place(after.x_m, after.y_m, 1.0)
    assert drive.desk.graph.links.targets(after.id, LinkKind.AT) == {place: 1.0}

    tower = _object(drive.desk, "tower")
    assert (tower.x_m, tower.y_m) == pytest.approx(TOWER["tower"], abs=0.5)


def test_headings_are_corrected_only_where_configured() -> None:
    errors = {}
    for correct in ("positions", "heading"):
        drive = _round_once(
            LoopDrive(msgspec.structs.replace(QUIET, correct=correct), bias_rad=0.004)
        )
        drive.meet(3)
        drive.go(5, {})
        off = drive.poses[drive.frame - 1, 2] - drive.desk.agent.heading_rad
        errors[correct] = abs(math.remainder(off, 2 * math.pi))

    assert errors["heading"] < 0.8 * errors["positions"]


def test_road_moves_with_the_path_that_it_lies_along() -> None:
    drive = _round_once(LoopDrive())
    drive.meet(3)
    drive.go(5, {})
    path = _rows(drive.desk)[:, POSE][:, :2]
    road, _ = drive.desk.graph.places.written_cells(ROOT_MAP, PlaceColumn.ROAD)
    away = np.hypot(*(road[:, None, :] - path[None]).transpose(2, 0, 1)).min(axis=1)

    assert len(road) > 100
    assert np.percentile(away, 95) < 2.0

    on_road = np.hypot(*(path[:, None, :] - road[None]).transpose(2, 0, 1)).min(axis=1)
    assert on_road.max() < 1.5


def test_what_the_agent_writes_during_a_correction_is_kept() -> None:
    drive = _round_once(LoopDrive(background_cycles=4))
    desk = drive.desk
    drive.meet(3)
    drive.go(1, {})
    length = len(_rows(desk))
    drive.go(4, {"inn": (60.0, -4.0)})

    assert CORRECTION_ID in desk.graph.nodes
    assert len(_rows(desk)) == length + 4

    inn_m = _object(desk, "inn").y_m
    drive.go(1, {})
    assert CORRECTION_ID not in desk.graph.nodes

    rows = _rows(desk)
    assert len(rows) == length + 5

    steps = np.hypot(*np.diff(rows[:, POSE][:, :2], axis=0).T)
    assert steps[length - 1 :] == pytest.approx(2.0)
    assert abs(_object(desk, "inn").y_m - inn_m) > 1.0
    assert all(not delta.reasons for delta in desk.deltas)


def test_lockstep_commits_the_correction_at_its_cycle_and_not_before() -> None:
    drive = _round_once(LoopDrive(background_cycles=2))
    desk = drive.desk
    desk.withhold = "map_correction"
    drive.meet(3)
    drive.go(1, {})
    cycle = desk.graph.cycle
    drive.go(2, {})

    assert desk.deltas[-1].phase is not Phase.END
    assert desk.graph.cycle == cycle + 2
    assert len(desk.withheld) == 1

    desk.release()
    assert [delta.phase for delta in desk.deltas[-2:]] == [Phase.BACKGROUND, Phase.END]
    assert desk.deltas[-1].cycle == cycle + 2


def test_real_time_continues_without_the_correction_by_other_workers() -> None:
    drive = _round_once(LoopDrive(mode="real_time", workers=2))
    desk = drive.desk
    desk.withhold = "map_correction"
    drive.meet(3)
    drive.go(1, {})
    desk.busy.clear()
    drive.go(6, {})

    assert desk.withheld[0].worker not in desk.busy
    assert desk.deltas[-1].phase is Phase.END

    desk.release()
    drive.go(2, {})
    assert _accepted(desk) == [True] * 3


def test_the_same_drive_gives_the_same_graph_with_any_number_of_workers() -> None:
    digests = []
    for workers in (1, 3):
        drive = _round_once(LoopDrive(workers=workers))
        drive.meet(3, TOWER)
        drive.go(6, {})
        digests.append(drive.desk.graph.digest())

    assert digests[0] == digests[1]


@pytest.mark.parametrize("by", ["landmark", "view"])
def test_one_view_mistaken_for_another_place_never_moves_the_map(by: str) -> None:
    believed = []
    for mistaken in (False, True):
        drive = _round_once(LoopDrive())
        drive.go(20, {})
        x_m, y_m, _ = drive.poses[drive.frame].tolist()
        tower = {"tower": (x_m + 6.0, y_m + 8.0)} if mistaken and by == "landmark" else {}
        drive.go(1, tower, match=40 if mistaken and by == "view" else None)
        drive.go(12, {})
        house = _object(drive.desk, "house")
        believed.append([drive.error_m(), house.x_m, house.y_m])

        assert len(_closures(drive.desk)) == mistaken
        assert not any(delta.phase is Phase.CORRECTION for delta in drive.desk.deltas)

    assert believed[1] == pytest.approx(believed[0], abs=1e-6)


def test_one_false_view_among_true_ones_is_rejected() -> None:
    drive = _round_once(LoopDrive())
    drive.meet(2)
    drive.go(1, {}, match=40)
    drive.meet(2)
    drive.go(8, {})
    judged = {closure.cue: closure.accepted for closure in _closures(drive.desk)}

    assert [name for name, holds in judged.items() if not holds] == ["view-40"]
    assert len(judged) == 5


def test_two_views_are_too_few_to_close_a_loop() -> None:
    drive = _round_once(LoopDrive())
    before_m = drive.error_m()
    drive.meet(2)
    drive.go(10, {})

    assert _accepted(drive.desk) == [None, None]
    assert drive.error_m() == pytest.approx(before_m, abs=0.5)


def test_closures_that_agree_beyond_possible_drift_are_rejected() -> None:
    drive = LoopDrive()
    drive.go(LAP // 2, {})
    before_m = drive.error_m()
    for view in (2, 3, 4):
        drive.go(1, {}, match=view)
    drive.go(7, {})
    judged = [(closure.consistent, closure.accepted) for closure in _closures(drive.desk)]

    assert judged == [(True, False)] * 3
    assert drive.error_m() == pytest.approx(before_m, abs=1.0)
    assert CORRECTION_ID not in drive.desk.graph.nodes


def test_accepted_closures_are_undone_when_later_ones_contradict_them() -> None:
    drive = _round_once(LoopDrive())
    # Sixteen metres off: not more than path integration may have been wrong by.
    drive.meet(3, late=8)
    drive.go(5, {})
    wrong_m = drive.error_m()

    assert _accepted(drive.desk) == [True] * 3

    drive.meet(10)
    drive.go(8, {})
    closures = sorted(_closures(drive.desk), key=lambda closure: closure.to_ns)

    assert [closure.accepted for closure in closures] == [False] * 3 + [True] * 10
    assert drive.error_m() < 0.5 * wrong_m


def _replay(drive: LoopDrive) -> Replay:
    drive.meet(3)
    drive.go(4, {})
    (replay,) = [item for item in drive.desk.published if isinstance(item, Replay)]
    return replay


def test_a_replay_is_published_once_after_the_commit_of_its_correction() -> None:
    drive = _round_once(LoopDrive(workers=3))
    replay = _replay(drive)
    published = drive.desk.published
    before = published[: published.index(replay)]
    committed = [item for item in before if item in drive.desk.deltas]

    assert committed[-1].phase is Phase.BACKGROUND  # type: ignore[union-attr]
    assert replay.source == "workspace"


def test_a_replay_counts_the_replays_of_the_rule_that_was_applied() -> None:
    assert _replay(_round_once(LoopDrive())).replays > 0

    with_headings = msgspec.structs.replace(QUIET, correct="heading")
    assert _replay(_round_once(LoopDrive(with_headings))).replays == 1 + ROUNDS


def test_a_replay_runs_backwards_and_shifts_each_place_less_than_the_last() -> None:
    replay = _replay(_round_once(LoopDrive()))
    stamps = replay.stamps_ns.numpy().astype(np.int64)
    assert (np.diff(stamps) < 0).all()
    assert stamps[0] > stamps[-1] == stamp_ns(0)

    shifts_m = np.hypot(*np.asarray(replay.shifts_m.numpy(), np.float64).T)
    assert (np.diff(shifts_m) <= 1e-9).all()
    assert shifts_m[-1] == pytest.approx(0.0)
    assert shifts_m[0] > 3.0
    assert (len(replay.closed), replay.undone) == (3, [])


def test_the_synapse_of_two_fields_grows_as_they_shift_together() -> None:
    replay = _replay(_round_once(LoopDrive()))
    pairs = replay.pairs.numpy().astype(int)
    changes = np.asarray(replay.strength_changes.numpy(), np.float64)
    positions = np.asarray(replay.positions_m.numpy(), np.float64)
    moved = positions + np.asarray(replay.shifts_m.numpy(), np.float64)
    apart = np.array(
        [np.hypot(*(where[pairs[:, 0]] - where[pairs[:, 1]]).T) for where in (positions, moved)]
    )
    strength = np.exp(-replay.decay_per_m * apart)

    assert changes == pytest.approx(strength[1] - strength[0])

    # The newest place is that of the third view, as was the third of all.
    same_place = int(np.flatnonzero((pairs[:, 0] == 0) & (pairs[:, 1] == len(positions) - 3))[0])
    assert changes[same_place] > 0.3
    assert changes[same_place] == pytest.approx(changes.max(), rel=0.01)
