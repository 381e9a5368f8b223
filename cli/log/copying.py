"""`cogmap log filter` and `merge`: a part of a log as another, and several as one."""

from __future__ import annotations

from pathlib import Path

import click

from cogmap.cli.log import report
from cogmap.cli.log.choosing import (
    COMPRESSIONS,
    check_span,
    compression_option,
    exclude_option,
    regex_option,
    start_option,
    until_option,
)
from cogmap.cli.options import json_option
from cogmap.cli.printing import print_json
from cogmap.cli.progress import bar
from cogmap.cli.topic.argument import topics_argument
from cogmap.recording import selection
from cogmap.recording.copying import Part, copy

_FILTER_EPILOG = """\b
Examples:
  cogmap log filter runs/latest poses.mcap truth/pose odometry
  cogmap log filter drive.mcap small.mcap -x 'camera|view'
  cogmap log filter drive.mcap begin.mcap --until 30
  cogmap log filter drive.mcap packed.mcap --compression zstd    all of it
"""
_MERGE_EPILOG = """\b
Examples:
  cogmap log merge runs/latest/log.mcap runs/latest/log-2.mcap -o whole.mcap
  cogmap log merge drive*.mcap -o whole.mcap    a recording that was split
"""
_path = click.Path(path_type=Path)


@click.command("filter", epilog=_FILTER_EPILOG)
@click.argument("source", metavar="IN", type=_path)
@click.argument("target", metavar="OUT", type=_path)
@topics_argument
@regex_option
@exclude_option
@start_option
@until_option
@compression_option
@json_option
def filter_(
    source: Path,
    target: Path,
    topics: tuple[str, ...],
    regex: str,
    exclude: str,
    start_s: float,
    until_s: float | None,
    compression: str,
    as_json: bool,
) -> None:
    """Write the messages of IN, on TOPICS or on all, as the new log OUT.

    Their bytes, times and envelopes stay as they are. Without the beginning of workspace/delta no
    graph can be had of OUT, and without a module's inputs it cannot be replayed into that.
    """
    check_span(start_s, until_s)
    chosen = selection.to_record(topics, regex, exclude)
    part = Part(topics=chosen, start_s=start_s, end_s=until_s)
    with bar(f"writing {target.name}") as progress:
        copied = copy(
            [source], target, part, compression=COMPRESSIONS[compression], progress=progress
        )
    if as_json:
        print_json(copied)
    else:
        report.print_copied(copied)


@click.command(epilog=_MERGE_EPILOG)
@click.argument("sources", metavar="IN...", nargs=-1, required=True, type=_path)
@click.option(
    "-o", "--output", "target", required=True, metavar="OUT", type=_path, help="The new log."
)
@compression_option
@json_option
def merge(sources: tuple[Path, ...], target: Path, compression: str, as_json: bool) -> None:
    """Write the messages of several logs of one agent as the new log OUT, in order of their times.

    A message that several of them hold is there once. The configuration is that of the log that
    begins first.
    """
    part = Part(topics=selection.to_record())
    with bar(f"writing {target.name}") as progress:
        copied = copy(
            sources, target, part, compression=COMPRESSIONS[compression], progress=progress
        )
    if as_json:
        print_json(copied)
    else:
        report.print_copied(copied)
