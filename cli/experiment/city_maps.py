"""`cogmap experiment city-maps`: experiment 2 of the paper."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import click

from cli.experiment import live, outcome
from cli.experiment.options import (
    cameras_option,
    json_option,
    live_option,
    out_option,
    processes_option,
    seed_option,
)
from cli.log.progress import bar
from cogmap.errors import UsageError
from experiments.city_maps.drive import MIND
from experiments.city_maps.environment import Environment, environments
from experiments.city_maps.figures import camera_figures, figures
from experiments.city_maps.fit import fitted
from experiments.city_maps.measure import (
    NOISE,
    TRAVERSALS,
    Budget,
    by_cameras,
    configurations,
    jobs,
    measure,
)
from experiments.city_maps.sources import folder, from_osm, grown
from services.sim.odometry import Noise

NAME = "city-maps"
MAPS = 8
_EPILOG = """\b
Examples:
  cogmap experiment city-maps --json city.json        cities grown from a seed
  cogmap experiment city-maps --osm monaco.osm.xz --maps 4
  cogmap experiment city-maps --all extracts          every extract in a folder
"""


@click.command(name=NAME, epilog=_EPILOG)
@click.option(
    "--osm",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Streets and buildings of an OpenStreetMap extract.",
)
@click.option(
    "--all",
    "all_in",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Every extract (.osm, packed or not, .osm.pbf) and street graph (.jsonl, packed or not) in a folder.",
)
@click.option(
    "--maps",
    type=click.IntRange(1, 1000),
    help=f"So many maps of eight buildings.  [default: {MAPS} from a seed or --osm, one a city with --all]",
)
@click.option(
    "--traversals",
    type=click.IntRange(1, 1000),
    default=TRAVERSALS,
    show_default=True,
    help="Of each map.",
)
@click.option(
    "--noise",
    nargs=3,
    type=click.FloatRange(0, 1),
    default=(NOISE.speed, NOISE.turn, NOISE.drift_rad_per_sqrt_m),
    show_default=True,
    metavar="SPEED TURN DRIFT",
    help="Of self-motion: shares of speed and of turn, and radians of drift after a metre.",
)
@click.option(
    "--fit",
    is_flag=True,
    help="Fit that noise first, so that maps err as people's do; takes many times as long.",
)
@cameras_option
@live_option
@seed_option
@processes_option
@out_option
@json_option
def city_maps(
    osm: Path | None,
    all_in: Path | None,
    maps: int | None,
    traversals: int,
    noise: tuple[float, float, float],
    fit: bool,
    cameras: bool,
    goes_live: bool,
    seed: int,
    processes: int,
    out: Path | None,
    json_path: Path | None,
) -> None:
    """Experiment 2, figure 8: the maps that an agent learns of cities, with their loops closed and
    not.

    Eight buildings in at most 4 km², the shortest tour past all of them along the streets, driven
    anew so often by an agent that knows nothing, from any of the buildings. Percepts are not drawn:
    they err as perception was measured to.
    """
    where = outcome.folder_for(NAME, out)
    places = _places(osm, all_in, maps, seed)
    asked = Noise(speed=noise[0], turn=noise[1], drift_rad_per_sqrt_m=noise[2])
    if fit:
        with bar("fitting the noise") as progress:
            asked = fitted(places, Budget(traversals, seed, processes, progress))
    with bar("traversals") as progress:
        found = measure(places, asked, Budget(traversals, seed, processes, progress))
    said = figures(found, asked)
    first = jobs(places, asked, 1, seed)[0]
    if cameras:
        with bar("with cameras") as progress:
            said |= camera_figures(by_cameras(first, progress), found[0].learned[0])
    differing = (
        live.differing(configurations(first)["heading"], ("sim", *MIND)) if goes_live else []
    )
    if goes_live:
        said["live_same"] = float(not differing)
    outcome.say(NAME, said)
    draw: Any = importlib.import_module(
        "cli.plots.cities"
    )  # other commands have no use for matplotlib
    outcome.save(where, NAME, draw.figure(found, said), said, seed, json_path)
    live.check(differing)


def _places(
    osm: Path | None, all_in: Path | None, maps: int | None, seed: int
) -> list[Environment]:
    if osm is not None and all_in is not None:
        raise UsageError("--osm and --all: give one of them")
    if osm is not None:
        return environments(from_osm(osm), maps or MAPS, seed)
    if all_in is not None:
        return [
            each for city in folder(all_in, seed) for each in environments(city, maps or 1, seed)
        ]
    return [environments(grown(seed * 1000 + number), 1, seed)[0] for number in range(maps or MAPS)]
