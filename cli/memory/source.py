"""The database that a command reads."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import click

from cogmap.cli.log.progress import bar
from cogmap.runtime.state.database import Database

existing_file = click.Path(exists=True, dir_okay=False, path_type=Path)
database_argument = click.argument("path", metavar="FILE", type=existing_file)


@contextmanager
def checked(path: Path) -> Iterator[Database]:
    """The database at `path`, all of it checked. Raises StorageError."""
    with bar(f"checking {path.name}") as progress:
        database = Database(path, progress)

    with closing(database):
        yield database
