"""Renderings to train on: towns of their own for training, choosing and testing; the same files
every time.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from cogmap.errors import CogmapError, UsageError
from cogmap.training.command import train
from cogmap.training.rendering.dataset import SPLITS, Job, jobs, render, render_all
from cogmap.training.rendering.reader import INVENTED, files, read


def test_no_town_is_in_two_splits_and_each_has_untaught_buildings() -> None:
    wanted = list(jobs(Path("out"), 1.0))
    seeds = [job.seed for job in wanted]
    assert len(seeds) == len(set(seeds)) == sum(split.towns for split in SPLITS)

    for split in SPLITS:
        here = [job for job in wanted if job.target.parent.name == split.name]
        assert len(here) == split.towns
        assert {job.invented for job in here} == set(split.invented)
        assert max(split.invented) >= 20


def test_a_trial_is_a_part_of_each_split() -> None:
    small = set(jobs(Path("out"), 0.1))
    whole = set(jobs(Path("out"), 1.0))
    splits = {job.target.parent.name for job in small}

    assert small < whole
    assert splits == {split.name for split in SPLITS}


def test_a_town_is_the_same_file_every_time_with_depth_by_stereo(tmp_path: Path) -> None:
    first = Job(4006, 3, 14, tmp_path / "first" / "town-4006.npz")
    again = Job(4006, 3, 14, tmp_path / "again" / "town-4006.npz")
    render_all([first, again], processes=2)
    files = [path.name for path in first.target.parent.iterdir()]
    assert files == ["town-4006.npz"]
    assert again.target.read_bytes() == first.target.read_bytes()

    town = read(first.target)
    invented = [name for name in town.names if name.startswith(INVENTED)]
    assert len(town.left) == len(town.stereo_m) == len(town.label) == 3
    assert len(invented) > 3

    known = (town.stereo_m > 3) & (town.depth_m > 3) & (town.depth_m < 30)
    error = np.abs(town.stereo_m[known] / town.depth_m[known] - 1)
    assert np.median(error) < 0.05


def test_a_file_that_exists_is_kept(tmp_path: Path) -> None:
    target = tmp_path / "train" / "town-1001.npz"
    target.parent.mkdir()
    target.write_bytes(b"from yesterday")
    render(Job(1001, 110, 0, target))

    assert target.read_bytes() == b"from yesterday"


def test_a_failure_names_the_town_and_leaves_no_file(tmp_path: Path) -> None:
    impossible = Job(-1, 1, 0, tmp_path / "town.npz")

    with pytest.raises(CogmapError, match=r"cannot render the town of seed -1: .*negative"):
        render(impossible)
    assert list(tmp_path.iterdir()) == []


def test_damaged_and_missing_renderings_are_named_with_the_remedy(tmp_path: Path) -> None:
    damaged = tmp_path / "town-1.npz"
    damaged.write_bytes(b"no archive")

    with pytest.raises(UsageError, match=r"town-1\.npz.*cogmap train render"):
        read(damaged)
    with pytest.raises(UsageError, match=r"train.*cogmap train render"):
        files(tmp_path, "train")


@pytest.mark.parametrize("scale", ["0", "-1", "nan", "inf", "1e9"])
def test_a_scale_of_nothing_or_without_bound_is_refused(tmp_path: Path, scale: str) -> None:
    run = CliRunner().invoke(train, ["render", str(tmp_path), f"--scale={scale}"])

    assert isinstance(run.exception, UsageError)
    assert "--scale must be over 0" in str(run.exception)
    assert list(tmp_path.iterdir()) == []
