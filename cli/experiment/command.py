"""`cogmap experiment`."""

from __future__ import annotations

import click

from cogmap.cli.verbs import add_verbs

VERBS = {
    "ablation": (
        "cogmap.cli.experiment.ablation:ablation",
        "Our rules, each taken away in turn, beside the paper's.",
    ),
    "city-maps": (
        "cogmap.cli.experiment.city_maps:city_maps",
        "Experiment 2, figure 8: maps learned of cities.",
    ),
    "cue-integration": (
        "cogmap.cli.experiment.cue_integration:cue_integration",
        "Experiment 1, figure 7: self-motion and landmarks.",
    ),
    "loop-closing": (
        "cogmap.cli.experiment.loop_closing:loop_closing",
        "Figure 6: a path before and after its loop is closed.",
    ),
    "map-structure": (
        "cogmap.cli.experiment.map_structure:map_structure",
        "Sub-maps of real cities.",
    ),
    "predictions": (
        "cogmap.cli.experiment.predictions:predictions",
        "Predictions of place cells, in recordings of yours.",
    ),
    "route-planning": (
        "cogmap.cli.experiment.route_planning:route_planning",
        "Experiment 3, figure 5: the order of several goals.",
    ),
    "spiking": (
        "cogmap.cli.experiment.spiking:spiking",
        "Figure 4, step by step: spikes as samples along a walk.",
    ),
}
_EPILOG = """\b
Each leaves a folder with its figure as PNG and PDF, and a JSON file of every metric printed,
the seed and the command.
"""


@click.group(epilog=_EPILOG)
def experiment() -> None:
    """Run the paper's experiments, with the same modules that drive the robot in the town."""


add_verbs(experiment, VERBS)
