"""Runs that end with their test."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.support.system.runs import Run


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Run]]:
    """Starts `cogmap run` with any arguments, on a disk that takes no larger file."""
    runs: list[Run] = []

    def start(*arguments: str, file_limit_bytes: int | None = None) -> Run:
        folder = tmp_path / f"run-{len(runs)}"
        run = Run(folder, *arguments, file_limit_bytes=file_limit_bytes)
        runs.append(run)
        return run

    yield start
    for run in runs:
        run.close()
