"""The stereo pairs of bags of ROS, right and wrong."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cogmap.data.bags.bag import Bag
from cogmap.data.bags.pairs import PairRecording, read_pairs
from cogmap.data.bags.topics import Topics
from cogmap.errors import UsageError
from tests.support import bags
from tests.support.bags import LEFT, RIGHT, SECOND_NS, BagMaker, cameras, frame_ns, frames, wheels

ANY = Topics()


def _read(path: Path, *parts: Callable[[BagMaker], None], ros: int = 2) -> PairRecording:
    with BagMaker(path, ros) as maker:
        for part in parts:
            part(maker)
    return read_pairs(Bag(path), ANY)


@pytest.mark.parametrize(("name", "ros"), [("drive.bag", 1), ("drive", 2)])
def test_pairs_come_with_their_stamps_and_the_calibration(
    tmp_path: Path, name: str, ros: int
) -> None:
    recording = _read(tmp_path / name, cameras, frames, ros=ros)

    assert recording.stamps_ns.tolist() == [frame_ns(number) for number in range(4)]
    for number in range(4):
        left, right = recording.pair(number)
        assert np.array_equal(left, bags.pair(number)[0])
        assert np.array_equal(right, bags.pair(number)[1])
    calibration = recording.calibration
    assert (calibration.width_px, calibration.height_px) == (bags.WIDTH, bags.HEIGHT)
    assert calibration.fx_px == bags.FOCAL_PX
    assert calibration.baseline_m == pytest.approx(bags.BASELINE_M)
    assert recording.motions is None
    assert recording.notes == []


def test_a_file_of_mcap_is_read_without_its_folder(tmp_path: Path) -> None:
    _read(tmp_path / "drive", cameras, frames)

    assert len(read_pairs(Bag(tmp_path / "drive" / "drive.mcap"), ANY)) == 4


def test_a_bag_of_sqlite_is_read(tmp_path: Path) -> None:
    with BagMaker(tmp_path / "drive", plugin="SQLITE3") as maker:
        cameras(maker)
        frames(maker)

    assert len(read_pairs(Bag(tmp_path / "drive"), ANY)) == 4


def test_compressed_images_are_decoded(tmp_path: Path) -> None:
    def packed(maker: BagMaker) -> None:
        for number in range(2):
            for topic, image in zip((LEFT, RIGHT), bags.pair(number), strict=True):
                maker.compressed(f"{topic}/compressed", frame_ns(number), bags.png(image))

    recording = _read(tmp_path / "drive", cameras, packed)

    assert np.array_equal(recording.pair(1)[0], bags.pair(1)[0])


def test_images_of_which_the_order_is_wrong_are_put_in_order_and_counted(tmp_path: Path) -> None:
    def late(maker: BagMaker) -> None:
        for log, number in enumerate((0, 2, 1, 3, 3)):
            for topic, image in zip((LEFT, RIGHT), bags.pair(number), strict=True):
                maker.image(topic, frame_ns(number), image, log_ns=bags.BEGIN_NS + log)

    recording = _read(tmp_path / "drive", cameras, late)

    assert recording.stamps_ns.tolist() == [frame_ns(number) for number in range(4)]
    assert np.array_equal(recording.pair(1)[0], bags.pair(1)[0])
    assert [note.partition(": ")[2] for note in recording.notes] == [
        f"{topic}: {words}"
        for topic in (LEFT, RIGHT)
        for words in (
            "1 stamps went back, and were put in order",
            "1 messages with the stamp of another are left out",
        )
    ]


def test_a_clock_that_was_set_back_is_said(tmp_path: Path) -> None:
    def again(maker: BagMaker) -> None:
        frames(maker, range(10))
        maker.image(LEFT, frame_ns(1), bags.pair(1)[0], log_ns=frame_ns(11))

    with pytest.raises(UsageError, match=r"message 10 goes back by 1\.6 s: give a bag of one dri"):
        _read(tmp_path / "drive", cameras, again)


def test_a_left_image_without_a_right_one_is_an_error_of_that_pair(tmp_path: Path) -> None:
    def lonely(maker: BagMaker) -> None:
        frames(maker, (0, 1))
        maker.image(LEFT, frame_ns(2), bags.pair(2)[0])
        maker.image(RIGHT, frame_ns(2) + SECOND_NS // 50, bags.pair(2)[1])

    recording = _read(tmp_path / "drive", cameras, lonely)

    assert len(recording) == 3
    with pytest.raises(UsageError, match="image 2 has no right one within 5 ms"):
        recording.pair(2)


def test_an_image_that_cannot_be_decoded_or_is_of_another_size_is_an_error_of_that_pair(
    tmp_path: Path,
) -> None:
    def broken(maker: BagMaker) -> None:
        frames(maker, (0,))
        maker.image(LEFT, frame_ns(1), np.zeros((24, 32), np.uint8))
        maker.image(RIGHT, frame_ns(1), np.zeros((48, 64), np.uint8))
        maker.image(LEFT, frame_ns(2), bags.pair(2)[0][:, :32], encoding="rgb8")
        maker.image(RIGHT, frame_ns(2), bags.pair(2)[1])

    recording = _read(tmp_path / "drive", cameras, broken)

    with pytest.raises(UsageError, match="is 32 x 24, its CameraInfo says 64 x 48"):
        recording.pair(1)
    with pytest.raises(UsageError, match=r"image 2 of .*left.* cannot be decoded: 1536 bytes for"):
        recording.pair(2)


def _one_camera(maker: BagMaker) -> None:
    maker.camera("/stereo/left/camera_info")
    maker.image(LEFT, frame_ns(0), bags.pair(0)[0])


def _unknown_encoding(maker: BagMaker) -> None:
    cameras(maker)
    for topic in (LEFT, RIGHT):
        maker.image(topic, frame_ns(0), bags.WALL, encoding="yuv422")


def _of_other_images(maker: BagMaker) -> None:
    maker.camera("/stereo/left/camera_info", size=(480, 640))
    maker.camera("/stereo/right/camera_info", bags.BASELINE_M, size=(480, 640))
    frames(maker)


def _swapped(maker: BagMaker) -> None:
    maker.camera("/stereo/left/camera_info")
    maker.camera("/stereo/right/camera_info", -bags.BASELINE_M)
    frames(maker)


def _fisheye(maker: BagMaker) -> None:
    for side, baseline_m in (("left", 0.0), ("right", bags.BASELINE_M)):
        topic = f"/stereo/{side}/camera_info"
        maker.camera(topic, baseline_m, distortion=(0.1,) * 4, model="equidistant")
    frames(maker)


def _at_other_times(maker: BagMaker) -> None:
    cameras(maker)
    maker.image(LEFT, frame_ns(0), bags.pair(0)[0])
    maker.image(RIGHT, frame_ns(1), bags.pair(1)[1])


def _odometry_of_another_day(maker: BagMaker) -> None:
    cameras(maker)
    frames(maker)
    maker.odometry(bags.BEGIN_NS + 86_400 * SECOND_NS, 0.0)
    maker.odometry(bags.BEGIN_NS + 86_401 * SECOND_NS, 1.0)


def _two_wheels(maker: BagMaker) -> None:
    cameras(maker)
    frames(maker)
    wheels(maker)
    maker.odometry(bags.BEGIN_NS, 0.0, topic="/filtered")


def _two_pairs(maker: BagMaker) -> None:
    cameras(maker)
    frames(maker)
    for side in ("left", "right"):
        maker.image(f"/stereo/{side}/image_rect", frame_ns(0), bags.WALL)


@pytest.mark.parametrize(
    ("part", "words"),
    [
        (_one_camera, r"no pair of topics of images.* it has /stereo/left/camera_info \(sensor_ms"),
        (frames, "has no /stereo/left/camera_info"),
        (cameras, "no pair of topics of images, left and right.*--set player.left_topic=TOPIC"),
        (_unknown_encoding, "has the encoding 'yuv422': give it as one of mono8"),
        (_of_other_images, "is 64 x 48, its CameraInfo says 640 x 480"),
        (_swapped, r"P\[3\] is 27\.5, by which it does not stand to the right"),
        (_fisheye, "the distortion model 'equidistant' is none of plumb_bob"),
        (_at_other_times, "no left and right image whose stamps are within 5 ms"),
        (_odometry_of_another_day, "has no image from the time of its odometry"),
        (_two_wheels, "several topics of nav_msgs/msg/Odometry, /filtered, /odom.*_topic=TOPIC"),
        (_two_pairs, "has several pairs of images, .*image_raw .* or .*image_rect"),
    ],
)
def test_what_is_wrong_with_a_bag_is_one_sentence(
    tmp_path: Path, part: Callable[[BagMaker], None], words: str
) -> None:
    with pytest.raises(UsageError, match=words) as raised:
        _read(tmp_path / "drive", part)

    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("topics", "words"),
    [
        (Topics(left="/left"), "has no topic /left of type sensor_msgs/msg/Image or"),
        (Topics(left=LEFT, right="/odom"), "has no topic /odom of type sensor_msgs/msg/Image"),
        (Topics(odometry="/wheels"), "has no topic /wheels of type nav_msgs/msg/Odometry"),
    ],
)
def test_topics_that_are_named_and_missing_are_said_with_those_that_there_are(
    tmp_path: Path, topics: Topics, words: str
) -> None:
    _read(tmp_path / "drive", cameras, frames, wheels)

    with pytest.raises(UsageError, match=rf"{words}.*it has /odom \(nav_msgs/msg/Odometry\)"):
        read_pairs(Bag(tmp_path / "drive"), topics)


@pytest.mark.parametrize(("name", "ros"), [("drive.bag", 1), ("drive", 2)])
def test_a_bag_that_was_cut_off_is_said(tmp_path: Path, name: str, ros: int) -> None:
    path = tmp_path / name
    _read(path, cameras, frames, ros=ros)
    file = path if ros == 1 else path / f"{name}.mcap"
    content = file.read_bytes()
    file.write_bytes(content[: len(content) * 2 // 3])

    with pytest.raises(UsageError, match="is no whole bag"):
        read_pairs(Bag(path), ANY)


def test_a_bag_whose_middle_is_damaged_is_said(tmp_path: Path) -> None:
    _read(tmp_path / "drive", cameras, frames)
    file = tmp_path / "drive" / "drive.mcap"
    content = bytearray(file.read_bytes())
    content[3000:9000] = b"\xff" * 6000
    file.write_bytes(content)

    with pytest.raises(UsageError, match="is no whole bag"):
        read_pairs(Bag(tmp_path / "drive"), ANY)


def test_a_folder_or_file_that_is_no_bag_is_said(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("no bag")

    for path in (tmp_path, tmp_path / "notes.txt", tmp_path / "nothing.bag"):
        with pytest.raises(UsageError, match="give a bag of ROS 1, the folder"):
            read_pairs(Bag(path), ANY)


def test_without_the_library_the_remedy_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)

    with pytest.raises(UsageError, match=r"cogmap\[bags\]"):
        read_pairs(Bag(tmp_path), ANY)
