"""`cogmap memory show` and `check`."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import click
import msgspec

from cogmap.cli.log.formatting import megabytes, print_json, print_table
from cogmap.cli.log.progress import bar
from cogmap.cli.memory.source import checked, database_argument
from cogmap.cli.options import json_option
from cogmap.runtime.state.record import Record

_COLUMNS = ["kind:", "records", "size", "newest:"]


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
    """What is in a database: of all records, and of each kind."""

    path: str
    file_bytes: int
    all: Kind
    kinds: dict[str, Kind]


@click.command()
@database_argument
@json_option
def show(path: Path, as_json: bool) -> None:
    """Show what is in FILE: of each kind how many records, their size, and the newest."""
    with checked(path) as database, bar(f"reading {path.name}") as progress:
        found = Contents(str(path), path.stat().st_size, Kind(), {})
        for record in database.records():
            found.all.add(record)
            found.kinds.setdefault(record.kind, Kind()).add(record)
            progress(found.all.records / database.count)

    if as_json:
        print_json(found)
    else:
        _print(found)


@click.command()
@database_argument
def check(path: Path) -> None:
    """Check every page and every record of FILE; exit code 2 where one is damaged."""
    with checked(path) as database:
        click.echo(f"{path}: {database.count} records, none damaged")


def _print(found: Contents) -> None:
    click.echo(f"{found.path}: {found.all.records} records, {megabytes(found.file_bytes)}")
    if found.all.records:
        print_table(_COLUMNS, list(_rows(found.kinds)))


def _rows(kinds: dict[str, Kind]) -> Iterable[list[str]]:
    for name, kind in sorted(kinds.items()):
        yield [name, str(kind.records), megabytes(kind.payload_bytes), kind.newest]
