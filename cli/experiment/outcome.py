"""What an experiment leaves behind: its figure as PNG and PDF, and JSON of every figure printed."""

from __future__ import annotations

import json
import shlex
import sys
from io import BytesIO
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from cli.plots.palette import PAPER
from cogmap.errors import UsageError

# Without the time of day in it, the same run gives the same bytes.
_UNDATED: dict[str, dict[str, Any]] = {"pdf": {"CreationDate": None}}


def folder_for(name: str, out: Path | None) -> Path:
    """`out`, or runs/`name`, made where it is not there. Raises UsageError where it cannot be."""
    folder = out if out is not None else Path("runs") / name
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(
            f"cannot make the folder {folder} ({error.strerror}): name another with --out"
        ) from None
    return folder


def command_line() -> str:
    """The command that this process was called with, to be run again."""
    return shlex.join(["cogmap", *sys.argv[1:]])


def save_figure(folder: Path, name: str, sheet: Figure) -> list[Path]:
    """Write `name`.png and `name`.pdf, the same bytes for the same figure."""
    paths = []
    for kind in ("png", "pdf"):
        file = BytesIO()
        sheet.savefig(file, format=kind, facecolor=PAPER, metadata=_UNDATED.get(kind))
        paths.append(folder / f"{name}.{kind}")
        paths[-1].write_bytes(file.getvalue())
    return paths


def save_json(path: Path, figures: dict[str, Any], seed: int) -> None:
    """Write `figures`, one flat object, with the seed and the exact command."""
    path.write_text(
        json.dumps({**figures, "seed": seed, "command": command_line()}, indent=2) + "\n"
    )


def save(
    folder: Path,
    name: str,
    sheet: Figure,
    figures: dict[str, Any],
    seed: int,
    json_path: Path | None,
) -> None:
    """Write the figure, and the JSON beside it and at `json_path`; say where."""
    paths = [*save_figure(folder, name, sheet), folder / f"{name}.json"]
    paths += [json_path] if json_path is not None else []
    for path in paths[2:]:
        save_json(path, figures, seed)
    Console().print(*paths, sep="\n")


def say(title: str, figures: dict[str, Any]) -> None:
    """Print `figures` as a table."""
    table = Table("key", "measured", title=title)
    for key, value in figures.items():
        table.add_row(key, f"{value:.4g}" if isinstance(value, float) else str(value))
    Console().print(table)
