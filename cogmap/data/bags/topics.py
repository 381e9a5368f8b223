"""Which topics of a bag are the cameras of a pair, odometry, and laser scans."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import Any, NamedTuple, Protocol

from cogmap.data.bags.cameras import camera_of
from cogmap.errors import UsageError

IMAGE = "sensor_msgs/msg/Image"
COMPRESSED_IMAGE = "sensor_msgs/msg/CompressedImage"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
ODOMETRY = "nav_msgs/msg/Odometry"
LASER_SCAN = "sensor_msgs/msg/LaserScan"
IMAGES = (IMAGE, COMPRESSED_IMAGE)


class Source(Protocol):
    """What has topics: a bag, or a robot."""

    @property
    def topics(self) -> Mapping[str, str]:
        """Return the types of messages, such as `nav_msgs/msg/Odometry`, by topic."""

    def of_kind(self, *kinds: str) -> list[str]:
        """Return the topics of these types, in order of their names."""

    def first(self, topic: str) -> Any:
        """Return the first message of a topic. Raises UsageError if there is none."""

    def wrong(self, what: str, remedy: str) -> UsageError:
        """Make the error for a source of which something is not as it must be."""

    def setting(self, name: str) -> str:
        """Return how a user gives one of Topics, such as `left`."""


def set_pair(source: Source) -> str:
    """Return the remedy where the topics of a pair are not the right ones."""
    return f"name the images by {source.setting('left')} {source.setting('right')}"


class Topics(NamedTuple):
    """Topics of a stereo camera's images, of odometry and of laser scans; empty where they are to
    be found.
    """

    left: str = ""
    right: str = ""
    odometry: str = ""
    scan: str = ""


def pair_of_topics(source: Source, given: Topics) -> tuple[str, str]:
    """Return the topics of the left and the right camera.

    Those that are given are taken; a pair is found by left and right in the names, else by what the
    cameras say of where they stand. Raises UsageError if a topic is missing or of another type, if
    there is no pair, or if there are several.
    """
    for name in (given.left, given.right):
        _check(source, name, IMAGES, set_pair(source))
    pairs = _pairs(source, given)
    if not pairs:
        raise source.wrong("has no pair of topics of images, left and right", set_pair(source))
    if len(pairs) > 1:
        shown = " or ".join(f"{left} and {right}" for left, right in pairs)
        raise source.wrong(f"has several pairs of images, {shown}", set_pair(source))
    return pairs[0]


def has_pair(source: Source, given: Topics) -> bool:
    """Return whether there are topics of a left and a right camera, or some are given."""
    return bool(given.left or given.right or _pairs(source, given))


def odometry_of(source: Source, given: str, kind: str = ODOMETRY) -> str:
    """Return the topic of odometry, which has messages of type `kind`; empty if there is none.
    Raises UsageError if the one that is given is missing, or there are several.
    """
    return _only(source, given, kind, source.setting("odometry"))


def scans_of(source: Source, given: str) -> str:
    """Return the topic of laser scans, empty if there is none. Raises as `odometry_of` does."""
    return _only(source, given, LASER_SCAN, source.setting("scan"))


def camera_info(source: Source, images: str) -> str:
    """Return the topic that describes the camera of a topic of images. Raises UsageError if there
    is none.
    """
    found = _camera_info(source, images)
    if not found:
        beside = f"{images.rpartition('/')[0]}/camera_info"
        raise source.wrong(
            f"has no {beside} ({CAMERA_INFO}), the calibration for {images}",
            "record it, too, or give the pictures as a folder of images with camera.toml",
        )
    return found


def _camera_info(source: Source, images: str) -> str:
    """Return the CameraInfo beside a topic of images, or beside the one that it compresses; empty
    if there is none.
    """
    beside, _, _ = images.rpartition("/")
    above, _, _ = beside.rpartition("/")
    for folder in (beside, above):
        if source.topics.get(f"{folder}/camera_info") == CAMERA_INFO:
            return f"{folder}/camera_info"
    return ""


def _check(source: Source, name: str, kinds: tuple[str, ...], remedy: str) -> None:
    if name and source.topics.get(name) not in kinds:
        raise source.wrong(f"has no topic {name} of type {' or '.join(kinds)}", remedy)


def _only(source: Source, given: str, kind: str, setting: str) -> str:
    """Return the topic of a type, empty if there is none."""
    remedy = f"name one by {setting}"
    _check(source, given, (kind,), remedy)
    found = [given] if given else source.of_kind(kind)
    if len(found) > 1:
        raise source.wrong(f"has several topics of {kind}, {', '.join(found)}", remedy)
    return found[0] if found else ""


def _pairs(source: Source, given: Topics) -> list[tuple[str, str]]:
    """Return the pairs of topics that may be meant."""
    if given.left and given.right:
        return [(given.left, given.right)]

    images = source.of_kind(*IMAGES)
    if not (given.left or given.right):
        # What compresses another topic, as image_transport does, shows the same.
        images = [name for name in images if name.rpartition("/")[0] not in images]
    pairs = [(left, _other_side(left)) for left in images]
    pairs = [(left, right) for left, right in pairs if right != left and right in images]
    pairs = pairs or _pairs_by_baseline(source, images)
    return [
        (left, right)
        for left, right in pairs
        if given.left in {"", left} and given.right in {"", right}
    ]


def _other_side(left: str) -> str:
    """Return the name of a left camera's topic with `right` for each `left`."""
    return left.replace("left", "right").replace("Left", "Right")


def _pairs_by_baseline(source: Source, images: list[str]) -> list[tuple[str, str]]:
    """Return every two topics of which the second one's camera says that it stands to the right
    of one that says nothing of that kind.
    """
    shifted: dict[bool, list[str]] = {False: [], True: []}
    for name in images:
        described = _camera_info(source, name)
        if described:
            stands_right = camera_of(source.first(described)).baseline_m > 0
            shifted[stands_right].append(name)
    return list(product(shifted[False], shifted[True]))
