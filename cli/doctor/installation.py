"""Finds problems of this installation."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Iterable, Iterator
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

from packaging.requirements import Requirement

from cogmap.cli.doctor.finding import Finding

OLDEST_PYTHON = (3, 11)
PACKAGE = "cogmap"
EXTRAS = ("", "rendering")  # what a drive in a simulated town needs


def examine(runs: Path) -> list[Finding]:
    """Collect all findings about this installation, whose runs are kept in `runs`."""
    return [
        *python_version(sys.version_info[:2]),
        *rendering(sys.version_info[:2], sys.platform, platform.machine()),
        *dependencies(required(declared())),
        *renderer(),
        *write_access(runs),
    ]


def python_version(version: tuple[int, int]) -> Iterator[Finding]:
    """Yield a finding if `version` (major, minor) is too old."""
    if version < OLDEST_PYTHON:
        running = ".".join(map(str, version))
        oldest = ".".join(map(str, OLDEST_PYTHON))
        yield Finding(
            "Python", f"this is {running}", f"install Python {oldest} or newer and run `make setup`"
        )


def rendering(version: tuple[int, int], system: str, machine: str) -> Iterator[Finding]:
    """Name what keeps camera images from being rendered: pybullet has wheels for one platform."""
    if (version, system, machine) != ((3, 11), "linux", "x86_64"):
        yield Finding(
            "rendering",
            "it needs Python 3.11 on Linux x86-64, as pybullet has no wheel for others",
            "drive at the level of percepts (`cogmap run --tour`), or render there or in the "
            "container; everything else runs here",
        )


def declared() -> list[str]:
    """Return the requirements that the installed package declares."""
    try:
        return metadata.requires(PACKAGE) or []
    except metadata.PackageNotFoundError:
        return []


def required(lines: Iterable[str]) -> list[Requirement]:
    """Return the requirements that hold here, those of rendering included, but not those of another
    extra, or for another Python or platform.
    """
    requirements = []
    for line in lines:
        requirement = Requirement(line)
        marker = requirement.marker
        if marker is None or any(marker.evaluate({"extra": extra}) for extra in EXTRAS):
            requirements.append(requirement)
    return requirements


def dependencies(requirements: Iterable[Requirement]) -> Iterator[Finding]:
    """Report each dependency that is not installed, or in a version out of its range."""
    requirements = list(requirements)
    if not requirements:
        yield Finding(PACKAGE, "it is not installed as a package", "run `make setup`")

    for requirement in requirements:
        name, versions = requirement.name, requirement.specifier
        remedy = f"install '{name}{versions}', as `make setup` does"
        try:
            installed = metadata.version(name)
        except metadata.PackageNotFoundError:
            yield Finding(name, "it is not installed", remedy)
            continue
        if installed not in versions:
            yield Finding(name, f"{installed} is installed, {versions} is required", remedy)


def renderer() -> Iterator[Finding]:
    """Yield a finding if EGL does not render the camera images; without pybullet nothing does."""
    if find_spec("pybullet") is None:
        return

    from cogmap.services.sim.rendering import egl_trial

    if not egl_trial.works():
        yield Finding(
            "EGL",
            "it does not load, so TinyRenderer renders the camera images, several times slower",
            "install libegl1 and libgl1-mesa-dri (Debian's names)",
        )


def write_access(runs: Path) -> Iterator[Finding]:
    """Yield a finding if no file can be written into `runs`, a folder that need not exist yet."""
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
