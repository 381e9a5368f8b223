"""`cogmap experiment`."""

from __future__ import annotations

import click

from cogmap.cli.experiment.city_maps import city_maps
from cogmap.cli.experiment.cue_integration import cue_integration
from cogmap.cli.experiment.loop_closing import loop_closing
from cogmap.cli.experiment.map_structure import map_structure
from cogmap.cli.experiment.route_planning import route_planning

_EPILOG = """\b
Each leaves a folder with its figure as PNG and PDF, and a JSON file of every metric printed,
the seed and the command.
"""


@click.group(epilog=_EPILOG)
def experiment() -> None:
    """Run the paper's experiments, through the same modules that drive the town."""


experiment.add_command(city_maps)
experiment.add_command(cue_integration)
experiment.add_command(loop_closing)
experiment.add_command(map_structure)
experiment.add_command(route_planning)
