"""How far work is, where there is no terminal to draw a bar on."""

from __future__ import annotations

import pytest

from cogmap.cli import progress
from cogmap.cli.progress import bar


def test_a_log_has_a_line_now_and_then(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress, "LINE_EVERY_S", 0.0)

    with bar("exploring") as show:
        show(0.25)

    assert capsys.readouterr().err == "exploring: 25%\n"


def test_what_is_soon_done_says_nothing_in_a_log(capsys: pytest.CaptureFixture[str]) -> None:
    with bar("exploring") as show:
        show(0.25)

    assert capsys.readouterr().err == ""
