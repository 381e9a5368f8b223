"""Loops closed by the running mind: workspace and workers, percepts made up."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from cogmap.estimation.alignment import motion_onto
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import relative
from cogmap.graph.path import rows_of
from cogmap.runtime.run import REAL_TIME
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import (
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
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.mapping.path import ODOMETRY, POSE, STAMP
from cogmap.testing import percept, stamp_ns
from tests.support.paths import mean_distance_m, steps_m
from tests.support.world.loop_drive import HOUSE, LAP, QUIET, SLIP, TOWER, LoopDrive, round_once
from tests.support.world.scenes import Desk


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


def _distances_m(one: Floats, other: Floats) -> Floats:
    """(n,): from each of n positions to the nearest of m others."""
    off_m = one[:, None, :] - other[None]
    return np.hypot(off_m[..., 0], off_m[..., 1]).min(axis=1)


def _positions_m(desk: Desk) -> Floats:
    """(n, 2): where the places of the path are."""
    return _rows(desk)[:, POSE][:, :2]


def _path_error_m(drive: LoopDrive) -> float:
    stamps_ns = _rows(drive.desk)[:, STAMP] * 1e9
    frames = np.rint(stamps_ns / stamp_ns(0) - 1).astype(int)
    return mean_distance_m(_positions_m(drive.desk), drive.poses[frames])


def test_the_path_has_places_at_its_spacing_and_steps_by_path_integration() -> None:
    drive = LoopDrive()
    drive.go(70, {})
    path = list(drive.desk.graph.of_kind(PathSegment))
    assert [item.id for item in path] == ["path:0", "path:1"]

    rows = rows_of(path)
    lengths_m = steps_m(rows[:, ODOMETRY])
    assert len(rows) == 70
    assert lengths_m[:19] == pytest.approx(2.0)
    assert lengths_m[19:39] == pytest.approx(2.0 * (1 + SLIP))


def test_an_agent_that_stands_still_adds_nothing_to_its_path() -> None:
    desk = Desk("w1")
    for frame in range(5):
        desk.see(frame, rows=((0.0, 0.0, 0.2, 0.0, 0.0),))
        desk.work()

    assert len(_rows(desk)) == 1


@pytest.mark.parametrize("by", ["landmark", "view"])
def test_a_closed_loop_corrects_the_path_the_agent_and_its_objects(by: str) -> None:
    drive = round_once(LoopDrive())
    desk = drive.desk
    before_m = drive.error_m()
    path_before_m = _path_error_m(drive)
    house_before = _object(desk, "house")

    drive.meet(3, TOWER if by == "landmark" else None)
    drive.go(5, {})
    assert _accepted(desk) == [True] * 3
    assert drive.error_m() < 0.6 * before_m
    assert _path_error_m(drive) < path_before_m

    house = _object(desk, "house")
    moved_m = math.hypot(house.x_m - house_before.x_m, house.y_m - house_before.y_m)
    place = nearest_place(house.x_m, house.y_m, 1.0)
    assert 0.5 < moved_m < before_m
    assert desk.graph.links.targets(house.id, LinkKind.AT) == {place: 1.0}

    tower = _object(desk, "tower")
    assert (tower.x_m, tower.y_m) == pytest.approx(TOWER["tower"], abs=0.5)


def _heading_error_rad(correct: str) -> float:
    """After a loop was closed on a path that turns too far, correcting positions or headings."""
    config = msgspec.structs.replace(QUIET, correct=correct)
    drive = round_once(LoopDrive(config, bias_rad=0.004))
    drive.meet(3)
    drive.go(5, {})
    error_rad = drive.poses[drive.frame - 1, 2] - drive.desk.agent.heading_rad
    return abs(math.remainder(error_rad, 2 * math.pi))


def test_headings_are_corrected_only_where_configured() -> None:
    assert _heading_error_rad("heading") < 0.8 * _heading_error_rad("positions")


def _moved(anchor: str) -> tuple[Floats, Floats]:
    """How the first place of the path, and how the path as a whole, (3,) each, were moved by a loop
    that is closed on a path that turns too far.
    """
    config = msgspec.structs.replace(QUIET, anchor=anchor)
    drive = round_once(LoopDrive(config, bias_rad=0.004))
    before = _rows(drive.desk)[:, POSE]
    drive.meet(3)
    drive.go(5, {})

    after = _rows(drive.desk)[: len(before), POSE]
    first = relative(before[0], after[0])
    return first, motion_onto(before[:, :2], after[:, :2])


def test_a_correction_leaves_the_start_where_it_is_or_the_map_as_a_whole() -> None:
    first, turned = _moved("start")
    assert first == pytest.approx(np.zeros(3))

    # The path has grown a little before the correction was applied.
    first, left = _moved("map")
    assert np.abs(first).max() > 0.1
    assert np.hypot(*left[:2]) < 0.2 * np.hypot(*turned[:2])
    assert abs(left[2]) < 0.3 * abs(turned[2])


def test_what_was_corrected_before_stays_as_a_whole_where_the_next_lap_is_corrected() -> None:
    config = msgspec.structs.replace(QUIET, anchor="map")
    drive = round_once(LoopDrive(config, bias_rad=0.004))
    drive.meet(3)
    drive.go(LAP - 10, {})
    before = _rows(drive.desk)
    drive.meet(3)
    drive.go(5, {})

    after_m = _positions_m(drive.desk)[: len(before)]
    before_m = before[:, POSE][:, :2]
    closed_s = stamp_ns(LAP + 2) * 1e-9
    first_lap = before[:, STAMP] <= closed_s
    assert np.abs(after_m - before_m)[~first_lap].max() > 1.0
    assert motion_onto(before_m[first_lap], after_m[first_lap]) == pytest.approx(
        np.zeros(3), abs=0.05
    )


def test_road_moves_with_the_path_that_it_lies_along() -> None:
    drive = round_once(LoopDrive())
    drive.meet(3)
    drive.go(5, {})
    path_m = _positions_m(drive.desk)
    road_m, _ = drive.desk.graph.places.written_cells(ROOT_MAP, PlaceColumn.ROAD)
    assert len(road_m) > 100

    to_path_m = _distances_m(road_m, path_m)
    to_road_m = _distances_m(path_m, road_m)
    assert np.percentile(to_path_m, 95) < 2.0
    assert to_road_m.max() < 1.5


def test_what_the_agent_writes_during_a_correction_is_kept() -> None:
    drive = round_once(LoopDrive(background_cycles=4))
    desk = drive.desk
    drive.meet(3)
    length = len(_rows(desk))

    drive.go(4, {"inn": (60.0, -4.0)})
    inn_m = _object(desk, "inn").y_m
    assert CORRECTION_ID in desk.graph.nodes
    assert len(_rows(desk)) == length + 4

    drive.go(1, {})
    lengths_m = steps_m(_positions_m(desk))
    assert CORRECTION_ID not in desk.graph.nodes
    assert len(_rows(desk)) == length + 5
    assert lengths_m[length - 1 :] == pytest.approx(2.0)
    assert abs(_object(desk, "inn").y_m - inn_m) > 1.0
    assert all(not delta.reasons for delta in desk.deltas)


def test_lockstep_commits_the_correction_at_its_cycle_and_not_before() -> None:
    drive = round_once(LoopDrive(background_cycles=2))
    desk = drive.desk
    desk.withhold = "map_correction"
    drive.meet(3)
    drive.go(1, {})
    cycle = desk.graph.cycle
    version = desk.graph.version

    drive.go(2, {})
    assert len(desk.withheld) == 1
    assert (desk.graph.cycle, desk.graph.version) == (cycle, version)

    desk.release()
    desk.withhold = ""
    desk.work()
    corrected = [delta.cycle for delta in desk.deltas if delta.phase is Phase.BACKGROUND]
    assert not corrected or max(corrected) < cycle

    drive.go(2, {})
    background, end = [delta for delta in desk.deltas if delta.cycle == cycle + 2][-2:]
    assert background.phase is Phase.BACKGROUND
    assert end.phase is Phase.END


def test_real_time_continues_without_the_correction_by_other_workers() -> None:
    drive = round_once(LoopDrive(run=REAL_TIME, workers=2))
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
        drive = round_once(LoopDrive(workers=workers))
        drive.meet(3, TOWER)
        drive.go(6, {})
        digests.append(drive.desk.graph.digest())

    assert digests[0] == digests[1]


def _believed(landmarks: dict[str, tuple[float, float]], match: int | None) -> LoopDrive:
    """A drive round the block and on, with one view of landmarks or of another place."""
    drive = round_once(LoopDrive())
    drive.go(20, {})
    drive.go(1, landmarks, match=match)
    drive.go(12, {})

    assert not any(delta.phase is Phase.CORRECTION for delta in drive.desk.deltas)
    return drive


@pytest.mark.parametrize("by", ["landmark", "view"])
def test_one_view_mistaken_for_another_place_never_moves_the_map(by: str) -> None:
    plain = _believed({}, None)
    x_m, y_m, _ = plain.poses[LAP + 20].tolist()
    if by == "landmark":
        mistaken = _believed({"tower": (x_m + 6.0, y_m + 8.0)}, None)
    else:
        mistaken = _believed({}, match=40)

    assert len(_closures(plain.desk)) == 0
    assert len(_closures(mistaken.desk)) == 1
    assert mistaken.error_m() == pytest.approx(plain.error_m(), abs=1e-6)

    house = _object(plain.desk, "house")
    moved = _object(mistaken.desk, "house")
    assert moved.x_m == pytest.approx(house.x_m, abs=1e-6)
    assert moved.y_m == pytest.approx(house.y_m, abs=1e-6)


def test_one_false_view_among_true_ones_is_rejected() -> None:
    drive = round_once(LoopDrive())
    drive.meet(2)
    drive.go(1, {}, match=40)
    drive.meet(2)
    drive.go(8, {})
    closures = _closures(drive.desk)
    rejected = [closure.cue for closure in closures if not closure.accepted]

    assert len(closures) == 5
    assert rejected == ["view-40"]


def test_two_views_are_too_few_to_close_a_loop() -> None:
    drive = round_once(LoopDrive())
    before_m = drive.error_m()
    drive.meet(2)
    drive.go(10, {})

    assert _accepted(drive.desk) == [None, None]
    assert drive.error_m() == pytest.approx(before_m, abs=0.5)


def test_landmarks_too_uncertain_for_their_closures_to_agree_correct_the_path_together() -> None:
    config = msgspec.structs.replace(QUIET, correct="heading")
    street = {f"house {number}": (8.0 + 4.0 * number, 6.0) for number in range(6)}
    drive = LoopDrive(config, range_sd_m=6.0)
    drive.go(3, street)
    drive.go(LAP - 3, {})
    before_m = drive.error_m()

    drive.meet(6, street)
    drive.go(6, {})

    assert not any(_accepted(drive.desk))
    assert drive.error_m() < 0.8 * before_m


def _lap_error_m(*beside: Percept) -> float:
    """How far the path is from the truth once a loop was closed with `beside` in every view."""
    config = msgspec.structs.replace(QUIET, correct="heading")
    drive = round_once(LoopDrive(config, beside=beside))
    drive.meet(3, TOWER)
    drive.go(5, {})
    return _path_error_m(drive)


def test_a_wall_that_shows_in_part_wherever_the_agent_is_does_not_bend_its_path() -> None:
    # What is in view of it moves with the agent: it stands nowhere. Nobody knows its size.
    part = percept("wall", math.pi / 2, 5.0, range_sd_m=0.3, bearing_sd_rad=0.05, whole=False)
    wall = msgspec.structs.replace(part, name="")

    assert _lap_error_m(wall) == pytest.approx(_lap_error_m(), rel=0.05)


def test_closures_that_agree_beyond_possible_drift_are_rejected() -> None:
    drive = LoopDrive()
    drive.go(LAP // 2, {})
    before_m = drive.error_m()

    for view in (2, 3, 4):
        drive.go(1, {}, match=view)
    drive.go(7, {})
    consistent = [closure.consistent for closure in _closures(drive.desk)]

    assert consistent == [True] * 3
    assert _accepted(drive.desk) == [False] * 3
    assert drive.error_m() == pytest.approx(before_m, abs=1.0)
    assert CORRECTION_ID not in drive.desk.graph.nodes


def _house_error_m(drive: LoopDrive) -> float:
    house = _object(drive.desk, "house")
    x_m, y_m = HOUSE["house"]
    return math.hypot(house.x_m - x_m, house.y_m - y_m)


def test_a_corrected_map_that_the_next_drive_contradicts_is_taken_back() -> None:
    drive = round_once(LoopDrive())
    # Sixteen metres off: not more than path integration may have been wrong by.
    drive.meet(3, late=8)
    drive.go(5, {})
    wrong_m = drive.error_m()
    wrong_path_m = _path_error_m(drive)
    wrong_house_m = _house_error_m(drive)

    assert _accepted(drive.desk) == [True] * 3

    drive.meet(10)
    drive.go(8, {})
    closures = sorted(_closures(drive.desk), key=lambda closure: closure.to_ns)
    accepted = [closure.accepted for closure in closures]

    assert accepted[:6] == [False] * 3 + [True] * 3
    assert False not in accepted[6:]
    assert drive.error_m() < 0.5 * wrong_m
    assert _path_error_m(drive) < 0.5 * wrong_path_m
    assert _house_error_m(drive) < 0.5 * wrong_house_m
