"""Which topics of a bag are the cameras of a pair."""

from __future__ import annotations

from pathlib import Path

import pytest

from cogmap.data.bags.bag import Bag
from cogmap.data.bags.topics import Topics, pair_of_topics
from tests.support import bags
from tests.support.bags import LEFT, RIGHT, BagMaker, cameras, frames, wheels


def _chosen(path: Path, given: Topics) -> tuple[str, str]:
    return pair_of_topics(Bag(path), given)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A bag with raw and rectified images, and odometry."""
    with BagMaker(tmp_path / "bag") as maker:
        cameras(maker)
        frames(maker, range(1))
        wheels(maker)
        for side in ("left", "right"):
            maker.image(f"/stereo/{side}/image_rect", bags.frame_ns(0), bags.WALL)
    return tmp_path / "bag"


def test_one_side_that_is_named_tells_the_other(path: Path) -> None:
    raw = (LEFT, RIGHT)

    assert _chosen(path, Topics(left=LEFT)) == raw
    assert _chosen(path, Topics(right=RIGHT)) == raw


def test_images_that_are_there_compressed_as_well_are_taken_as_they_are(tmp_path: Path) -> None:
    compressed = (f"{LEFT}/compressed", f"{RIGHT}/compressed")
    with BagMaker(tmp_path / "bag") as maker:
        cameras(maker)
        frames(maker, range(1))
        for name in compressed:
            maker.compressed(name, bags.frame_ns(0), bags.png(bags.WALL))

    assert _chosen(tmp_path / "bag", Topics()) == (LEFT, RIGHT)
    assert _chosen(tmp_path / "bag", Topics(left=compressed[0])) == compressed


def test_two_topics_that_are_named_are_taken(path: Path) -> None:
    rectified = ("/stereo/left/image_rect", "/stereo/right/image_rect")

    assert _chosen(path, Topics(*rectified)) == rectified


def test_cameras_without_sides_in_their_names_are_told_by_the_baseline(tmp_path: Path) -> None:
    with BagMaker(tmp_path / "bag") as maker:
        maker.camera("/infra1/camera_info")
        maker.camera("/infra2/camera_info", bags.BASELINE_M)
        for name in ("/infra1/image_raw", "/infra2/image_raw"):
            maker.image(name, bags.frame_ns(0), bags.WALL)

    topics = _chosen(tmp_path / "bag", Topics())

    assert topics == ("/infra1/image_raw", "/infra2/image_raw")
