"""A bag of ROS becomes a log that can be played."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from cogmap.cli.main import cogmap
from cogmap.errors import LogError
from cogmap.services.player import formats
from cogmap.services.player.config import Config
from tests.support import bags
from tests.support.bags import BagMaker, cameras, frame_ns, frames, wheels


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """A bag whose second pair cannot be read."""
    with BagMaker(tmp_path / "drive.bag", ros=1) as maker:
        cameras(maker)
        wheels(maker)
        frames(maker, (0, 2))
        maker.image(bags.LEFT, frame_ns(1), bags.WALL[:24])
        maker.image(bags.RIGHT, frame_ns(1), bags.WALL)
    return tmp_path / "drive.bag"


def _imported(*words: str | Path) -> str:
    arguments = ["log", "import", *map(str, words)]
    result = CliRunner().invoke(cogmap, arguments, standalone_mode=False)
    if result.exception is not None:
        raise result.exception
    return result.stdout


def test_the_log_plays_what_the_bag_does(bag: Path, tmp_path: Path) -> None:
    said = json.loads(_imported(bag, tmp_path / "log.mcap", "--json"))
    of_bag = formats.opened(Config(recording=f"bag:{bag}"))
    of_log = formats.opened(Config(recording=f"log:{tmp_path / 'log.mcap'}"))

    assert (said["views"], said["skipped"]) == (2, 1)
    assert said["messages"]["camera/stereo"] == 2
    assert list(of_log.stamps_ns) == [of_bag.stamps_ns[0], of_bag.stamps_ns[2]]
    (ours,) = of_log.view(1)
    (theirs,) = of_bag.view(2)
    assert (ours.left, ours.right) == (theirs.left, theirs.right)
    moved = [each.speed_m_s for each in [*of_bag.before(1), *of_bag.before(2)]]
    assert [each.speed_m_s for each in of_log.before(1)] == moved


def test_what_is_left_out_is_said_with_the_reason(bag: Path, tmp_path: Path) -> None:
    said = _imported(bag, tmp_path / "log.mcap")

    assert "2 views, 1 left out" in said
    assert "is 64 x 24, its CameraInfo says 64 x 48" in said


def test_a_log_that_exists_is_left_alone(bag: Path, tmp_path: Path) -> None:
    (tmp_path / "log.mcap").write_bytes(b"mine")

    with pytest.raises(LogError, match="exists"):
        _imported(bag, tmp_path / "log.mcap")
