"""`cogmap log export`: a log in the formats of other tools."""

from __future__ import annotations

from pathlib import Path

import click

from cogmap.cli.options import json_option
from cogmap.cli.printing import print_json
from cogmap.cli.progress import bar
from cogmap.errors import UsageError
from cogmap.recording import selection
from cogmap.recording.log import open_log
from cogmap.recording.tables import TableFormat, write_tables

_EPILOG = """\b
Examples:
  cogmap log export runs/latest --csv tables               every topic but images
  cogmap log export drive.mcap --parquet tables odometry truth/pose
"""


@click.command(epilog=_EPILOG)
@click.argument("log", type=click.Path(path_type=Path))
@click.argument("topics", nargs=-1)
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
@json_option
def export(
    log: Path,
    topics: tuple[str, ...],
    csv_folder: Path | None,
    parquet_folder: Path | None,
    as_json: bool,
) -> None:
    """Write the messages in LOG, of all topics or of TOPICS, as other tools read them.

    A row is a message, a column a field, as `cogmap.open_log(LOG).frame(TOPIC)` gives them. Prints
    how many rows each topic has.
    """
    folders = {TableFormat.CSV: csv_folder, TableFormat.PARQUET: parquet_folder}
    asked = [(kind, folder) for kind, folder in folders.items() if folder is not None]
    if not asked:
        raise UsageError("name a format and a folder, such as --csv DIR")

    rows = {}
    with open_log(log) as opened:
        chosen = selection.named(topics or opened.topics)
        for kind, folder in asked:
            with bar(f"writing {folder}") as progress:
                rows[kind.value] = write_tables(opened, folder, kind, chosen, progress)

    if as_json:
        print_json(rows)
        return
    for kind, folder in asked:
        click.echo(f"{folder}: {len(rows[kind.value])} topics")
        for name, count in rows[kind.value].items():
            click.echo(f"  {name}: {count}")
