"""A progress bar for what takes a while."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import click
from rich.console import Console
from rich.progress import Progress

from cogmap.recording.storage import reader

SHOWN_AFTER_S = 2.0
LINE_EVERY_S = 60.0
"""Of a log: often enough to see that it goes on."""


@contextmanager
def bar(label: str) -> Iterator[reader.Progress]:
    """Yield a function of the share done. A terminal shows that share after SHOWN_AFTER_S; else it
    is written to standard error in a line every LINE_EVERY_S.
    """
    is_terminal = sys.stderr.isatty()
    progress = Progress(console=Console(stderr=True), transient=True, disable=not is_terminal)
    task = progress.add_task(label, total=1.0)
    is_started = False
    last_s = time.monotonic()

    def show(share: float) -> None:
        nonlocal is_started, last_s
        passed_s = time.monotonic() - last_s
        if not is_terminal:
            if passed_s >= LINE_EVERY_S:
                click.echo(f"{label}: {share:.0%}", err=True)
                last_s += passed_s
            return

        if not is_started and passed_s > SHOWN_AFTER_S:
            progress.start()
            is_started = True
        progress.update(task, completed=share)

    try:
        yield show
    finally:
        progress.stop()
