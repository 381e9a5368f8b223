"""The stereo pairs of a bag, and its odometry, as a recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cogmap.data.bags.bag import Bag, Place
from cogmap.data.bags.cameras import Pair, camera_of, pair_of
from cogmap.data.bags.images import image_of
from cogmap.data.bags.mount import mount_of
from cogmap.data.bags.odometry import Motions, Poses, is_finite, poses_of
from cogmap.data.bags.order import in_order
from cogmap.data.bags.topics import SET_PAIR, Topics, camera_info, chosen
from cogmap.data.camera_pair import remapped
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Bytes, Indices
from cogmap.schemas.sensing import Calibration

SAME_VIEW_NS = 5_000_000
"""The stamps of a pair differ by so much at most: cameras are triggered together."""

TRIED = 20
"""A bag of which none of so many pairs can be read is not played."""


@dataclass(frozen=True, eq=False)
class BagRecording:
    """The pairs of a bag, in order of time; those without a right image are None in `right`.

    `motions` are None without odometry. `notes` are sentences on what is not played.
    """

    bag: Bag
    topics: Topics
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
        images = (
            self._image(self.topics.left, self.left[number], number),
            self._image(self.topics.right, right, number),
        )
        if self.camera.maps is None:
            return images
        return remapped(images[0], self.camera.maps[0]), remapped(images[1], self.camera.maps[1])

    def _image(self, topic: str, place: Place, number: int) -> Bytes:
        name = f"{self.bag.path}: image {number} of {topic}"
        image = image_of(self.bag.message(topic, place), name)
        size = (self.calibration.height_px, self.calibration.width_px)
        if image.shape[:2] != size:
            raise UsageError(
                f"{name} is {image.shape[1]} x {image.shape[0]}, its CameraInfo says {size[1]} x "
                f"{size[0]}: record the calibration of these images"
            )
        return image


def read_bag(path: Path, given: Topics, height_m: float = 0.0) -> BagRecording:
    """Return the pairs of a bag: of ROS 1, of ROS 2, or an MCAP file of ROS 2. What `given` leaves
    out is found; `height_m` is that of the cameras above the ground, 0 where the bag says it.

    Raises UsageError if it is damaged, has no pair of cameras that were calibrated together, or
    several; if the calibration is of images of another size, these have an unknown encoding, or
    stamps are of two clocks.
    """
    bag = Bag(path)
    topics = chosen(bag, given)
    left_info, right_info = (
        camera_of(bag.first(camera_info(bag, name))) for name in (topics.left, topics.right)
    )
    mount = mount_of(bag, left_info.frame, height_m)
    is_rectified = all("rect" in name for name in (topics.left, topics.right))
    camera = pair_of(left_info, right_info, is_rectified, mount, str(path))

    left, notes = _places(bag, topics.left)
    right, notes_of_right = _places(bag, topics.right)
    notes += notes_of_right
    motions = None
    if topics.odometry:
        odometry, notes_of_odometry = _odometry(bag, topics.odometry)
        notes += notes_of_odometry
        if odometry is not None:
            every = len(left)
            left = _within(left, odometry, bag)
            motions = odometry.motions(_stamps_ns(left))
            notes += _notes(every - len(left), motions)

    partners = _partners(left, right, bag)
    recording = BagRecording(bag, topics, camera, left, partners, motions, notes)
    _check(recording)
    return recording


def _places(bag: Bag, topic: str) -> tuple[list[Place], list[str]]:
    """Return where the images of a topic are, in order of time, and what is left out."""
    found = [place for place, _ in bag.messages(topic)]
    if not found:
        raise bag.wrong(f"has no message on {topic}", SET_PAIR)
    order, notes = in_order(_stamps_ns(found), f"{bag.path}: {topic}")
    return [found[index] for index in order.tolist()], notes


def _odometry(bag: Bag, topic: str) -> tuple[Poses | None, list[str]]:
    """Return the odometry on a topic, None if it is not two messages, and what is left out."""
    every = list(bag.messages(topic))
    found = [(place, message) for place, message in every if is_finite(message)]
    broken = len(every) - len(found)
    notes = [f"{topic}: {broken} messages without finite numbers are left out"] if broken else []

    stamps_ns = _stamps_ns([place for place, _ in found])
    order, notes_of_order = in_order(stamps_ns, f"{bag.path}: {topic}")
    notes += notes_of_order
    if len(order) < 2:
        return None, [*notes, f"{topic} has no two messages: the views tell the self-motion"]
    return poses_of([found[index][1] for index in order.tolist()], stamps_ns[order]), notes


def _notes(outside: int, motions: Motions) -> list[str]:
    """Say what the odometry leaves out, if it does."""
    notes = []
    if outside:
        notes.append(f"{outside} images from before or after the odometry are left out")
    if motions.jumps:
        notes.append(f"{motions.jumps} jumps of the odometry are left out: no wheels move so")
    return notes


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


def _check(recording: BagRecording) -> None:
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
