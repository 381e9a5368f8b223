"""What is wrong with this installation."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterable, Iterator
from importlib import metadata
from pathlib import Path

from cli.doctor.finding import Finding

OLDEST_PYTHON = (3, 11)
PACKAGE = "cogmap"
_PIN = re.compile(r"([A-Za-z0-9_.-]+)==([A-Za-z0-9_.+!-]+)")


def examine(runs: Path) -> list[Finding]:
    """All findings about this installation, where runs are kept in `runs`."""
    return [
        *python_version(sys.version_info[:2]),
        *dependencies(pins(_requirements())),
        *renderer(),
        *write_access(runs),
    ]


def python_version(version: tuple[int, int]) -> Iterator[Finding]:
    """Whether `version` (major, minor) is new enough."""
    if version < OLDEST_PYTHON:
        running = ".".join(map(str, version))
        oldest = ".".join(map(str, OLDEST_PYTHON))
        yield Finding(
            "Python", f"this is {running}", f"install Python {oldest} or newer and run `make setup`"
        )


def _requirements() -> list[str]:
    """What the installed package declares that it needs."""
    try:
        return metadata.requires(PACKAGE) or []
    except metadata.PackageNotFoundError:
        return []


def pins(requirements: Iterable[str]) -> dict[str, str]:
    """The version that each required package is pinned to; those of an extra are optional."""
    versions = {}
    for requirement in requirements:
        name_and_version, _, marker = requirement.partition(";")
        pin = _PIN.match(name_and_version.strip())
        if pin is not None and "extra" not in marker:
            versions[pin[1]] = pin[2]
    return versions


def dependencies(pinned: dict[str, str]) -> Iterator[Finding]:
    """Whether each dependency is installed in the version that it is pinned to."""
    if not pinned:
        yield Finding(PACKAGE, "it is not installed as a package", "run `make setup`")
    for name, version in pinned.items():
        yield from _dependency(name, version)


def _dependency(name: str, version: str) -> Iterator[Finding]:
    try:
        installed = metadata.version(name)
    except metadata.PackageNotFoundError:
        yield Finding(
            name, "it is not installed", f"install {name}=={version}, as `make setup` does"
        )
        return

    if installed != version:
        yield Finding(
            name,
            f"{installed} is installed, {version} is required",
            f"install {name}=={version}, as `make setup` does",
        )


def renderer() -> Iterator[Finding]:
    """Whether the simulator can render with EGL."""
    try:
        from services.sim.rendering import egl
    except ImportError:  # the missing dependency is a finding of its own
        return

    if not egl.works():
        yield Finding(
            "EGL",
            "it does not load, so TinyRenderer renders the camera images, several times slower",
            "install libegl1 and libgl1-mesa-dri (Debian's names)",
        )


def write_access(runs: Path) -> Iterator[Finding]:
    """Whether files can be written into `runs`, a folder that need not exist yet."""
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
