"""`cogmap experiment map-structure`: sub-maps of real cities."""

from __future__ import annotations

from pathlib import Path

import click

from cogmap.cli.experiment import results
from cogmap.cli.experiment.options import Common, common_options_without_sensing
from cogmap.cli.progress import bar
from cogmap.data.osm import SUFFIXES
from cogmap.errors import UsageError
from cogmap.experiments.map_structure.city import StructuredCity, read_city
from cogmap.experiments.map_structure.measure import measure, metrics_of
from cogmap.parallel import Progress

NAME = "map-structure"
_EPILOG = """\b
Examples:
  cogmap experiment map-structure --osm monaco.osm.gz
  cogmap experiment map-structure --all extracts --json structure.json
"""


@click.command(name=NAME, epilog=_EPILOG)
@click.option(
    "--osm",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="An OpenStreetMap extract with streets and buildings.",
)
@click.option(
    "--all",
    "all_in",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Every extract (.osm, packed or not, .osm.pbf) in a folder.",
)
@common_options_without_sensing
def map_structure(common: Common, osm: Path | None, all_in: Path | None) -> None:
    """Find sub-maps of real cities, by the model that structures the agent's map.

    Objects are buildings, and places that people use; their functions come from tags. Railways,
    water, walls and main roads are boundaries. The true sub-maps are not known. So the metrics are
    their number and size, how often a boundary separates neighbours, and how many stay the same
    when positions err by 2 m; and the agreement with quarters, if an extract names them.
    """
    folder = results.folder_for(NAME, common.out)
    with bar("reading") as progress:
        cities = _cities(osm, all_in, progress)

    with bar("structuring") as progress:
        found = measure(cities, common.seed, common.processes, progress)

    metrics = metrics_of(found)
    results.show(NAME, metrics)

    from cogmap.cli.plots.sub_maps import figure  # matplotlib takes long to import

    results.save(folder, NAME, figure(found), metrics, common)


def _cities(osm: Path | None, all_in: Path | None, progress: Progress) -> list[StructuredCity]:
    if (osm is None) == (all_in is None):
        raise UsageError("give one of --osm FILE, --all DIR: there are no sub-maps without a city")

    if osm is not None:
        return [read_city(osm)]

    assert all_in is not None
    if not all_in.is_dir():
        raise UsageError(f"there is no folder {all_in}")

    files = [file for file in sorted(all_in.iterdir()) if file.name.endswith(SUFFIXES)]
    if not files:
        raise UsageError(f"{all_in} has no OpenStreetMap extracts ({SUFFIXES[0]}): put some there")

    cities = []
    for file in files:
        cities.append(read_city(file))
        progress(len(cities) / len(files))
    return cities
