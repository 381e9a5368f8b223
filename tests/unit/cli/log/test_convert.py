"""A log or a bag is written as what a name ends with."""

from __future__ import annotations

from pathlib import Path

import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

from cogmap.cli.log.convert import is_bag
from cogmap.errors import UsageError
from cogmap.recording import open_log
from cogmap.schemas import topics
from tests.support.bags import BagMaker, cameras, frames
from tests.support.reference import REFERENCE
from tests.support.system.commands import log_command, log_facts


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """A bag of ROS 2 with three pairs."""
    with BagMaker(tmp_path / "bag") as maker:
        cameras(maker)
        frames(maker)
    return tmp_path / "bag"


def test_a_log_is_written_with_another_compression(tmp_path: Path) -> None:
    target = tmp_path / "packed.mcap"
    log_command("convert", REFERENCE, target, "--compression", "zstd")

    assert log_facts("diff", REFERENCE, target)["same"]
    with target.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert {chunk.compression for chunk in summary.chunk_indexes} == {"zstd"}


def test_a_log_becomes_what_foxglove_reads(tmp_path: Path) -> None:
    target = tmp_path / "drive.foxglove.mcap"
    written = log_facts("convert", REFERENCE, target)

    assert "/pose" in written[str(target)]
    with target.open("rb") as file:
        channels = {channel.topic for _, channel, _ in make_reader(file).iter_messages()}
    assert "/pose" in channels


def test_a_log_becomes_a_bag_and_that_a_log(tmp_path: Path) -> None:
    log_command("convert", REFERENCE, tmp_path / "bag")
    with AnyReader([tmp_path / "bag"]) as reader:
        assert "/pose" in reader.topics

    log_command("convert", tmp_path / "bag", tmp_path / "again.mcap")

    frames = open_log(REFERENCE).frame(topics.STEREO).num_rows
    assert open_log(tmp_path / "again.mcap").frame(topics.STEREO).num_rows == frames


def test_bags_are_told_from_logs(bag: Path) -> None:
    (file,) = bag.glob("*.mcap")

    assert is_bag(bag)
    assert is_bag(file)
    assert not is_bag(REFERENCE)
    assert not is_bag(REFERENCE.parent)


def test_a_bag_for_a_viewer_is_to_be_a_log_first(bag: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"into a log, whose name ends in \.mcap"):
        log_command("convert", bag, tmp_path / "drive.rrd")


def test_an_unknown_ending_names_those_that_there_are(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"as \.avi: .*\.foxglove\.mcap, \.mcap, \.rrd"):
        log_command("convert", REFERENCE, tmp_path / "drive.avi")


def test_settings_are_for_bags_alone(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="--set is for bags"):
        log_command("convert", REFERENCE, tmp_path / "a.mcap", "--set", "player.left_topic=/a")
