"""Bags of ROS as stereo frames, with odometry if it was recorded."""

from __future__ import annotations

from pathlib import Path

from cogmap.data.bags.recording import read_bag
from cogmap.data.bags.topics import Topics
from cogmap.services.player.config import Config
from cogmap.services.player.stereo import StereoFrames


def opened(path: Path, config: Config) -> StereoFrames:
    """Open a bag. Raises UsageError if it cannot be played."""
    topics = Topics(config.left_topic, config.right_topic, config.odometry_topic)
    recorded = read_bag(path, topics, config.mount_height_m)
    return StereoFrames(recorded, recorded.motions, recorded.notes)
