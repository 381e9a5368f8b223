"""`cogmap experiment city-maps`: experiment 2 of the paper."""

from __future__ import annotations

from pathlib import Path

import click

from cogmap.cli.experiment import live, results
from cogmap.cli.experiment.options import Common, common_options
from cogmap.cli.options import FiniteRange
from cogmap.cli.progress import bar
from cogmap.errors import UsageError
from cogmap.experiments.city_maps.drive import MODULES
from cogmap.experiments.city_maps.environment import Environment, environments
from cogmap.experiments.city_maps.fit import fitted
from cogmap.experiments.city_maps.measure import (
    MAPS,
    NOISE,
    TRAVERSALS,
    Budget,
    CityMap,
    by_cameras,
    configurations,
    jobs,
    measure,
)
from cogmap.experiments.city_maps.metrics import camera_metrics, map_metrics
from cogmap.experiments.city_maps.sources import folder, from_osm, grown_environments
from cogmap.services.sim.odometry import Noise

NAME = "city-maps"
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
    help="Take streets and buildings from an OpenStreetMap extract.",
)
@click.option(
    "--all",
    "all_in",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Every extract (.osm, packed or not, .osm.pbf) and street graph (.jsonl, packed or not) "
    "in a folder.",
)
@click.option(
    "--maps",
    type=click.IntRange(1, 1000),
    help="Maps of eight buildings each.  "
    f"[default: {MAPS} from a seed or --osm, one a city with --all]",
)
@click.option(
    "--traversals",
    type=click.IntRange(1, 1000),
    default=TRAVERSALS,
    show_default=True,
    help="Traversals of each map.",
)
@click.option(
    "--noise",
    nargs=3,
    type=FiniteRange(0, 1),
    default=(NOISE.speed, NOISE.turn, NOISE.drift_rad_per_sqrt_m),
    show_default=True,
    metavar="SPEED TURN DRIFT",
    help="Noise of self-motion: shares of speed and of turn, and drift in radians after a metre.",
)
@click.option(
    "--fit",
    is_flag=True,
    help="Fit that noise to the errors of people first; takes many times as long.",
)
@common_options
def city_maps(
    common: Common,
    osm: Path | None,
    all_in: Path | None,
    maps: int | None,
    traversals: int,
    noise: tuple[float, float, float],
    fit: bool,
) -> None:
    """Run experiment 2, figure 8: an agent learns maps of cities, with their loops closed and not.

    Each map has eight buildings in at most 4 km². An agent that knows nothing drives the shortest
    tour past them along the streets, from any of the buildings. Percepts are not rendered: they
    have the measured errors of perception.
    """
    out = results.folder_for(NAME, common.out)
    rules = results.show_rules(common)
    with bar("choosing buildings"):
        places = _places(osm, all_in, maps, common.seed)
    chosen = Noise(speed=noise[0], turn=noise[1], drift_rad_per_sqrt_m=noise[2])

    if fit:
        with bar("fitting the noise") as progress:
            budget = Budget(traversals, common.seed, common.processes, progress, common.rules)
            chosen = fitted(places, budget)

    with bar("traversals") as progress:
        budget = Budget(traversals, common.seed, common.processes, progress, common.rules)
        found = measure(places, chosen, budget)

    metrics = map_metrics(found, chosen) | rules
    first = jobs(places, chosen, 1, common.seed, common.rules)[0]
    if common.cameras:
        with bar("with cameras") as progress:
            metrics |= camera_metrics(by_cameras(first, progress), found[0].learned[0])

    differing = None
    if common.live:
        differing = live.differing(configurations(first)["heading"], MODULES)
        metrics[live.SAME] = float(not differing)

    results.show(NAME, metrics)
    _save(out, found, metrics, common)
    live.check(differing)


def _save(out: Path, found: list[CityMap], metrics: dict[str, float | str], common: Common) -> None:
    from cogmap.cli.plots.cities import figure  # matplotlib takes long to import

    results.save(out, NAME, figure(found, metrics), metrics, common)


def _places(
    osm: Path | None, all_in: Path | None, maps: int | None, seed: int
) -> list[Environment]:
    if osm is not None and all_in is not None:
        raise UsageError("--osm and --all: give one of them")

    if osm is not None:
        return environments(from_osm(osm), maps or MAPS, seed)

    if all_in is not None:
        found = []
        for city in folder(all_in, seed):
            found += environments(city, maps or 1, seed)
        return found

    return grown_environments(maps or MAPS, seed)
