"""Loops closed by the running mind: workspace and workers, percepts made up."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from schemas.cognition import Replay, Task
from schemas.graph import Node, Proposal
from services.codelets.mapping.path import ODOMETRY, POSE, STAMP, rows_of
from services.codelets.module import build
from tests.support.loop_drive import LAP, QUIET, SLIP, LoopDrive
from tests.support.scenes import Desk, answer, node, stamp_ns

TOWER = {"tower": (8.0, 5.0)}
HOUSE = {"house": (40.0, 50.0)}


def _round_once(drive: LoopDrive) -> LoopDrive:
    drive.go(3, TOWER)
    drive.go(30, {})
    drive.go(5, HOUSE)
    drive.go(LAP - 38, {})
    return drive


def _closures(desk: Desk) -> list[Node]:
    return [item for item in desk.graph.nodes.values() if item.kind == "closure"]


def _path_error_m(drive: LoopDrive) -> float:
    rows = rows_of(drive.desk.graph.nodes.values())
    frames = np.rint(rows[:, STAMP] / (stamp_ns(0) * 1e-9) - 1).astype(int)
    return float(np.hypot(*(rows[:, POSE][:, :2] - drive.poses[frames, :2]).T).mean())


def test_the_path_has_a_place_for_every_metre_and_the_steps_between_as_path_integration_had_them() -> (
    None
):
    drive = LoopDrive()
    drive.go(70, {})
    path = [item for item in drive.desk.graph.nodes.values() if item.kind == "path"]
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
    assert len(rows_of(desk.graph.nodes.values())) == 1


@pytest.mark.parametrize("by", ["landmark", "view"])
def test_a_place_met_again_corrects_the_path_the_agent_and_the_objects_on_the_way(by: str) -> None:
    drive = _round_once(LoopDrive())
    before_m = drive.error_m()
    path_m = _path_error_m(drive)
    house = drive.desk.graph.nodes["object:house"]
    drive.meet(3, TOWER if by == "landmark" else None)
    drive.go(5, {})
    assert [item.attributes["holds"] for item in _closures(drive.desk)] == [True] * 3
    assert drive.error_m() < 0.6 * before_m
    assert _path_error_m(drive) < path_m
    after = drive.desk.graph.nodes["object:house"]
    moved_m = math.hypot(
        *(float(after.attributes[key]) - float(house.attributes[key]) for key in ("x_m", "y_m"))
    )
    assert 0.5 < moved_m < before_m
    assert drive.desk.graph.links["at"][after.id] == {after.attributes["place"]: 1.0}
    tower = drive.desk.graph.nodes["object:tower"].attributes
    assert (tower["x_m"], tower["y_m"]) == pytest.approx(TOWER["tower"], abs=0.5)


def test_headings_are_corrected_too_where_that_is_asked_for_and_only_there() -> None:
    errors = {}
    for correct in ("positions", "heading"):
        drive = _round_once(
            LoopDrive(msgspec.structs.replace(QUIET, correct=correct), bias_rad=0.004)
        )
        drive.meet(3)
        drive.go(5, {})
        off = drive.poses[drive.frame - 1, 2] - float(
            drive.desk.graph.nodes["self"].attributes["heading_rad"]
        )
        errors[correct] = abs(math.remainder(off, 2 * math.pi))
    assert errors["heading"] < 0.8 * errors["positions"]


def test_road_moves_with_the_way_that_it_lies_along() -> None:
    drive = _round_once(LoopDrive())
    drive.meet(3)
    drive.go(5, {})
    path = rows_of(drive.desk.graph.nodes.values())[:, POSE][:, :2]
    graph = drive.desk.graph
    road = np.array(
        [
            (i + 32 * x, j + 32 * y)
            for (x, y), tile in graph.tiles.items()
            for i, j in zip(*np.nonzero(tile.columns["road"]), strict=True)
        ]
    )
    away = np.hypot(*(road[:, None, :] - path[None]).transpose(2, 0, 1)).min(axis=1)
    assert len(road) > 100
    assert np.percentile(away, 95) < 2.0
    on_road = np.hypot(*(path[:, None, :] - road[None]).transpose(2, 0, 1)).min(axis=1)
    assert on_road.max() < 1.5


def test_the_agent_goes_on_while_a_loop_is_corrected_and_keeps_what_it_writes_meanwhile() -> None:
    drive = _round_once(LoopDrive(correction_cycles=4))
    drive.meet(3)
    drive.go(1, {})
    length = len(rows_of(drive.desk.graph.nodes.values()))
    drive.go(4, {"inn": (60.0, -4.0)})
    graph = drive.desk.graph
    assert "correction" in graph.nodes
    assert len(rows_of(graph.nodes.values())) == length + 4
    inn_m = float(graph.nodes["object:inn"].attributes["y_m"])
    drive.go(1, {})
    graph = drive.desk.graph
    assert "correction" not in graph.nodes
    rows = rows_of(graph.nodes.values())
    assert len(rows) == length + 5
    steps = np.hypot(*np.diff(rows[:, POSE][:, :2], axis=0).T)
    assert steps[length - 1 :] == pytest.approx(2.0)
    assert abs(float(graph.nodes["object:inn"].attributes["y_m"]) - inn_m) > 1.0
    assert all(not delta.refused for delta in drive.desk.deltas)


def test_in_lockstep_the_answer_is_waited_for_at_its_cycle_and_not_taken_before() -> None:
    drive = _round_once(LoopDrive(correction_cycles=2))
    desk = drive.desk
    kept = []

    def keep_back(tasks: list[Task]) -> list[Task]:
        kept.extend(asked for asked in tasks if asked.codelet == "map_correction")
        return [asked for asked in tasks if asked.codelet != "map_correction"]

    take = desk.take
    desk.take = lambda: keep_back(take())  # type: ignore[method-assign]
    drive.meet(3)
    drive.go(1, {})
    cycle = desk.graph.cycle
    drive.go(2, {})
    assert desk.deltas[-1].phase != "decay"
    assert desk.graph.cycle == cycle + 2
    (asked,) = kept
    proposal = build(QUIET, asked.worker).feed(asked)[-1]
    desk.feed(proposal)
    assert [delta.phase for delta in desk.deltas[-2:]] == ["correction", "decay"]
    assert desk.deltas[-1].cycle == cycle + 2


def test_in_real_time_the_cycle_goes_on_without_the_answer_and_others_do_its_work() -> None:
    drive = _round_once(LoopDrive(mode="real_time", workers=2))
    desk = drive.desk
    kept = []
    take = desk.take

    def keep_back() -> list[Task]:
        tasks = take()
        kept.extend(asked for asked in tasks if asked.codelet == "map_correction")
        return [asked for asked in tasks if asked.codelet != "map_correction"]

    desk.take = keep_back  # type: ignore[method-assign]
    drive.meet(3)
    drive.go(1, {})
    busy = kept[0].worker
    seen: list[str] = []
    desk.take = lambda: [asked for asked in keep_back() if not seen.append(asked.worker)]  # type: ignore[func-returns-value, method-assign]
    drive.go(6, {})
    assert busy not in seen
    assert desk.deltas[-1].phase == "decay"
    desk.feed(build(QUIET, busy).feed(kept[0])[-1])
    drive.go(2, {})
    assert [item.attributes["holds"] for item in _closures(desk)] == [True] * 3


def test_the_same_drive_gives_the_same_bytes_whatever_the_number_of_workers() -> None:
    digests = []
    for workers in (1, 3):
        drive = _round_once(LoopDrive(workers=workers))
        drive.meet(3, TOWER)
        drive.go(6, {})
        digests.append(drive.desk.graph.digest())
    assert digests[0] == digests[1]


@pytest.mark.parametrize("by", ["landmark", "view"])
def test_one_view_of_another_place_than_it_seems_never_moves_the_map(by: str) -> None:
    believed = []
    for mistaken in (False, True):
        drive = _round_once(LoopDrive())
        drive.go(20, {})
        x_m, y_m, _ = drive.poses[drive.frame].tolist()
        tower = {"tower": (x_m + 6.0, y_m + 8.0)} if mistaken and by == "landmark" else {}
        drive.go(1, tower, match=40 if mistaken and by == "view" else None)
        drive.go(12, {})
        house = drive.desk.graph.nodes["object:house"].attributes
        believed.append([drive.error_m(), float(house["x_m"]), float(house["y_m"])])
        assert len(_closures(drive.desk)) == mistaken
        assert not any(delta.phase == "shift" and delta.operations for delta in drive.desk.deltas)
    assert believed[1] == pytest.approx(believed[0], abs=1e-6)


def test_one_false_view_among_true_ones_does_not_hold() -> None:
    drive = _round_once(LoopDrive())
    drive.meet(2)
    drive.go(1, {}, match=40)
    drive.meet(2)
    drive.go(8, {})
    judged = {
        str(item.attributes["by"]): item.attributes["holds"] for item in _closures(drive.desk)
    }
    assert [name for name, holds in judged.items() if not holds] == ["view-40"]
    assert len(judged) == 5


def test_two_views_are_too_few_to_agree() -> None:
    drive = _round_once(LoopDrive())
    before_m = drive.error_m()
    drive.meet(2)
    drive.go(10, {})
    assert not any("holds" in item.attributes for item in _closures(drive.desk))
    assert drive.error_m() == pytest.approx(before_m, abs=0.5)


def test_closures_that_agree_but_cannot_be_true_do_not_hold() -> None:
    drive = LoopDrive()
    drive.go(LAP // 2, {})
    before_m = drive.error_m()
    for view in (2, 3, 4):
        drive.go(1, {}, match=view)
    drive.go(7, {})
    judged = [
        (item.attributes["agrees"], item.attributes["holds"]) for item in _closures(drive.desk)
    ]
    assert judged == [(True, False)] * 3
    assert drive.error_m() == pytest.approx(before_m, abs=1.0)
    assert "correction" not in drive.desk.graph.nodes


def test_closures_that_were_believed_are_undone_when_those_after_them_speak_against_them() -> None:
    drive = _round_once(LoopDrive())
    # Sixteen metres off: not more than path integration may have been wrong by.
    drive.meet(3, late=8)
    drive.go(5, {})
    wrong_m = drive.error_m()
    assert [item.attributes["holds"] for item in _closures(drive.desk)] == [True] * 3
    drive.meet(10)
    drive.go(8, {})
    closures = sorted(_closures(drive.desk), key=lambda item: int(item.attributes["to_ns"]))
    assert [item.attributes["holds"] for item in closures] == [False] * 3 + [True] * 10
    assert drive.error_m() < 0.5 * wrong_m


def _replay(drive: LoopDrive) -> Replay:
    kept: list[Task] = []
    take = drive.desk.take

    def watch() -> list[Task]:
        tasks = take()
        kept.extend(asked for asked in tasks if asked.codelet == "map_correction")
        return tasks

    drive.desk.take = watch  # type: ignore[method-assign]
    drive.meet(3)
    drive.go(1, {})
    said = build(QUIET, kept[0].worker).feed(kept[0])
    assert [type(message) for message in said] == [Replay, Proposal]
    assert isinstance(said[0], Replay)
    return said[0]


def test_a_replay_goes_backwards_from_the_place_met_again_and_shifts_each_place_less() -> None:
    replay = _replay(_round_once(LoopDrive()))
    stamps = replay.stamps_ns.numpy().astype(np.int64)
    assert (np.diff(stamps) < 0).all()
    assert stamps[0] > stamps[-1] == stamp_ns(0)
    shifts_m = np.hypot(*np.asarray(replay.shifts_m.numpy(), np.float64).T)
    assert (np.diff(shifts_m) <= 1e-9).all()
    assert shifts_m[-1] == pytest.approx(0.0)
    assert shifts_m[0] > 3.0
    assert (len(replay.closed), replay.undone) == (3, [])


def test_the_synapse_of_two_fields_of_one_place_grows_with_how_far_the_fields_shift_together() -> (
    None
):
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


@pytest.mark.parametrize(
    ("sent", "lacking"),
    [
        (node("path:0", np.zeros((3, 9)), "path"), "number"),
        (node("closure:1", kind="closure", to_ns=3), "from_ns"),
        (node("correction", kind="correction"), "samples"),
        (node("correction", np.zeros((3, 3)), "correction"), "shape"),
    ],
)
def test_an_answer_that_would_leave_the_way_without_what_the_workspace_reads_is_refused(
    sent: Node, lacking: str
) -> None:
    desk = Desk("w1")
    desk.see(0)
    desk.feed(answer(desk.take()[0], [sent]))
    desk.work()
    refused = [reason for delta in desk.deltas for reason in delta.refused]
    assert len(refused) == 1
    assert lacking in refused[0]
