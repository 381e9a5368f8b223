"""The folders of runs, and their summaries in them."""

from __future__ import annotations

import time
from pathlib import Path

from cogmap.errors import ConfigError

RUNS = Path("runs")
SUMMARY_NAME = "summary.json"


def timed_folder() -> Path:
    """Return a folder of RUNS that is named after the time now; it is not made yet."""
    return RUNS / time.strftime("%Y-%m-%d-%H%M%S")


def new_folder(out: Path | None) -> Path:
    """Make `out`, or a folder of RUNS named after the time, which RUNS/latest then links to. Raises
    ConfigError if it exists or cannot be made.
    """
    folder = out or timed_folder()
    try:
        folder.mkdir(parents=True)
        if out is None:
            link_latest(folder)
    except FileExistsError:
        raise ConfigError(f"{folder} exists already: name another with --out") from None
    except OSError as error:
        raise ConfigError(
            f"cannot make the folder {folder} ({error.strerror}): name another with --out"
        ) from None
    return folder


def link_latest(folder: Path) -> None:
    """Let RUNS/latest link to a folder of RUNS; it leads to one at any moment. Raises OSError."""
    link = RUNS / f".latest-{folder.name}"
    link.symlink_to(folder.name)
    link.replace(RUNS / "latest")
