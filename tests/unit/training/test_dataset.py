"""Renderings to train on: towns of their own for training, choosing and testing; the same files
every time.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cogmap.errors import CogmapError, UsageError
from training.rendering.dataset import SPLITS, Job, jobs, render
from training.renderings import files, read


def test_no_town_is_in_two_splits_and_every_split_has_buildings_nobody_was_taught() -> None:
    wanted = list(jobs(Path("out"), 1.0))
    seeds = [job.seed for job in wanted]

    assert len(seeds) == len(set(seeds)) == sum(split.towns for split in SPLITS)
    for split in SPLITS:
        here = [job for job in wanted if job.target.parent.name == split.name]
        assert len(here) == split.towns
        assert {job.unknown for job in here} == set(split.unknown)
        assert max(split.unknown) >= 20


def test_a_trial_is_a_part_of_each_split() -> None:
    small, whole = (set(jobs(Path("out"), scale)) for scale in (0.1, 1.0))
    assert small < whole
    assert {job.target.parent.name for job in small} == {split.name for split in SPLITS}


def test_a_town_is_the_same_file_every_time_and_has_what_training_needs(tmp_path: Path) -> None:
    first, again = (
        Job(4006, 3, 14, tmp_path / name / "town-4006.npz") for name in ("first", "again")
    )
    for job in (first, again):
        render(job)
    town = read(first.target)

    assert again.target.read_bytes() == first.target.read_bytes()
    assert [path.name for path in first.target.parent.iterdir()] == ["town-4006.npz"]
    assert town.left.shape[0] == len(town.stereo_m) == len(town.label) == 3
    assert sum(name.startswith("invented-") for name in town.names) > 3
    known = (town.stereo_m > 3) & (town.depth_m > 3) & (town.depth_m < 30)
    assert np.median(np.abs(town.stereo_m[known] / town.depth_m[known] - 1)) < 0.05


def test_what_is_rendered_already_is_kept(tmp_path: Path) -> None:
    there = tmp_path / "train" / "town-1001.npz"
    there.parent.mkdir()
    there.write_bytes(b"from yesterday")
    render(Job(1001, 110, 0, there))
    assert there.read_bytes() == b"from yesterday"


def test_a_failure_of_the_simulator_is_told_by_its_last_word(tmp_path: Path) -> None:
    with pytest.raises(CogmapError, match=r"training\.rendering\.towns failed: .*negative"):
        render(Job(-1, 1, 0, tmp_path / "town.npz"))
    assert list(tmp_path.iterdir()) == []


def test_damaged_renderings_and_missing_ones_are_named_with_the_remedy(tmp_path: Path) -> None:
    damaged = tmp_path / "town-1.npz"
    damaged.write_bytes(b"no archive")
    with pytest.raises(UsageError, match=r"town-1\.npz.*training\.rendering\.dataset"):
        read(damaged)
    with pytest.raises(UsageError, match=r"train.*training\.rendering\.dataset"):
        files(tmp_path, "train")


def test_a_scale_of_nothing_is_refused(tmp_path: Path) -> None:
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "training.rendering.dataset",
            "--out",
            str(tmp_path),
            "--scale",
            "0",
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode != 0
    assert "--scale must be over 0" in done.stderr
