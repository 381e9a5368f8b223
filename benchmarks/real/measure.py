"""The metrics on recordings of real cameras, of a user's own or published."""

from __future__ import annotations

from pathlib import Path

import click

from benchmarks.benchmark import Setting, path_option
from benchmarks.real import places, stereo
from benchmarks.report import Metrics

OPTIONS = (
    path_option(
        "--stereo",
        "stereo_folder",
        metavar="DIR",
        text="A stereo drive with true poses: the folder of a KITTI odometry sequence.",
    ),
    path_option(
        "--places",
        "walks",
        nargs=2,
        metavar="REF QUERY",
        text="Measure how well places are recognized: two folders of pictures of one route, "
        "numbered alike, as the corridor's of Milford (2013).",
    ),
)


def measure(
    setting: Setting,
    *,
    stereo_folder: Path | None = None,
    walks: tuple[Path, Path] | None = None,
) -> Metrics:
    """Measure what the modules make of recordings of real cameras.

    drift_share is the distance of the last measured position from the true one, over the length of
    the path; drift_over_pnp compares it with OpenCV's stereo matching, optical flow and PnP on the
    same images.
    """
    del setting
    metrics: Metrics = {}
    if stereo_folder is not None:
        metrics |= stereo.measure(stereo_folder)
    if walks:
        metrics |= places.measure(*walks)
    if not metrics:
        raise click.UsageError("name what to measure on: --stereo DIR, or --places REF QUERY")

    return metrics
