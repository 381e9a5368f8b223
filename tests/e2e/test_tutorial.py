"""The tutorial runs, and is committed with what it shows."""

from __future__ import annotations

from pathlib import Path

import nbformat

from cogmap.bus.session import free_endpoint
from tests.support.system.runs import processes_at
from tests.support.tutorial import TUTORIAL, executed, shown

MAX_BYTES = 300_000


def test_every_cell_of_the_tutorial_runs_and_shows_what_is_committed(
    tmp_path: Path,
) -> None:
    endpoint = free_endpoint()
    committed = nbformat.read(TUTORIAL, nbformat.NO_CONVERT)

    now = executed(tmp_path, endpoint)

    kinds = [sorted(output.get("data", {"text": ""})) for output in shown(now)]
    assert kinds == [sorted(output.get("data", {"text": ""})) for output in shown(committed)]
    assert ["image/png", "text/plain"] in kinds
    assert processes_at(endpoint) == []


def test_the_tutorial_is_small_enough_for_a_page() -> None:
    assert TUTORIAL.stat().st_size < MAX_BYTES
