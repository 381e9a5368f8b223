"""What an experiment leaves behind: its figure as PNG and PDF, and JSON of every metric printed."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.table import Table

from cogmap.cli.experiment.options import Common
from cogmap.cli.plots.palette import PAPER
from cogmap.errors import UsageError
from cogmap.services.codelets.rules import PRESETS, described, metrics_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Without the time of day in it, the same run gives the same bytes.
_UNDATED: dict[str, dict[str, Any]] = {"pdf": {"CreationDate": None}}
KINDS = ("png", "pdf")


def folder_for(name: str, out: Path | None) -> Path:
    """Make `out`, or the folder runs/`name`, if it is missing; one that was made, and those around
    it, are gone again when the command has ended without writing there. Raises UsageError if it
    cannot be made.
    """
    folder = out if out is not None else Path("runs") / name
    made = [path for path in (folder, *folder.parents) if not path.exists()]

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(
            f"cannot make the folder {folder} ({error.strerror}): name another with --out"
        ) from None

    click.get_current_context().call_on_close(lambda: _remove_empty(made))
    return folder


def _remove_empty(folders: Iterable[Path]) -> None:
    with suppress(OSError):  # one is not empty, and stays
        for folder in folders:
            folder.rmdir()


def show_rules(common: Common) -> dict[str, str]:
    """Print the agent's rules in a line, and return them as metrics."""
    rules = PRESETS[common.rules]
    click.echo(described(rules))
    return metrics_of(rules)


def command_line() -> str:
    """Return the command that this process was called with, to be run again."""
    return shlex.join(["cogmap", *sys.argv[1:]])


def save_figure(folder: Path, name: str, figure: Figure) -> list[Path]:
    """Write `name`.png and `name`.pdf, the same bytes for the same figure."""
    paths = []

    for kind in KINDS:
        file = BytesIO()
        figure.savefig(file, format=kind, facecolor=PAPER, metadata=_UNDATED.get(kind))
        path = folder / f"{name}.{kind}"
        path.write_bytes(file.getvalue())
        paths.append(path)

    return paths


def save(
    folder: Path, name: str, figure: Figure, metrics: Mapping[str, Any], common: Common
) -> None:
    """Write the figure and the metrics to `folder`, the metrics to --json too, and print where."""
    document = {**metrics, "seed": common.seed, "command": command_line()}
    text = json.dumps(document, indent=2) + "\n"
    json_paths = [folder / f"{name}.json"]

    if common.json_path is not None:
        json_paths.append(common.json_path)

    for path in json_paths:
        path.write_text(text)

    Console().print(*save_figure(folder, name, figure), *json_paths, sep="\n")


def show(title: str, metrics: Mapping[str, Any]) -> None:
    """Print `metrics` as a table."""
    table = Table("key", "measured", title=title)

    for key, value in metrics.items():
        table.add_row(key, f"{value:.4g}" if isinstance(value, float) else str(value))

    Console().print(table)
