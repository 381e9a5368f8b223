"""What is wrong with this installation."""

from __future__ import annotations

import importlib
import os
import re
import sys
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

from cli.doctor.finding import Finding

OLDEST_PYTHON = (3, 11)
PACKAGE = "cogmap"
_REQUIREMENTS = Path(__file__).parents[2] / "requirements" / "run.txt"
_PIN = re.compile(r"([A-Za-z0-9_.-]+)==([A-Za-z0-9_.+!-]+)")


def examine(runs: Path) -> list[Finding]:
    """All that is wrong here, where runs are kept in `runs`."""
    return [
        *python_version(sys.version_info[:2]),
        *dependencies(pins()),
        *renderer(),
        *write_access(runs),
    ]


def python_version(version: tuple[int, int]) -> Iterator[Finding]:
    """Whether `version` (major, minor) is new enough."""
    if version < OLDEST_PYTHON:
        running, oldest = (".".join(map(str, numbers)) for numbers in (version, OLDEST_PYTHON))
        yield Finding(
            "Python", f"this is {running}", f"install Python {oldest} or newer and run `make setup`"
        )


def pins() -> dict[str, str]:
    """The version that each dependency is pinned to, from the sources or the installed package."""
    if _REQUIREMENTS.exists():
        lines = _REQUIREMENTS.read_text().splitlines()
    else:
        try:
            lines = metadata.requires(PACKAGE) or []
        except metadata.PackageNotFoundError:
            lines = []
    return {match[1]: match[2] for line in lines if (match := _PIN.match(line.strip()))}


def dependencies(pinned: dict[str, str]) -> Iterator[Finding]:
    """Whether each dependency is there in the version that it is pinned to."""
    if not pinned:
        yield Finding(
            PACKAGE,
            "neither its sources nor the installed package tell what it needs",
            "run `make setup`",
        )
    for name, version in pinned.items():
        try:
            installed = metadata.version(name)
        except metadata.PackageNotFoundError:
            yield Finding(
                name, "it is not installed", f"run `make setup`, which installs {name}=={version}"
            )
            continue
        if installed != version:
            yield Finding(
                name, f"{installed} is installed, {version} is pinned", "run `make setup`"
            )


def renderer() -> Iterator[Finding]:
    """Whether the simulator can render with EGL."""
    try:
        works = importlib.import_module("services.sim.rendering.egl").works
    except ImportError:  # the missing dependency is a finding of its own
        return
    if not works():
        yield Finding(
            "EGL",
            "it does not load, so TinyRenderer draws the camera's pictures, several times slower",
            "install libegl1 and libgl1-mesa-dri (Debian's names)",
        )


def write_access(runs: Path) -> Iterator[Finding]:
    """Whether runs can be written into `runs`, which may not be there yet."""
    folder = runs.absolute()
    while not folder.exists():
        folder = folder.parent
    if not folder.is_dir():
        yield Finding(str(runs), f"{folder} is a file", "move it away")
    elif not os.access(folder, os.W_OK | os.X_OK):
        yield Finding(
            str(runs),
            f"{folder} cannot be written to",
            "change its owner or start from another folder",
        )
