"""The stereo pairs of a bag, and its odometry, as a recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cogmap.data.bags.bag import Bag, Place
from cogmap.data.bags.cameras import RECTIFIED, Pair, camera_of, check_size, mounted, pair_of
from cogmap.data.bags.images import image_of
from cogmap.data.bags.mount import mount_of
from cogmap.data.bags.odometry import Motions, Poses, read_odometry
from cogmap.data.bags.order import in_order
from cogmap.data.bags.topics import (
    LASER_SCAN,
    Topics,
    camera_info,
    odometry_of,
    pair_of_topics,
    set_pair,
)
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Bytes, Indices
from cogmap.schemas.sensing import Calibration

SAME_VIEW_NS = 5_000_000
"""The stamps of a pair differ by so much at most: cameras are triggered together."""

TRIED = 20
"""A bag of which none of so many pairs can be read is not played."""


@dataclass(frozen=True, eq=False)
class PairRecording:
    """The pairs of a bag, in order of time; those without a right image are None in `right`.

    `motions` are None without odometry. `notes` are sentences on what is not played.
    """

    bag: Bag
    topics: tuple[str, str]
    camera: Pair
    left: Sequence[Place]
    right: Sequence[Place | None]
    motions: Motions | None
    notes: Sequence[str]
    true_poses: None = None

    @property
    def calibration(self) -> Calibration:
        """Return the calibration of the pairs."""
        return self.camera.calibration

    @property
    def stamps_ns(self) -> Indices:
        """Return the stamps of the left images, int64 (n,)."""
        return _stamps_ns(self.left)

    def __len__(self) -> int:
        """Return how many pairs it has."""
        return len(self.left)

    def pair(self, number: int) -> tuple[Bytes, Bytes]:
        """Return the left and the right image of a pair, each uint8 (h, w), or RGB (h, w, 3).

        Raises UsageError if one of them is missing, cannot be decoded, or is not of the
        calibration's size.
        """
        right = self.right[number]
        if right is None:
            raise UsageError(
                f"{self.bag.path}: left image {number} has no right one within "
                f"{SAME_VIEW_NS / 1e6:g} ms: record both cameras"
            )
        left = self._image(self.topics[0], self.left[number], number)
        return self.camera.undistorted(left, self._image(self.topics[1], right, number))

    def _image(self, topic: str, place: Place, number: int) -> Bytes:
        name = f"{self.bag.path}: image {number} of {topic}"
        image = image_of(self.bag.message(topic, place), name)
        check_size(image, self.calibration, name)
        return image


def read_pairs(bag: Bag, given: Topics, height_m: float = 0.0) -> PairRecording:
    """Return the pairs of a bag. Topics that `given` leaves out are found; `height_m` is that of
    the cameras above the ground, 0 where the bag says it.

    Raises UsageError if it is damaged, has no pair of cameras that were calibrated together, or
    several; if the calibration is of images of another size, these have an unknown encoding, or
    stamps are of two clocks.
    """
    topics = pair_of_topics(bag, given)
    camera = _camera(bag, topics, height_m)
    left, notes = _places(bag, topics[0])
    right, notes_of_right = _places(bag, topics[1])
    notes += notes_of_right
    for name in bag.of_kind(LASER_SCAN):
        notes.append(f"the scans on {name} are left out: depth gives range scans")

    wheels = odometry_of(bag, given.odometry)
    motions = None
    if wheels:
        odometry, notes_of_odometry = read_odometry(bag, wheels)
        notes += notes_of_odometry
        if odometry is not None:
            every = len(left)
            left = _within(left, odometry, bag)
            motions = odometry.motions(_stamps_ns(left))
            notes += motions.notes
            if every > len(left):
                outside = every - len(left)
                notes.append(f"{outside} images from before or after the odometry are left out")

    partners = _partners(left, right, bag)
    recording = PairRecording(bag, topics, camera, left, partners, motions, notes)
    _check(recording)
    return recording


def _camera(bag: Bag, topics: tuple[str, str], height_m: float) -> Pair:
    left, right = (camera_of(bag.first(camera_info(bag, name))) for name in topics)
    mount = mounted(mount_of(bag, left.frame), height_m)
    is_rectified = all(RECTIFIED in name for name in topics)
    return pair_of(left, right, is_rectified, mount, str(bag.path))


def _places(bag: Bag, topic: str) -> tuple[list[Place], list[str]]:
    """Return where the images of a topic are, in order of time, and what is left out."""
    found = [place for place, _ in bag.messages(topic)]
    if not found:
        raise bag.wrong(f"has no message on {topic}", set_pair(bag))
    order, notes = in_order(_stamps_ns(found), f"{bag.path}: {topic}")
    return [found[index] for index in order.tolist()], notes


def _within(left: list[Place], odometry: Poses, bag: Bag) -> list[Place]:
    """Return the images that odometry leads to. Raises UsageError if it leads to none."""
    begin_ns, end_ns = odometry.stamps_ns[[0, -1]].tolist()
    inside = [place for place in left if begin_ns < place.stamp_ns <= end_ns]
    if not inside:
        raise bag.wrong(
            "has no image from the time of its odometry",
            "stamp both by one clock, or leave the odometry out of the bag",
        )
    return inside


def _partners(left: list[Place], right: list[Place], bag: Bag) -> list[Place | None]:
    """Return the right image of each left one. Raises UsageError if none has one."""
    left_ns = _stamps_ns(left)
    right_ns = _stamps_ns(right)
    after = np.searchsorted(right_ns, left_ns).clip(max=len(right) - 1)
    before = (after - 1).clip(min=0)
    is_before = np.abs(right_ns[before] - left_ns) < np.abs(right_ns[after] - left_ns)
    nearest = np.where(is_before, before, after)
    is_same = np.abs(right_ns[nearest] - left_ns) <= SAME_VIEW_NS
    if not is_same.any():
        raise bag.wrong(
            f"has no left and right image whose stamps are within {SAME_VIEW_NS / 1e6:g} ms",
            "trigger both cameras together, and stamp them by one clock",
        )
    pairs = zip(nearest.tolist(), is_same.tolist(), strict=True)
    return [right[index] if same else None for index, same in pairs]


def _stamps_ns(places: Sequence[Place]) -> Indices:
    return np.array([place.stamp_ns for place in places], np.int64)


def _check(recording: PairRecording) -> None:
    """Raise the error of the first pair if none of the first TRIED can be read."""
    errors = []
    for number in range(min(TRIED, len(recording))):
        try:
            recording.pair(number)
        except UsageError as error:
            errors.append(error)
        else:
            return
    raise errors[0]
