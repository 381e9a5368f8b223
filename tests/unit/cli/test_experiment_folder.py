"""The folder of an experiment."""

from __future__ import annotations

from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from cogmap.cli.experiment.results import folder_for


def ended(folder: Path, *, writes: bool) -> None:
    """End a command that made `folder` and then failed, having written there or not."""

    @click.command()
    def command() -> None:
        made = folder_for("experiment", folder)
        if writes:
            (made / "figure.png").write_bytes(b"")
        raise click.ClickException("it failed")

    CliRunner().invoke(command)


@pytest.mark.parametrize("writes", [True, False])
def test_a_folder_in_which_nothing_was_written_is_gone(tmp_path: Path, writes: bool) -> None:
    folder = tmp_path / "experiment"

    ended(folder, writes=writes)

    assert folder.exists() == writes


@pytest.mark.parametrize("writes", [True, False])
def test_a_folder_around_it_is_gone_with_it(tmp_path: Path, writes: bool) -> None:
    ended(tmp_path / "runs" / "experiment", writes=writes)

    assert (tmp_path / "runs").exists() == writes


def test_a_folder_of_the_user_stays(tmp_path: Path) -> None:
    ended(tmp_path, writes=False)

    assert tmp_path.exists()
