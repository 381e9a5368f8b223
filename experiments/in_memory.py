"""Modules run to their end on the in-memory bus."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from cogmap.errors import CogmapError
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module


def run(modules: Iterable[Module], until: Callable[[], bool] = lambda: False) -> None:
    """Run them until `until()` is true or no message is left. Raises CogmapError if one was
    refused.
    """
    runner = InProcessRunner(modules)

    try:
        runner.run(until)
        for shell in runner.shells:
            refused = dict(shell.intake.rejected)
            if refused:
                raise CogmapError(f"{shell.module.name} refused messages: {refused}")
    finally:
        runner.close()
