"""`cogmap experiment city-maps`: experiment 2 of the paper."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

import click

from cogmap.cli.experiment import live, results
from cogmap.cli.experiment.options import Common, common_options
from cogmap.cli.options import FiniteRange
from cogmap.cli.progress import bar
from cogmap.errors import UsageError
from cogmap.experiments.city_maps import people
from cogmap.experiments.city_maps.drive import LEG, MODULES, VIEW
from cogmap.experiments.city_maps.environment import City, Environment, environments
from cogmap.experiments.city_maps.fit import Fit, fitted, halves
from cogmap.experiments.city_maps.kept import SUFFIX
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
from cogmap.experiments.city_maps.metrics import (
    camera_metrics,
    drive_metrics,
    fit_metrics,
    map_metrics,
)
from cogmap.experiments.city_maps.sources import folder, from_osm, grown_environments
from cogmap.parallel import Progress
from cogmap.services.sim.odometry import Noise
from cogmap.services.sim.trajectory import Drawn

NAME = "city-maps"
_EPILOG = """\b
Examples:
  cogmap experiment city-maps --json city.json        cities grown from a seed
  cogmap experiment city-maps --osm monaco.osm.xz --maps 4
  cogmap experiment city-maps --all extracts          every extract in a folder, against people
  cogmap experiment city-maps --all extracts --noise-drawn leg
  cogmap experiment city-maps --maps 4 --human examples/human_maps.csv
  cogmap experiment city-maps --driven --maps 2 --traversals 1
"""
TRAVERSALS_OF_ALL = 1


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
    help=f"Traversals of each map.  [default: {TRAVERSALS}, with --all {TRAVERSALS_OF_ALL}]",
)
@click.option(
    "--noise",
    nargs=3,
    type=FiniteRange(0, 1),
    metavar="SPEED TURN DRIFT",
    help="Noise of self-motion: shares of speed and of turn, and drift in radians after a metre.  "
    f"[default: {NOISE.speed} {NOISE.turn} {NOISE.drift_rad_per_sqrt_m}, fitted with --all]",
)
@click.option(
    "--noise-drawn",
    type=click.Choice([VIEW, LEG]),
    default=VIEW,
    show_default=True,
    help="Draw its factors anew for each view, or alike for all views of a straight piece of a "
    "street.",
)
@click.option(
    "--fit",
    is_flag=True,
    help="Fit that noise to the errors of people on every second map, by the paper's rule, and "
    "measure the others. --all does so unless --noise is given.",
)
@click.option(
    "--human",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Compare with maps that people drew: a CSV file of map, person, building, x and y, as "
    "buildings.csv among the results has them.",
)
@click.option(
    "--driven",
    is_flag=True,
    help="Let the agent drive itself, by its own action selection and motor programs, from one "
    "given turn or building of the tour to the next. It is led along the tour otherwise.",
)
@common_options
def city_maps(
    common: Common,
    osm: Path | None,
    all_in: Path | None,
    maps: int | None,
    traversals: int | None,
    noise: tuple[float, float, float] | None,
    noise_drawn: Drawn,
    fit: bool,
    human: Path | None,
    driven: bool,
) -> None:
    """Run experiment 2, figure 8: an agent learns maps of cities, with their loops closed and not.

    Each map has eight buildings in at most 4 km². An agent that knows nothing drives the shortest
    tour past them along the streets, from any of the buildings. Percepts are not rendered: they
    have the measured errors of perception.
    """
    if fit and noise is not None:
        raise UsageError("--fit and --noise: give one of them")
    if driven:
        _check_driven(common, noise_drawn)
    out = results.folder_for(NAME, common.out)
    rules = results.show_rules(common)
    with bar("choosing buildings") as progress:
        places = _places(osm, all_in, maps, common.seed, progress)
    (out / "buildings.csv").write_text(people.template(places))
    people_km2 = people.read(human, places) if human is not None else None

    chosen = NOISE
    if noise is not None:
        chosen = Noise(speed=noise[0], turn=noise[1], drift_rad_per_sqrt_m=noise[2])
    to: list[Environment] = []
    if fit or (all_in is not None and noise is None and len(places) > 1):
        to, places = halves(places)
    if people_km2 is not None:
        people.check_number(places, people_km2)  # before hours of driving

    fits: dict[Drawn, Fit] = {}
    if to:
        with bar("fitting the noise") as progress:
            fits = fitted(to, places, common.seed, progress)
        chosen = fits[noise_drawn].noise

    often = traversals or (TRAVERSALS if all_in is None else TRAVERSALS_OF_ALL)
    kept = _kept(out)
    with bar("traversals") as progress:
        budget = Budget(
            often, common.seed, common.processes, progress, common.rules, kept, noise_drawn, driven
        )
        found = measure(places, chosen, budget)

    metrics = map_metrics(found, chosen) | rules | {"noise_drawn": noise_drawn}
    if driven:
        metrics |= drive_metrics(found)
    if fits:
        metrics |= fit_metrics(found, fits, len(to))
    if people_km2 is not None:
        metrics |= people.metrics(found, people_km2)

    first = jobs(places, chosen, 1, common.seed, common.rules, drawn=noise_drawn)[0]
    if common.cameras:
        with bar("with cameras") as progress:
            metrics |= camera_metrics(by_cameras(first, progress), found[0].learned[0])

    differing = None
    if common.live:
        differing = live.differing(configurations(first)["heading"], MODULES)
        metrics[live.SAME] = float(not differing)

    results.show(NAME, metrics)
    _save(out, found, metrics, common)
    shutil.rmtree(kept)
    live.check(differing)


def _check_driven(common: Common, noise_drawn: Drawn) -> None:
    """Raise UsageError for options that take an agent that is led."""
    led_only = {
        "--cameras": common.cameras,
        "--live": common.live,
        f"--noise-drawn {LEG}": noise_drawn == LEG,
    }
    for option, is_given in led_only.items():
        if is_given:
            raise UsageError(f"{option} is of agents that are led: leave it or --driven out")


def _kept(out: Path) -> Path:
    """Make the folder that traversals are kept in until the command ends, and print whether some
    are there.
    """
    kept = out / "traversals"
    kept.mkdir(exist_ok=True)
    count = len(list(kept.glob(f"*{SUFFIX}")))
    if count:
        click.echo(
            f"continues with {count} traversals of an interrupted run, from {kept}", err=True
        )

    return kept


def _save(out: Path, found: list[CityMap], metrics: dict[str, float | str], common: Common) -> None:
    from cogmap.cli.plots.cities import figure  # matplotlib takes long to import

    results.save(out, NAME, figure(found, metrics), metrics, common)


def _places(
    osm: Path | None, all_in: Path | None, maps: int | None, seed: int, progress: Progress
) -> list[Environment]:
    if osm is not None and all_in is not None:
        raise UsageError("--osm and --all: give one of them")

    if osm is not None:
        return environments(from_osm(osm), maps or MAPS, seed)

    if all_in is not None:
        return _places_of_all(folder(all_in, seed), maps or 1, seed, progress)

    return grown_environments(maps or MAPS, seed)


def _places_of_all(
    cities: Sequence[City], maps: int, seed: int, progress: Progress
) -> list[Environment]:
    """Choose buildings in each city, and name those that have too few. Raises UsageError if all
    have.
    """
    found = []

    for number, city in enumerate(cities, start=1):
        try:
            found += environments(city, maps, seed)
        except UsageError as error:
            click.echo(f"left out: {error}", err=True)
        progress(number / len(cities))

    if not found:
        raise UsageError("no city of the folder has enough buildings: give larger extracts")
    return found
