"""`cogmap schemes`: the guidance schemes that an agent learned on a recorded drive."""

from __future__ import annotations

from pathlib import Path

import click

from cogmap.cli.progress import bar
from cogmap.errors import LogError
from cogmap.recording.log import open_log
from cogmap.runtime.state.new_file import new_file
from cogmap.schemas import topics
from cogmap.schemas.cognition import Behaviours, GuidanceScheme
from cogmap.services.procedural.guidance.toml import written

_EPILOG = """\b
Examples:
  cogmap schemes runs/latest                     print them, as TOML
  cogmap schemes runs/latest --out route.toml    write a new file
  cogmap run --town blocks --set planning.explore=false --set procedural.schemes=route.toml
"""


@click.command(epilog=_EPILOG)
@click.argument("log", type=click.Path(path_type=Path))
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Write them into FILE, a new one.  [default: print them]",
)
def schemes(log: Path, out: Path | None) -> None:
    """Write the guidance schemes learned on the drive in LOG, which may be a run's folder.

    A scheme holds the objects around the agent at a place, and the path that it drove from there.
    An agent that starts at the same place with these schemes, and without goals, drives the same
    way.
    """
    found = learned(log)
    if not found:
        raise LogError(f"{log} holds no guidance schemes: record a drive to a goal past buildings")

    text = written(found)
    if out is None:
        click.echo(text, nl=False)
        return
    with new_file(out) as made:
        made.write_text(text, "utf-8")
    click.echo(f"{out}: {len(found)} guidance schemes")


def learned(path: Path) -> list[GuidanceScheme]:
    """Read the guidance schemes of a log, as they were published last. Raises LogError."""
    found: dict[str, GuidanceScheme] = {}
    log = open_log(path)
    with bar(f"reading {path}") as progress:
        for entry in log.messages(topics.BEHAVIOURS.name):
            assert isinstance(entry.message, Behaviours)
            found |= {scheme.name: scheme for scheme in entry.message.learned}
            progress(entry.time_s / max(log.duration_s, 1e-9))

    return list(found.values())
