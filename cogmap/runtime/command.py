"""One way to end for every command: what the user can mend is one sentence and exit code 2."""

from __future__ import annotations

import errno
import os
import sys

import click

from cogmap.errors import CogmapError, UsageError

NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""The errors of a write for which a disk, a quota or a limit leaves no room."""


def run_command(command: click.Command, name: str, called: str | None = None) -> None:
    """Run `command`, as `called` in its help; `name` comes before the sentence of an error.

    Ends the process after an error: with 2 if the user can mend it, with 1 for another failure of
    ours, with 130 after Ctrl-C; with 0 if the reader of the output has closed it: it has enough.
    """
    output = sys.stdout
    try:
        command(standalone_mode=False, prog_name=called)
        if sys.stdout is not None:
            sys.stdout.flush()
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except (click.Abort, KeyboardInterrupt):
        sys.exit(130)
    except CogmapError as error:
        click.echo(f"{name}: {error}", err=True)
        sys.exit(2 if isinstance(error, UsageError) else 1)
    except BrokenPipeError:
        _discard_output()
        sys.exit(0)
    except SystemExit:
        # Click ends with 1 because of a closed pipe, having wrapped the output that failed.
        if sys.stdout is output:
            raise
        _discard_output()
        sys.exit(0)
    except UnicodeEncodeError as error:
        character = error.object[error.start]
        click.echo(
            f"{name}: the output is encoded as {error.encoding}, which has no {character!a}: "
            "set PYTHONIOENCODING=utf-8",
            err=True,
        )
        _discard_output()
        sys.exit(2)
    except OSError as error:
        if error.errno not in NO_ROOM:
            raise
        click.echo(
            f"{name}: cannot write {error.filename or 'the output'} ({error.strerror}): make room "
            "there, or write elsewhere",
            err=True,
        )
        _discard_output()
        sys.exit(2)


def _discard_output() -> None:
    """Discard what standard output still holds: it would fail again as the process ends."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, sys.stdout.fileno())
