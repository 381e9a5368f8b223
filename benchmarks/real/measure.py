"""The metrics of senses that nobody simulated, on recordings of a user's own."""

from __future__ import annotations

from pathlib import Path

import click

from benchmarks.benchmark import Setting, path_option
from benchmarks.real import stereo
from benchmarks.report import Metrics

OPTIONS = (
    path_option(
        "--stereo",
        "stereo_folder",
        metavar="DIR",
        text="A stereo drive with true poses: the folder of a KITTI odometry sequence.",
    ),
)


def measure(setting: Setting, *, stereo_folder: Path | None = None) -> Metrics:
    """Measure self-motion by views alone, on a drive that a real camera recorded.

    drift_share is the distance of the last measured position from the true one, over the length of
    the path; drift_over_pnp compares it with OpenCV's stereo matching, optical flow and PnP on the
    same images.
    """
    if stereo_folder is None:
        raise click.UsageError("name what to measure on: --stereo DIR")
    return stereo.measure(stereo_folder)
