"""How processes of `cogmap` are started."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

_SOURCES = Path(__file__).parents[2]
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
"""One thread a process for linear algebra: there are more processes than cores."""

_COGMAP = (sys.executable, "-P", "-m", "cogmap.cli.main")


def cogmap_command(*arguments: str) -> list[str]:
    """Return the command line of `cogmap` itself, with this process's Python and sources."""
    return [*_COGMAP, *arguments]


def arguments_of(command: Sequence[str]) -> list[str] | None:
    """Return the arguments of a command line that `cogmap_command` made; None of any other."""
    if tuple(command[: len(_COGMAP)]) != _COGMAP:
        return None
    return list(command[len(_COGMAP) :])


def environment() -> dict[str, str]:
    """Return this process's environment, with ONE_THREAD."""
    inherited = os.environ | ONE_THREAD

    paths = [str(_SOURCES)]
    if inherited.get("PYTHONPATH"):
        paths.append(inherited["PYTHONPATH"])
    inherited["PYTHONPATH"] = os.pathsep.join(paths)
    return inherited
