"""Which drives a sweep has, and which of them are driven already."""

from __future__ import annotations

from pathlib import Path

import pytest

from cogmap.cli.run.script import DriveOptions
from cogmap.cli.sweep.plan import PLAN_NAME, PlannedDrive, left_to_drive, plan
from cogmap.errors import StorageError, UsageError
from cogmap.services.codelets.rules import PRESETS, rules_of
from tests.support.world.summaries import summary, write_summary

BLOCKS: DriveOptions = {"town": "blocks"}
FAST = {"motor.cruise_m_s": 4.0}


def planned(folder: Path, *seeds: int, **common: object) -> list[PlannedDrive]:
    return plan(folder, seeds, [{}, FAST], common, BLOCKS)


def test_there_is_a_drive_for_each_variant_and_seed(tmp_path: Path) -> None:
    drives = planned(tmp_path, 1, 2, **{"sim.duration_s": 5.0, "motor.cruise_m_s": 1.0})

    names = [drive.folder.name for drive in drives]
    fast = drives[3]
    assert names == [
        "seed-1",
        "seed-2",
        "motor.cruise_m_s=4.0-seed-1",
        "motor.cruise_m_s=4.0-seed-2",
    ]
    assert (fast.seed, fast.settings) == (2, FAST)
    assert fast.request["options"] == ["--seed", "2", "--town", "blocks"]
    assert fast.request["settings"] == {
        "sim": {"duration_s": 5.0},
        "motor": {"cruise_m_s": 4.0},
    }


def test_a_drive_by_other_rules_is_another_drive(tmp_path: Path) -> None:
    (ours,) = plan(tmp_path, [1], [{}], {}, BLOCKS)
    (papers,) = plan(tmp_path, [1], [{}], {}, {**BLOCKS, "rules": "paper"})

    assert papers.request["options"] == ours.request["options"]
    assert rules_of(papers.request["settings"]) == PRESETS["paper"]
    assert rules_of(ours.request["settings"]) == PRESETS["cogmap"]


def test_a_value_with_a_path_in_it_names_a_folder(tmp_path: Path) -> None:
    (drive,) = plan(tmp_path, [1], [{"sim.town": "osm:../a b.osm"}], {}, {})

    assert drive.folder == tmp_path / "sim.town=osm_.._a_b.osm-seed-1"


def test_variants_that_begin_alike_have_folders_of_their_own(tmp_path: Path) -> None:
    long = "x" * 300
    variants = [{"sim.town": f"osm:{long}{last}"} for last in "ab"]

    one, other = plan(tmp_path, [1], variants, {}, {})

    assert one.folder != other.folder
    assert len(one.folder.name) < 150


@pytest.mark.parametrize(
    ("seeds", "options", "sentence"),
    [
        ([1, 1], {}, "seed-1 is there twice"),
        ([], {}, "needs a seed"),
        ([1], {"memory": "town.db", "out": "there"}, "takes no memory and no out: leave it"),
    ],
)
def test_a_sweep_that_cannot_be_is_refused(
    tmp_path: Path, seeds: list[int], options: DriveOptions, sentence: str
) -> None:
    with pytest.raises(UsageError, match=sentence):
        plan(tmp_path, seeds, [{}], {}, options)


def test_what_has_a_summary_of_the_same_options_is_not_driven_again(tmp_path: Path) -> None:
    first, *others = planned(tmp_path, 1, 2)
    assert left_to_drive(tmp_path, [first, *others]) == [first, *others]

    write_summary(first.folder, summary(ended_by="stuck", completed=False))

    assert left_to_drive(tmp_path, [first, *others]) == others
    assert left_to_drive(tmp_path, [first]) == []
    assert left_to_drive(tmp_path, others) == others


def test_what_was_interrupted_is_removed_and_driven_again(tmp_path: Path) -> None:
    cut, stopped, *_ = drives = planned(tmp_path, 1, 2)
    left_to_drive(tmp_path, drives)
    cut.folder.mkdir()
    write_summary(stopped.folder, summary(ended_by="interrupted"))

    assert left_to_drive(tmp_path, drives) == drives
    assert not cut.folder.exists()
    assert not stopped.folder.exists()


def test_a_drive_of_other_options_is_left_and_named(tmp_path: Path) -> None:
    before = planned(tmp_path, 1)
    left_to_drive(tmp_path, before)
    write_summary(before[0].folder, summary())

    with pytest.raises(UsageError, match="seed-1 has a drive of other options"):
        left_to_drive(tmp_path, planned(tmp_path, 1, **{"sim.duration_s": 5.0}))

    assert left_to_drive(tmp_path, before) == before[1:]


def test_a_folder_that_is_of_no_sweep_is_left_and_named(tmp_path: Path) -> None:
    drives = planned(tmp_path, 1)
    (tmp_path / PLAN_NAME).write_text("[]")

    with pytest.raises(UsageError, match="is no plan of a sweep"):
        left_to_drive(tmp_path, drives)
    with pytest.raises(StorageError, match="name another folder"):
        left_to_drive(tmp_path / PLAN_NAME / "below", drives)
