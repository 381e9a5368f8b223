"""Bags of ROS: stereo frames, or the scans of a laser where there is no pair of cameras."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from cogmap.data.bags.bag import Bag
from cogmap.data.bags.odometry import Motions
from cogmap.data.bags.order import NS_PER_S
from cogmap.data.bags.pairs import read_pairs
from cogmap.data.bags.scans import ScanRecording, read_scans
from cogmap.data.bags.topics import LASER_SCAN, Topics, has_pair
from cogmap.geometry.arrays import Floats
from cogmap.services.player.config import Config
from cogmap.services.player.landmark_logs.views import LandmarkLog
from cogmap.services.player.landmark_logs.wheels import Wheels
from cogmap.services.player.stereo import StereoFrames


def opened(path: Path, config: Config) -> StereoFrames | LandmarkLog:
    """Open a bag. Raises UsageError if it cannot be played."""
    bag = Bag(path)
    topics = Topics(
        left=config.left_topic,
        right=config.right_topic,
        odometry=config.odometry_topic,
        scan=config.scan_topic,
    )
    if bag.of_kind(LASER_SCAN) and not has_pair(bag, topics):
        return _scans(read_scans(bag, topics))

    pairs = read_pairs(bag, topics, config.mount_height_m)
    return StereoFrames(pairs, pairs.motions, pairs.notes)


def _scans(recorded: ScanRecording) -> LandmarkLog:
    """Return scans as views in which nothing is recognized."""
    stamps_ns = recorded.stamps_ns
    stamps_s = (stamps_ns - stamps_ns[0]) / NS_PER_S
    wheels = _wheels(recorded.motions, int(stamps_ns[0]))
    bounds_s = [0.0, *stamps_s.tolist()]
    return LandmarkLog(
        stamps_s=stamps_s,
        percepts=[[] for _ in stamps_s],
        motions=[wheels.rows(since, until) for since, until in pairwise(bounds_s)],
        true_poses=[None] * len(stamps_s),
        surveyed={},
        settings={},
        notes=recorded.notes,
        rays=recorded.rays,
    )


def _wheels(motions: Motions, first_ns: int) -> Wheels:
    """Return motions as speeds, each from its stamp until the next, since the first view."""
    ends_s = (motions.stamps_ns - first_ns) / NS_PER_S
    begin_s = ends_s[0] - motions.rows[0, 2]
    starts_s: Floats = np.append(begin_s, ends_s)
    speeds = np.vstack([motions.rows[:, :2], np.zeros((1, 2))])
    return Wheels(np.column_stack([starts_s, speeds]))
