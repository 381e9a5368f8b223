"""Finds problems of the keys that this machine has."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

from cogmap.bus.access import site
from cogmap.cli.doctor.finding import Finding
from cogmap.errors import AccessError

KEYS = "keys"


def examine(folder: Path, now: datetime) -> Iterator[Finding]:
    """Yield a finding for each certificate in `folder` that does not hold, or not for long."""
    try:
        holders = site.holders(folder)
    except AccessError as error:
        yield refused(error)
        return

    for holder in holders:
        problem = holder.problem(now)
        if problem:
            yield Finding(
                KEYS,
                f"the certificate of {holder.name}, which ends on {holder.until.date()}: {problem}",
                f"renew it with `cogmap keys make {folder}`",
            )


def refused(error: AccessError) -> Finding:
    """Return what an error says as a finding."""
    wrong, _, remedy = str(error).rpartition(": ")
    return Finding(KEYS, wrong, remedy)
