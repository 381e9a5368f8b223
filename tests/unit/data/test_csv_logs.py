"""Logs with trees and with ranges to beacons, right and wrong."""

from __future__ import annotations

import lzma
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from cogmap.data import plaza, victoria_park
from cogmap.errors import UsageError

TREES = {
    "odometry.csv": "t_s,speed_m_s,turn_rate_rad_s\n1.0,2.0,0.0\n1.1,2.0,0.1\n",
    "trees.csv": (
        "t_s,range_m,bearing_rad,diameter_m\n1.05,6.22,0.0,0.4\n1.05,5.0,1.0,0.3\n1.0,9.0,0.0,0.2\n"
    ),
    "gps.csv": "t_s,x_m,y_m\n1.0,-3.0,4.0\n",
}
RANGES = {
    "odometry.csv": "t_s,distance_m,turn_rad\n1.0,0.2,0.0\n1.2,0.2,0.01\n",
    "ranges.csv": "t_s,beacon,range_m\n1.2,5,40.0\n1.1,1,20.0\n1.3,5,39.9\n",
    "truth.csv": "t_s,x_m,y_m,heading_rad\n1.0,0.0,0.0,0.0\n1.2,0.2,0.0,0.01\n",
    "beacons.csv": "beacon,x_m,y_m\n1,20.0,0.0\n5,0.0,40.0\n",
}


def _folder(path: Path, files: Mapping[str, str | None]) -> Path:
    for name, text in files.items():
        if text is not None:
            (path / name).write_text(text)
    return path


def test_trees_are_read_by_time_and_those_that_came_late_are_counted(tmp_path: Path) -> None:
    log = victoria_park.read(_folder(tmp_path, TREES))

    assert log.trees[:, 0].tolist() == [1.0, 1.05, 1.05]
    assert log.out_of_order == 1
    assert log.odometry.shape == (2, 3)
    assert log.gps.tolist() == [[1.0, -3.0, 4.0]]


def test_a_trunk_before_the_laser_is_farther_from_the_axle_and_to_its_left(tmp_path: Path) -> None:
    log = victoria_park.read(_folder(tmp_path, TREES))

    _, ahead, _ = log.trees_from_axle

    range_m = math.hypot(6.22 + 3.78, 0.5)
    np.testing.assert_allclose(ahead, [1.05, range_m, math.atan2(0.5, 10.0), 0.4])


def test_ranges_are_read_by_time_with_the_surveyed_beacons(tmp_path: Path) -> None:
    log = plaza.read(_folder(tmp_path, RANGES))

    assert log.ranges.tolist() == [[1.1, 1, 20.0], [1.2, 5, 40.0], [1.3, 5, 39.9]]
    assert log.out_of_order == 1
    assert log.beacons == {1: (20.0, 0.0), 5: (0.0, 40.0)}
    assert log.truth.shape == (2, 4)


def test_packed_files_are_read_as_they_are(tmp_path: Path) -> None:
    for name, text in RANGES.items():
        (tmp_path / f"{name}.xz").write_bytes(lzma.compress(text.encode()))

    assert len(plaza.read(tmp_path).ranges) == 3


@pytest.mark.parametrize(
    ("file", "text", "expected"),
    [
        ("trees.csv", "t,range,bearing\n", "trees.csv, line 1: expected the names t_s,range_m"),
        (
            "trees.csv",
            "t_s,range_m,bearing_rad,diameter_m\n1.0,-2.0,0.0,0.3\n",
            "line 2: expected 4 numbers .*, range_m above 0",
        ),
        ("gps.csv", "t_s,x_m,y_m\n1.0,2.0,nan\n", "gps.csv, line 2: expected 3 numbers"),
        ("gps.csv", "t_s,x_m,y_m\n", "has no line but its first: give the whole file"),
        ("gps.csv", "", "line 1: expected the names"),
        (
            "odometry.csv",
            "t_s,speed_m_s,turn_rate_rad_s\n2.0,1.0,0.0\n1.0,1.0,0.0\n",
            "odometry.csv goes from 2.000 s to 1.000 s: give a log of one clock",
        ),
        (
            "odometry.csv",
            "t_s,speed_m_s,turn_rate_rad_s\n2.0,fast,0.0\n",
            "odometry.csv, line 2: expected 3 numbers",
        ),
        ("odometry.csv", None, "has no odometry.csv: give the folder of a log with trees"),
    ],
)
def test_a_wrong_log_is_refused_in_a_sentence_that_names_the_place(
    tmp_path: Path, file: str, text: str | None, expected: str
) -> None:
    folder = _folder(tmp_path, {**TREES, file: text})

    with pytest.raises(UsageError, match=expected):
        victoria_park.read(folder)


@pytest.mark.parametrize("read", [victoria_park.read, plaza.read])
def test_a_folder_that_is_none_is_refused(tmp_path: Path, read) -> None:
    with pytest.raises(UsageError, match="there is no folder"):
        read(tmp_path / "nowhere")
