"""sensor_msgs/LaserScan as rays from the robot, and the odometry between them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from cogmap.data.bags.bag import Bag
from cogmap.data.bags.mount import Mount, mount_of
from cogmap.data.bags.odometry import Motions, read_odometry
from cogmap.data.bags.order import in_order
from cogmap.data.bags.topics import IMAGES, Topics, odometry_of, scans_of
from cogmap.geometry.arrays import Floats, Indices

SECTOR_RAD = math.radians(2.5)
"""The nearest hit in such an angle counts, as in a range scan of cameras."""

PERIOD_NS = 200_000_000
"""Scans that follow another sooner are left out: the town's robot has a view as often."""


@dataclass(frozen=True, eq=False)
class ScanRecording:
    """Scans in order of time, at (n,) `stamps_ns`: `rays` are float64 (k, 2) each, bearing_rad and
    range_m as in RangeScan. `notes` are sentences on what is not played.
    """

    stamps_ns: Indices
    rays: list[Floats]
    motions: Motions
    notes: list[str]


def read_scans(bag: Bag, given: Topics) -> ScanRecording:
    """Return the scans of a bag from the time of its odometry. Raises UsageError if there are none,
    or no odometry, or several topics of either; or if stamps are of two clocks.
    """
    topic = scans_of(bag, given.scan)
    wheels = odometry_of(bag, given.odometry)
    odometry, notes = read_odometry(bag, wheels) if wheels else (None, [])
    if odometry is None:
        raise bag.wrong("has laser scans, and no odometry", "record nav_msgs/Odometry, too")

    every = list(bag.messages(topic))
    stamps_ns = np.array([place.stamp_ns for place, _ in every], np.int64)
    order, notes_of_order = in_order(stamps_ns, f"{bag.path}: {topic}")
    begin_ns, end_ns = odometry.stamps_ns[[0, -1]].tolist()
    mount = mount_of(bag, bag.first(topic).header.frame_id)

    chosen = []
    next_ns = begin_ns
    for index in order.tolist():
        if next_ns <= stamps_ns[index] <= end_ns:
            chosen.append(index)
            next_ns = int(stamps_ns[index]) + PERIOD_NS
    if not chosen:
        raise bag.wrong("has no scan from the time of its odometry", "stamp both by one clock")

    motions = odometry.motions(stamps_ns[chosen])
    notes += [*notes_of_order, *motions.notes]
    if len(order) > len(chosen):
        words = f"that follow another within {PERIOD_NS / 1e9:g} s, or are without odometry"
        notes.append(f"{len(order) - len(chosen)} scans {words}, are left out")
    images = bag.of_kind(*IMAGES)
    if images:
        notes.append(f"the images on {', '.join(images)} are no pair, and are left out")
    return ScanRecording(
        stamps_ns=stamps_ns[chosen],
        rays=[rays_of(every[index][1], mount) for index in chosen],
        motions=motions,
        notes=notes,
    )


def rays_of(scan: Any, mount: Mount) -> Floats:
    """Return the rays of a scan as the robot sees them, one a sector in which something is known:
    float64 (k, 2), bearing_rad and range_m, 0 where nothing was met.
    """
    range_m = np.asarray(scan.ranges, np.float64)
    angle_rad = scan.angle_min + scan.angle_increment * np.arange(len(range_m))
    is_hit = (range_m >= scan.range_min) & (range_m <= scan.range_max)
    is_clear = range_m > scan.range_max

    known = is_hit | is_clear
    length_m = np.where(is_hit, range_m, scan.range_max)[known]
    along = np.column_stack([np.cos(angle_rad), np.sin(angle_rad), np.zeros(len(range_m))])[known]
    ends_m = mount.placed(length_m[:, None] * along)
    bearing_rad = np.arctan2(ends_m[:, 1], ends_m[:, 0])
    met_m = np.where(is_hit[known], np.hypot(ends_m[:, 0], ends_m[:, 1]), np.inf)

    sector = np.floor(bearing_rad / SECTOR_RAD).astype(np.int64)
    sectors, of_sector = np.unique(sector, return_inverse=True)
    nearest_m = np.full(len(sectors), np.inf)
    np.minimum.at(nearest_m, of_sector, met_m)
    nearest_m[np.isinf(nearest_m)] = 0.0
    return np.column_stack([(sectors + 0.5) * SECTOR_RAD, nearest_m])
