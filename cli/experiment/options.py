"""Options that the experiments share."""

from __future__ import annotations

import os
from pathlib import Path

import click

from cogmap.errors import UsageError


def _writable(context: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """Better now than after minutes."""
    if path is not None and not path.parent.is_dir():
        raise UsageError(f"--json {path}: there is no folder {path.parent}: make it first")
    return path


seed_option = click.option(
    "--seed",
    type=click.IntRange(0, 2**32),
    default=1,
    show_default=True,
    help="Which noise; the same, the same bytes.",
)
processes_option = click.option(
    "--processes",
    type=click.IntRange(1, 256),
    default=os.cpu_count() or 1,
    help="How many at once; the figures do not depend on it.  [default: one a core]",
)
out_option = click.option(
    "--out", type=click.Path(path_type=Path), help="A folder for its files.  [default: runs/NAME]"
)
json_option = click.option(
    "--json",
    "json_path",
    type=click.Path(dir_okay=False, path_type=Path),
    callback=_writable,
    metavar="FILE",
    help="Write the figures there too, as one flat object.",
)
live_option = click.option(
    "--live",
    "goes_live",
    is_flag=True,
    help="Run one more through real processes and compare bytes; code 1 where they differ.",
)
cameras_option = click.option(
    "--cameras",
    is_flag=True,
    help="Run one more with cameras: what is told otherwise is drawn and recognised.",
)
