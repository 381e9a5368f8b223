"""One way to end for every command: what the user can mend is one sentence and exit code 2."""

from __future__ import annotations

import sys

import click

from cogmap.errors import CogmapError, UsageError


def run_command(command: click.Command, name: str, called: str | None = None) -> None:
    """Run `command`, as `called` in its help; `name` comes before the sentence of an error.

    Ends the process: 2 for what the user can mend, 1 for another failure of ours, 130 where it was
    interrupted.
    """
    try:
        command(standalone_mode=False, prog_name=called)
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except (click.Abort, KeyboardInterrupt):
        sys.exit(130)
    except CogmapError as error:
        click.echo(f"{name}: {error}", err=True)
        sys.exit(2 if isinstance(error, UsageError) else 1)
