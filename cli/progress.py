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
    """Yield a function of the share done; a terminal shows that share after SHOWN_AFTER_S."""
    began_s = time.monotonic()
    progress = Progress(
        console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()
    )
    task = progress.add_task(label, total=1.0)
    started = False

    def show(share: float) -> None:
        nonlocal started
        if not started and time.monotonic() - began_s > SHOWN_AFTER_S:
            progress.start()
            started = True
        progress.update(task, completed=share)

    try:
        yield show
    finally:
        progress.stop()
