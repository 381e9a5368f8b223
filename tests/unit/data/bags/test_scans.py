"""The scans of a laser in a bag, where there is no pair of cameras."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from cogmap.data.bags.bag import Bag
from cogmap.data.bags.scans import SECTOR_RAD, ScanRecording, read_scans
from cogmap.data.bags.topics import Topics
from cogmap.errors import UsageError
from tests.support import bags
from tests.support.bags import SECOND_NS, BagMaker, wheels

BEAMS = 360
NOTHING = math.inf


def _around(**seen: float) -> list[float]:
    """The ranges of a turn in which nothing is known, but for what is `seen` at some degrees."""
    range_m = [math.nan] * BEAMS
    for name, value in seen.items():
        degrees = {"ahead": 1, "left": 91, "right": -89, "behind": -179}[name]
        range_m[degrees + 180] = value
    return range_m


def _read(path: Path) -> ScanRecording:
    return read_scans(Bag(path), Topics())


def _one(path: Path, range_m: list[float], frame: str = "") -> dict[int, float]:
    """The rays of a scan: ranges by the bearing of their sector, in sectors from that ahead."""
    with BagMaker(path) as maker:
        wheels(maker)
        maker.static("base_link", "laser", (0.3, 0.0, 0.2))
        maker.scan(bags.frame_ns(0), range_m, frame=frame)
    (rays,) = _read(path).rays
    sectors = np.floor(rays[:, 0] / SECTOR_RAD).astype(int).tolist()
    return dict(zip(sectors, rays[:, 1].tolist(), strict=True))


def test_only_sectors_of_which_something_is_known_have_rays(tmp_path: Path) -> None:
    rays = _one(tmp_path / "bag", _around(ahead=2.0, left=NOTHING, right=0.01, behind=12.0))

    assert rays == {-72: 0.0, 0: pytest.approx(2.0), 36: 0.0}


def test_the_nearest_of_a_sector_counts(tmp_path: Path) -> None:
    range_m = _around(ahead=5.0)
    range_m[182] = 3.0

    assert list(_one(tmp_path / "bag", range_m).values()) == [pytest.approx(3.0)]


def test_rays_are_seen_from_the_robot_and_turned_as_the_laser_is(tmp_path: Path) -> None:
    # The laser's x axis points to the robot's right: a camera's does in a robot's frame.
    rays = _one(tmp_path / "bag", _around(ahead=2.0), frame="laser")

    ((sector, range_m),) = rays.items()
    assert (sector + 0.5) * SECTOR_RAD == pytest.approx(math.atan2(-2.0, 0.3), abs=SECTOR_RAD)
    assert range_m == pytest.approx(math.hypot(2.0, 0.3), abs=0.01)


def test_scans_in_quick_succession_are_left_out_and_counted(tmp_path: Path) -> None:
    with BagMaker(tmp_path / "bag") as maker:
        wheels(maker)
        for number in range(10):
            maker.scan(bags.BEGIN_NS + number * SECOND_NS // 10, _around(ahead=1.0))

    recording = _read(tmp_path / "bag")

    assert np.diff(recording.stamps_ns).tolist() == [SECOND_NS // 5] * 4
    assert recording.notes == [
        "5 scans that follow another within 0.2 s, or are without odometry, are left out"
    ]


def test_scans_without_odometry_are_said(tmp_path: Path) -> None:
    with BagMaker(tmp_path / "bag") as maker:
        maker.scan(bags.frame_ns(0), _around(ahead=1.0))

    with pytest.raises(UsageError, match="has laser scans, and no odometry"):
        _read(tmp_path / "bag")


def test_scans_from_another_time_than_odometry_are_said(tmp_path: Path) -> None:
    with BagMaker(tmp_path / "bag") as maker:
        wheels(maker)
        maker.scan(bags.frame_ns(100), _around(ahead=1.0))

    with pytest.raises(UsageError, match="no scan from the time of its odometry"):
        _read(tmp_path / "bag")
