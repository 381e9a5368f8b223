"""The one table of formats: what recordings there are, and what opens each.

What opens a recording is imported when one is opened.
"""

from __future__ import annotations

from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, NamedTuple

from cogmap.errors import UsageError
from cogmap.hints import did_you_mean

if TYPE_CHECKING:
    from cogmap.services.player.config import Config
    from cogmap.services.player.recording import Recording


class Format(NamedTuple):
    """What the path of a recording is, in words, and the import string of the function that opens
    it: that takes the path and the configuration, and raises UsageError if it cannot be played.
    """

    path: str
    opener: str


FORMATS = {
    "bag": Format(
        "bag of ROS 1 or 2, or MCAP file of ROS 2: cameras or laser, odometry",
        "cogmap.services.player.bags:opened",
    ),
    "kitti": Format(
        "folder of a KITTI odometry sequence: calib.txt, image_0 and image_1",
        "cogmap.services.player.stereo:kitti",
    ),
    "euroc": Format(
        "folder of a EuRoC sequence, with mav0 in it",
        "cogmap.services.player.stereo:euroc",
    ),
    "images": Format(
        "folder with left and right, and camera.toml, its calibration",
        "cogmap.services.player.stereo:images",
    ),
    "log": Format(
        "log of ours, log.mcap: what its robot sensed is sensed again",
        "cogmap.services.player.own_logs:opened",
    ),
    "mrclam": Format(
        "folder of an MRCLAM set: Robot1_Odometry.dat and the others",
        "cogmap.services.player.landmark_logs.mrclam:opened",
    ),
    "ranges": Format(
        "folder of a robot among beacons: odometry.csv, ranges.csv",
        "cogmap.services.player.landmark_logs.ranges:opened",
    ),
    "trees": Format(
        "folder of a car among trees: odometry.csv, trees.csv, gps.csv",
        "cogmap.services.player.landmark_logs.trees:opened",
    ),
}


class Named(NamedTuple):
    """The name of a format, and the path of a recording."""

    format: str
    path: Path

    @property
    def title(self) -> str:
        """Return the name by which people know it: its folder may be anywhere."""
        return f"{self.format}:{self.path.resolve().name}"


def named(given: str) -> Named:
    """Read FORMAT:PATH. Raises UsageError if it is something else, or there is no such format."""
    name, colon, path = given.partition(":")
    known = ", ".join(FORMATS)
    if not (colon and path):
        raise UsageError(
            f"{given!r} names no recording: write it as FORMAT:PATH, where FORMAT is one of {known}"
        )
    if name not in FORMATS:
        hint = did_you_mean(name, FORMATS, f"there are {known}")
        raise UsageError(f"no recording has the format {name!r}: {hint}")
    return Named(name, Path(path))


def opened(config: Config) -> Recording:
    """Open the recording that is configured. Raises UsageError if it cannot be played."""
    name, path = named(config.recording)
    recording: Recording = resolve_name(FORMATS[name].opener)(path, config)
    return recording
