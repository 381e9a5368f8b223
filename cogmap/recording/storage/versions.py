"""Which logs this version reads, by the version that recorded them."""

from __future__ import annotations

import re
from pathlib import Path

from cogmap.errors import LogError
from cogmap.version import VERSION

OLDEST_READABLE = "0.3.0"
_SOFTWARE = re.compile(r"cogmap (\d+)\.(\d+)(?:\.\d+)?\S*")
Release = tuple[int, int]


def check_readable(path: Path, library: str, recorded_by: str) -> None:
    """Raise LogError if the log at `path` is not ours, or of a version that is not read here.

    `library` is the header's; `recorded_by` the recording's own, which wins as tools that copy a
    log put their own name into the header. Before 1.0 each minor version may change what travels.
    """
    software = recorded_by or library
    found = _SOFTWARE.fullmatch(software)
    if found is None:
        raise LogError(
            f"{path} is not one of our logs: {software or 'an unknown program'} wrote it"
        )

    recorded = int(found[1]), int(found[2])
    if recorded < _release(OLDEST_READABLE):
        raise LogError(_refusal(path, software, f"reads logs from {OLDEST_READABLE} on"))
    if recorded > _release(VERSION):
        raise LogError(_refusal(path, software, "reads no newer logs"))


def _refusal(path: Path, software: str, limit: str) -> str:
    version = software.removeprefix("cogmap ")
    return (
        f"{path} was recorded by {software}, and cogmap {VERSION} {limit}: "
        f"read it with cogmap {version}"
    )


def _release(version: str) -> Release:
    major, minor, *_ = version.split(".")
    return int(major), int(minor)
