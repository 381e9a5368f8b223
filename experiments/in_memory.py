"""Modules run to their end on the in-memory bus."""

from __future__ import annotations

from collections.abc import Iterable

from cogmap.errors import CogmapError
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module


def run(modules: Iterable[Module]) -> None:
    """Run them until nobody has anything left to do. Raises CogmapError where one refused a
    message.
    """
    runner = InProcessRunner(modules)
    try:
        runner.run()
        for shell in runner.shells:
            if shell.intake.rejected:
                raise CogmapError(
                    f"{shell.module.name} refused messages: {dict(shell.intake.rejected)}"
                )
    finally:
        runner.close()
