"""`cogmap town`: an example of a town to write, and a picture of any town."""

from __future__ import annotations

import logging
from pathlib import Path

import click

from cogmap.cli.files import check_picture
from cogmap.cli.run.options import known_town, seed_option
from cogmap.recording.storage.writer import cannot_write
from cogmap.services.sim.config import Config, place_of
from cogmap.services.sim.layout import towns
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.written import town as written

EXAMPLE = Path(__file__).with_name("example.toml")
PLOTS = (".png", ".pdf")
_EPILOG = """\b
A town of your own:
  cogmap town example > mytown.toml
  cogmap town show mytown.toml           mytown.png; says what is wrong in it, by line
  cogmap run --town mytown.toml
"""
_SHOW_EPILOG = """\b
Examples:
  cogmap town show mytown.toml -o mytown.pdf
  cogmap town show blocks --seed 3           the town of `cogmap run --town blocks --seed 3`
  cogmap town show osm:monaco.osm.gz
"""


@click.group(epilog=_EPILOG)
def town() -> None:
    """Write a town of your own, and draw any town."""


@town.command()
def example() -> None:
    """Print a small town as TOML, with what there is to write in it."""
    click.echo(EXAMPLE.read_text("utf-8"), nl=False)


@town.command(epilog=_SHOW_EPILOG)
@click.argument("name", metavar="TOWN", callback=known_town)
@seed_option
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="The picture.  [default: TOWN.png]"
)
def show(name: str, seed: int | None, output: Path | None) -> None:
    """Check TOWN, one that `cogmap run --town` takes, and draw it as PNG or PDF.

    The picture has the names of streets and buildings, the start, and the goals and charging places
    that are written in the town. Its axes are those in which `cogmap goal X Y` takes goals.
    """
    path = output or Path(f"{Path(name.rpartition(':')[2]).name.partition('.')[0]}{PLOTS[0]}")
    check_picture("-o", path, PLOTS)
    number = Config().seed if seed is None else seed
    place, goals_m = _place(name, number)
    title = towns.called(name, number)

    from cogmap.cli.plots.map.plan import draw_plan  # other verbs have no use for matplotlib

    logging.getLogger("matplotlib").setLevel(logging.WARNING)
    try:
        draw_plan(path, place.message(), place.start, goals_m, title)
    except OSError as error:
        raise cannot_write(path, error) from None
    streets = {road.name for road in place.roads}
    click.echo(f"{path}: {len(streets)} streets, {len(place.plots)} buildings")


def _place(name: str, seed: int) -> tuple[Place, dict[str, tuple[float, float]]]:
    """Return a town, and the goals that are written in it, by name. Raises ConfigError."""
    if not towns.is_written(name):
        return place_of(Config(town=name, seed=seed)), {}

    found = written.read(Path(name))
    return found, {goal.name: (goal.x_m, goal.y_m) for goal in found.goals}
