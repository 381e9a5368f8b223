"""`cogmap log convert`: a log or a bag in another format, which its name tells."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
from mcap.exceptions import McapError
from mcap.reader import make_reader

from cogmap.cli.log import report
from cogmap.cli.log.choosing import COMPRESSIONS, compression_option
from cogmap.cli.log.importing import import_senses, print_imported
from cogmap.cli.options import json_option
from cogmap.cli.printing import print_json
from cogmap.cli.progress import bar
from cogmap.errors import UsageError
from cogmap.recording import selection
from cogmap.recording.copying import Part, copy
from cogmap.recording.exporting.foxglove import write_foxglove
from cogmap.recording.exporting.rerun import write_rerun
from cogmap.recording.exporting.rosbag2 import write_rosbag2
from cogmap.recording.log import Log, open_log
from cogmap.recording.storage.reader import Progress
from cogmap.runtime.program import set_option

LOG = ".mcap"
VIEWED: dict[str, Callable[[Log, Path, Progress | None], dict[str, int]]] = {
    ".foxglove.mcap": write_foxglove,
    ".rrd": write_rerun,
    "": write_rosbag2,
}
"""What writes a drive for other tools, by how the name ends; a folder's name has no ending."""

ROS1 = ".bag"
ROS2 = "ros2"
METADATA = "metadata.yaml"
"""What tells a bag of ROS 1, an MCAP file of ROS 2, and the folder of a bag of ROS 2."""

_EPILOG = """\b
Examples:
  cogmap log convert drive.mcap packed.mcap --compression zstd
  cogmap log convert runs/latest drive.rrd              for Rerun
  cogmap log convert runs/latest drive.foxglove.mcap    for Foxglove
  cogmap log convert runs/latest bag                    a bag of ROS 2, in a folder
  cogmap log convert drive.bag drive.mcap               a log of a bag of ROS
"""


@click.command(epilog=_EPILOG)
@click.argument("source", metavar="IN", type=click.Path(path_type=Path))
@click.argument("target", metavar="OUT", type=click.Path(path_type=Path))
@compression_option
@set_option
@json_option
def convert(
    source: Path, target: Path, compression: str, settings: tuple[str, ...], as_json: bool
) -> None:
    """Write IN, a log or a bag of ROS, as the new OUT: what that is, its name's ending says.

    .mcap is a log, .rrd is for Rerun, .foxglove.mcap for Foxglove, and a name without an ending is
    the folder of a bag of ROS 2. --compression is that of a log; --set names the topics where a bag
    has several, as for `cogmap log import`. `cogmap log export` writes tables too.
    """
    ending = ending_of(target)
    if is_bag(source):
        if ending != LOG:
            raise UsageError(
                f"{source} is a bag: convert it into a log, whose name ends in {LOG}, and that "
                f"into {target}"
            )
        imported = import_senses(source, target, settings, COMPRESSIONS[compression])
        _tell(imported, as_json, lambda: print_imported(imported, target))
        return

    if settings:
        raise UsageError(f"--set is for bags, and {source} is none: leave it out")
    if ending == LOG:
        part = Part(topics=selection.to_record())
        chosen = COMPRESSIONS[compression]
        with bar(f"writing {target}") as progress:
            copied = copy([source], target, part, compression=chosen, progress=progress)
        _tell(copied, as_json, lambda: report.print_copied(copied))
        return

    with open_log(source) as log, bar(f"writing {target}") as progress:
        written = {str(target): VIEWED[ending](log, target, progress)}
    _tell(written, as_json, lambda: report.print_exported(written))


def _tell(facts: Any, as_json: bool, in_words: Callable[[], None]) -> None:
    """Print what was written, for programs or for people."""
    if as_json:
        print_json(facts)
    else:
        in_words()


def ending_of(target: Path) -> str:
    """Return which of the endings that are known a name has. Raises UsageError if it has none."""
    known = sorted([*filter(None, VIEWED), LOG], key=len, reverse=True)
    for ending in known:
        if target.name.endswith(ending):
            return ending
    if target.suffix:
        raise UsageError(
            f"{target}: nothing is written as {target.suffix}: let its name end in "
            f"{', '.join(known)}, or in nothing for a bag of ROS 2"
        )
    return ""


def is_bag(source: Path) -> bool:
    """Decide whether something is a bag of ROS, not a log of ours."""
    if source.is_dir():
        return (source / METADATA).exists()
    if source.suffix == ROS1 or not source.is_file():
        return source.suffix == ROS1
    with source.open("rb") as file:
        try:
            return make_reader(file).get_header().profile == ROS2
        except McapError:
            return False
