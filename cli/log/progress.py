"""A progress bar for what takes a while."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import Progress

from cogmap.recording.storage import reader

SHOWN_AFTER_S = 2.0


@contextmanager
def bar(label: str) -> Iterator[reader.Progress]:
    """Takes the share done, and shows it on a terminal once it has taken SHOWN_AFTER_S."""
    began_s = time.monotonic()
    progress = Progress(
        console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()
    )
    task = progress.add_task(label, total=1.0)
    started = False

    def tell(share: float) -> None:
        nonlocal started
        if not started and time.monotonic() - began_s > SHOWN_AFTER_S:
            progress.start()
            started = True
        progress.update(task, completed=share)

    try:
        yield tell
    finally:
        progress.stop()
