"""`cogmap memory show` and `check`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import click
import msgspec
from mcap.writer import MCAP0_MAGIC

from cogmap.cli.options import json_option
from cogmap.cli.printing import megabytes, print_json, print_table
from cogmap.cli.progress import bar
from cogmap.errors import UsageError
from cogmap.runtime.state.database import Database
from cogmap.runtime.state.record import Record

COLUMNS = ["kind:", "records", "size", "newest:"]
existing_file = click.Path(exists=True, dir_okay=False, path_type=Path)


def _database(context: click.Context, argument: click.Parameter, path: Path) -> Path:
    """Refuse a log, which nobody should move away to make a memory in its place."""
    with path.open("rb") as file:
        is_log = file.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC
    if is_log:
        raise UsageError(
            f"{path} is a log, not a memory: `cogmap log info {path}` shows it, and the memory of "
            "a run is memory.db in its folder"
        )
    return path


database_argument = click.argument("path", metavar="FILE", type=existing_file, callback=_database)


@contextmanager
def checked(path: Path) -> Iterator[Database]:
    """Open the database at `path` once all of it was checked. Raises StorageError."""
    with bar(f"checking {path.name}") as progress:
        database = Database(path, progress)

    with closing(database):
        yield database


class Kind(msgspec.Struct):
    """The records of one kind: how many, the bytes of their payloads, the key of the newest."""

    records: int = 0
    payload_bytes: int = 0
    newest: str = ""

    def add(self, record: Record) -> None:
        """Count a record that is newer than those before."""
        self.records += 1
        self.payload_bytes += len(record.payload)
        self.newest = record.key


class Contents(msgspec.Struct):
    """The contents of a database: all records together, and each kind."""

    path: str
    file_bytes: int
    all: Kind
    kinds: dict[str, Kind]


@click.command()
@database_argument
@json_option
def show(path: Path, as_json: bool) -> None:
    """Show the number and size of the records of each kind in FILE, and the newest of them."""
    with checked(path) as database, bar(f"reading {path.name}") as progress:
        found = Contents(str(path), path.stat().st_size, Kind(), {})
        for record in database.records():
            found.all.add(record)
            found.kinds.setdefault(record.kind, Kind()).add(record)
            progress(found.all.records / database.count)

    if as_json:
        print_json(found)
        return

    click.echo(f"{path}: {found.all.records} records, {megabytes(found.file_bytes)}")
    if found.all.records:
        rows = [
            (name, kind.records, megabytes(kind.payload_bytes), kind.newest)
            for name, kind in sorted(found.kinds.items())
        ]
        print_table(COLUMNS, rows)


@click.command()
@database_argument
def check(path: Path) -> None:
    """Check every page and every record of FILE; ends with 2 if one is damaged."""
    with checked(path) as database:
        click.echo(f"{path}: {database.count} records, none damaged")
