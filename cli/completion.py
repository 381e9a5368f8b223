"""`cogmap completion`: lets a shell complete verbs, options and topics."""

from __future__ import annotations

import os
from pathlib import Path

import click
from click.shell_completion import get_completion_class

from cogmap.errors import UsageError

PROGRAM = "cogmap"
VARIABLE = f"_{PROGRAM.upper()}_COMPLETE"
"""By which the shell asks click for what may follow."""

STARTUP_FILES = {"bash": ".bashrc", "zsh": ".zshrc"}
"""In the home folder; fish looks by itself into a folder of completions."""

_EPILOG = """\b
Examples:
  cogmap completion bash --install       from the next shell on, Tab completes
  cogmap completion fish                 print the script
"""


@click.command(epilog=_EPILOG)
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.option("--install", is_flag=True, help="Keep the script, and let the shell read it.")
def completion(shell: str, install: bool) -> None:
    """Print the script by which SHELL completes what is typed after `cogmap`.

    With --install it is kept in a file of yours. bash and zsh get a line in their startup file that
    reads it, fish finds it. Verbs, options and the names of topics are completed.
    """
    script = script_for(shell, click.get_current_context().find_root().command)
    if not install:
        click.echo(script)
        return
    for path in installed(shell, script, Path.home()):
        click.echo(f"{path}: written")
    click.echo(f"start a new {shell} to use it")


def script_for(shell: str, command: click.Command) -> str:
    """Return click's script by which `shell` completes `command`."""
    kind = get_completion_class(shell)
    assert kind is not None
    return kind(command, {}, PROGRAM, VARIABLE).source()


def installed(shell: str, script: str, home: Path) -> list[Path]:
    """Write the script, and what makes `shell` read it, under `home`. Returns the files written.

    Raises UsageError if one cannot be.
    """
    path = script_path(shell, home)
    written = [path]
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(script, "utf-8")
        if shell in STARTUP_FILES and _add_line(home / STARTUP_FILES[shell], f'. "{path}"'):
            written.append(home / STARTUP_FILES[shell])
    except OSError as error:
        raise UsageError(
            f"cannot write {error.filename or path} ({error.strerror}): "
            f"`cogmap completion {shell}` prints what is to be kept elsewhere"
        ) from None
    return written


def script_path(shell: str, home: Path) -> Path:
    """Return where the script for `shell` is kept."""
    if shell == "fish":
        folder = Path(os.environ.get("XDG_CONFIG_HOME") or home / ".config")
        return folder / "fish" / "completions" / f"{PROGRAM}.fish"
    folder = Path(os.environ.get("XDG_DATA_HOME") or home / ".local" / "share")
    return folder / PROGRAM / f"completion.{shell}"


def _add_line(path: Path, line: str) -> bool:
    """Add a line to the end of a file, unless it is there. Returns whether it was added."""
    before = path.read_text("utf-8") if path.exists() else ""
    if line in before.splitlines():
        return False

    separator = "" if not before or before.endswith("\n") else "\n"
    with path.open("a", encoding="utf-8") as file:
        file.write(f"{separator}{line}\n")
    return True
