"""Modules run to their end on the in-memory bus."""

from __future__ import annotations

from collections.abc import Iterable

from cogmap.errors import CogmapError
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module


def run(modules: Iterable[Module]) -> None:
    """Run them until no message is left. Raises CogmapError if one was refused."""
    runner = InProcessRunner(modules)

    try:
        runner.run()
        for shell in runner.shells:
            refused = dict(shell.intake.rejected)
            if refused:
                raise CogmapError(f"{shell.module.name} refused messages: {refused}")
    finally:
        runner.close()
