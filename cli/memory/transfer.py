"""`cogmap memory export` and `import`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import click

from cogmap.cli.memory import lines
from cogmap.cli.memory.show import checked, database_argument, existing_file
from cogmap.cli.progress import bar
from cogmap.runtime.state.database import write_new
from cogmap.runtime.state.new_file import new_file
from cogmap.runtime.state.record import Record

_new_path = click.Path(path_type=Path)


@click.command()
@database_argument
@click.argument("target", metavar="OUT.jsonl", type=_new_path)
def export(path: Path, target: Path) -> None:
    """Write all records of FILE into OUT.jsonl, a new file of JSON lines.

    The first line has format, version and count; each line after it has a record's key, kind,
    payload in base64, and digest. OUT.jsonl appears only when it is complete.
    """
    with checked(path) as database, new_file(target) as made:
        count = database.count
        with made.open("wb") as file, bar(f"writing {target.name}") as progress:
            followed = _followed(database.records(), count, progress)
            file.writelines(lines.written(followed, count))

    click.echo(f"{target}: {count} records")


@click.command("import")
@click.argument("source", metavar="OUT.jsonl", type=existing_file)
@click.argument("path", metavar="FILE", type=_new_path)
def import_(source: Path, path: Path) -> None:
    """Make the new database FILE from the export OUT.jsonl.

    Every digest and the count are checked; if one is wrong, FILE is not made.
    """
    with source.open("rb") as file, bar(f"reading {source.name}") as progress:
        count = lines.head(source, file.readline()).count
        found = lines.records(source, file, count)
        write_new(path, _followed(found, count, progress))

    click.echo(f"{path}: {count} records")


def _followed(
    records: Iterable[Record], count: int, progress: Callable[[float], None]
) -> Iterator[Record]:
    """Yield the same records, and report to `progress` the share of `count` that has passed."""
    for number, record in enumerate(records, start=1):
        progress(min(1.0, number / max(count, 1)))
        yield record
