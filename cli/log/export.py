"""`cogmap log export`: a log in the formats of other tools."""

from __future__ import annotations

from pathlib import Path

import click

from cogmap.cli.log import report
from cogmap.cli.options import json_option
from cogmap.cli.printing import print_json
from cogmap.cli.progress import bar
from cogmap.cli.topic.argument import topics_argument
from cogmap.errors import UsageError
from cogmap.recording import selection
from cogmap.recording.exporting.foxglove import write_foxglove
from cogmap.recording.exporting.rerun import write_rerun
from cogmap.recording.exporting.rosbag2 import write_rosbag2
from cogmap.recording.exporting.tables import TableFormat, write_tables
from cogmap.recording.log import open_log

_EPILOG = """\b
Examples:
  cogmap log export runs/latest --csv tables               every topic but images
  cogmap log export drive.mcap --parquet tables odometry truth/pose
  cogmap log export runs/latest --foxglove drive.foxglove.mcap
  cogmap log export runs/latest --rerun drive.rrd    then `rerun drive.rrd`
  cogmap log export runs/latest --rosbag2 bag    then `ros2 bag play bag`
"""


@click.command(epilog=_EPILOG)
@click.argument("log", type=click.Path(path_type=Path))
@topics_argument
@click.option(
    "--csv",
    "csv_folder",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Write a table of comma-separated values for each topic into the new folder DIR. Lists "
    "are JSON; images are left out.",
)
@click.option(
    "--parquet",
    "parquet_folder",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Write a Parquet file for each topic into the new folder DIR, images and all.",
)
@click.option(
    "--foxglove",
    "foxglove_path",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write images, depth, poses, path, map, range scans and needs for Foxglove into the new "
    "file FILE; TOPICS are of no matter.",
)
@click.option(
    "--rerun",
    "rerun_path",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write images, depth, poses, path, map, range scans and needs for Rerun into the new file "
    "FILE; TOPICS are of no matter.",
)
@click.option(
    "--rosbag2",
    "bag_folder",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Write images, depth, odometry, poses, path and map as a bag of ROS 2 into the new folder "
    "DIR; TOPICS are of no matter.",
)
@json_option
def export(
    log: Path,
    topics: tuple[str, ...],
    csv_folder: Path | None,
    parquet_folder: Path | None,
    foxglove_path: Path | None,
    rerun_path: Path | None,
    bag_folder: Path | None,
    as_json: bool,
) -> None:
    """Write the drive in LOG, or the messages of TOPICS in it, as other tools read it.

    In a table a row is a message, a column a field, as `cogmap.open_log(LOG).frame(TOPIC)` gives
    them. Prints how many messages were written of each topic.
    """
    folders = {TableFormat.CSV: csv_folder, TableFormat.PARQUET: parquet_folder}
    tables = [(kind, folder) for kind, folder in folders.items() if folder is not None]
    for_viewers = {
        write_foxglove: foxglove_path,
        write_rerun: rerun_path,
        write_rosbag2: bag_folder,
    }
    drives = [(write, path) for write, path in for_viewers.items() if path is not None]
    if not tables and not drives:
        raise UsageError("name a format and where to write it, such as --csv DIR")

    written: dict[str, dict[str, int]] = {}
    with open_log(log) as opened:
        chosen = selection.named(topics or opened.topics)
        for kind, folder in tables:
            with bar(f"writing {folder}") as progress:
                written[str(folder)] = write_tables(opened, folder, kind, chosen, progress)
        for write, path in drives:
            with bar(f"writing {path}") as progress:
                written[str(path)] = write(opened, path, progress)

    if as_json:
        print_json(written)
    else:
        report.print_exported(written)
