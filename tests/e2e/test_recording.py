"""`cogmap run --recording` as users run it: real processes, on a recording made in the test."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

from cogmap.recording.diff import diff
from tests.support.recordings import kitti_folder, mrclam_folder
from tests.support.system.runs import COGMAP, DRIVING, Run, processes_at

REPLAYED = ("player", "workspace", "codelets", "global_workspace", "procedural", "action", "motor")


def test_a_recording_is_lived_through_recorded_summarised_drawn_explained_and_replayed(
    start: Callable[..., Run], tmp_path: Path
) -> None:
    folder = mrclam_folder(tmp_path / "walk")
    run = start("--recording", f"mrclam:{folder}", "--lockstep")
    assert run.end() == 0, run.output()

    summary = run.summary()
    assert summary["ended_by"] == "recording over"
    assert summary["completed"]
    assert summary["recording"] == "mrclam:walk"
    assert (summary["views"], summary["skipped"]) == (9, 0)
    assert summary["commands"] == summary["estimates"] == 9
    assert summary["halted"] == {"recording": 9}
    assert summary["restarts"] == {}
    assert summary["gaps_total"] == 0
    assert 0.0 < summary["estimate"]["max_m"] < 0.5
    assert summary["objects"] == 2
    assert "mrclam:walk, 9 views" in run.output()
    assert (run.folder / "map.png").read_bytes().startswith(b"\x89PNG")
    assert processes_at(run.endpoint) == []

    log = str(run.folder / "log.mcap")
    into = [word for name in REPLAYED for word in ("--into", name)]
    subprocess.run([*COGMAP, "log", "replay", log, *into], check=True)
    explained = subprocess.run(
        [*COGMAP, "explain", log, "--cycle", "5"], capture_output=True, text=True, check=True
    )
    assert "halted by recording" in explained.stdout


def test_the_log_of_a_recording_is_a_recording_with_the_same_outcome(
    start: Callable[..., Run], tmp_path: Path
) -> None:
    folder = mrclam_folder(tmp_path / "walk")
    first = start("--recording", f"mrclam:{folder}", "--lockstep")
    assert first.end() == 0, first.output()

    again = start("--recording", f"log:{first.folder / 'log.mcap'}", "--lockstep")
    assert again.end() == 0, again.output()

    compared = diff(first.folder / "log.mcap", again.folder / "log.mcap")
    same = {topic.topic: topic.same for topic in compared.topics if topic.same}
    assert {"epam/percepts", "workspace/delta", "motor/command"} <= same.keys()


def test_a_player_that_is_killed_goes_on_where_it_was(
    start: Callable[..., Run], tmp_path: Path
) -> None:
    times = 240  # so that it still plays when the first line on the drive is printed
    folder = mrclam_folder(tmp_path / "walk", times=times)
    run = start("--recording", f"mrclam:{folder}", "--lockstep")
    run.wait_for(DRIVING)

    run.kill("player")

    assert run.end() == 0, run.output()
    summary = run.summary()
    assert summary["restarts"] == {"player": 1}
    views = 2 * times + 3
    assert summary["views"] == views
    assert views - 3 <= summary["commands"] <= views


def test_in_real_time_a_recording_that_ends_ends_the_run(
    start: Callable[..., Run], tmp_path: Path
) -> None:
    folder = mrclam_folder(tmp_path / "walk")
    run = start("--recording", f"mrclam:{folder}", "--speed", "2")
    assert run.end() == 0, run.output()

    assert run.summary()["ended_by"] == "recording over"
    assert run.summary()["views"] == 9


def test_a_recording_that_cannot_be_played_is_one_sentence_and_code_2(
    start: Callable[..., Run], tmp_path: Path
) -> None:
    run = start("--recording", f"kitti:{tmp_path}")

    assert run.end() == 2
    assert run.output().startswith(f"cogmap: {tmp_path} has no folders image_0 and image_1")
    assert len(run.output().splitlines()) == 1
    assert not run.folder.exists()


def test_pictures_are_seen_and_a_broken_one_in_the_middle_is_left_out_counted_and_said(
    start: Callable[..., Run], tmp_path: Path
) -> None:
    folder = kitti_folder(tmp_path / "07", pairs=5)
    (folder / "image_1" / "000002.png").write_bytes(b"no picture")
    run = start("--recording", f"kitti:{folder}", "--lockstep")
    assert run.end() == 0, run.output()

    summary = run.summary()
    assert summary["ended_by"] == "recording over"
    assert (summary["views"], summary["skipped"]) == (4, 1)
    (reason,) = summary["skipped_reasons"]
    assert "000002.png is no whole picture" in reason
    assert "1 left out" in summary["reason"]
    assert summary["commands"] == 4
    assert summary["distance_m"] < 0.5, "the camera stands"
    assert summary["estimate"]["max_m"] == 0.0, "nobody knows where it really was"
    assert (run.folder / "map.png").read_bytes().startswith(b"\x89PNG")
