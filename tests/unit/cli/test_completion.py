"""Completion of what is typed in a shell."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.shell_completion import ShellComplete
from click.testing import CliRunner

from cogmap.cli.completion import PROGRAM, VARIABLE, installed, script_for
from cogmap.cli.main import cogmap
from cogmap.errors import UsageError


@pytest.fixture(autouse=True)
def without_xdg(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("XDG_DATA_HOME", "XDG_CONFIG_HOME"):
        monkeypatch.delenv(name, raising=False)


def completed(words: list[str], begun: str) -> list[str]:
    """What may follow these words, beginning with `begun`."""
    found = ShellComplete(cogmap, {}, PROGRAM, VARIABLE).get_completions(words, begun)
    return [item.value for item in found]


def test_verbs_options_and_topics_are_completed() -> None:
    assert "topic" in completed([], "to")
    assert "echo" in completed(["topic"], "e")
    assert "--filter" in completed(["topic", "echo"], "--fi")
    assert completed(["topic", "echo"], "odo") == ["odometry"]
    assert "motor/command" in completed(["topic", "hz", "odometry"], "motor")
    assert completed(["log", "cat", "drive.mcap"], "odo") == ["odometry"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_a_shell_asks_this_program(shell: str) -> None:
    printed = CliRunner().invoke(cogmap, ["completion", shell]).output

    assert f"{VARIABLE}={shell}_complete" in printed.replace(" ", "")


@pytest.mark.parametrize(("shell", "startup"), [("bash", ".bashrc"), ("zsh", ".zshrc")])
def test_a_shell_is_told_once_to_read_the_script(tmp_path: Path, shell: str, startup: str) -> None:
    (tmp_path / startup).write_text("alias ll='ls -l'", "utf-8")
    script = script_for(shell, cogmap)

    path, _ = installed(shell, script, tmp_path)
    again = installed(shell, script, tmp_path)

    assert again == [path]
    assert path.read_text("utf-8") == script
    assert (tmp_path / startup).read_text("utf-8") == f"alias ll='ls -l'\n. \"{path}\"\n"


def test_fish_finds_the_script_by_itself(tmp_path: Path) -> None:
    (path,) = installed("fish", "complete", tmp_path)

    assert path == tmp_path / ".config/fish/completions/cogmap.fish"


def test_a_file_in_the_way_is_named(tmp_path: Path) -> None:
    (tmp_path / ".local").write_text("", "utf-8")

    with pytest.raises(UsageError, match=r"cannot write .*\.local.*completion bash` prints"):
        installed("bash", "complete", tmp_path)
