"""How far a drive is, as a run shows it."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from cogmap.cli.launch import display
from cogmap.cli.launch.observer import Observer
from cogmap.schemas.process import Playback


def test_progress_never_goes_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(display, "PLAIN_PERIOD_S", 0.0)
    written = io.StringIO()
    shown = display.display_on(Console(file=written))
    observer = Observer()

    for share in (0.4, 0.1, 0.5):
        observer.update(Playback(recording="a", views=1, skipped=0, progress=share))
        shown.driving(observer, observer.errors())

    shares = [line.split()[0] for line in written.getvalue().splitlines()]
    assert shares == ["40%", "40%", "50%"]
