"""`cogmap experiment cue-integration`: experiment 1 of the paper."""

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
from experiments.cue_integration import agent, camera_level
from experiments.cue_integration.run import FIT_TRIALS, FITTED, Budget, Session, fitted, measure
from experiments.cue_integration.trial import Condition, Noise, Trial

NAME = "cue-integration"
_EPILOG = """\b
Examples:
  cogmap experiment cue-integration --json cue.json
  cogmap experiment cue-integration --fit             fit the noise of self-motion anew
  cogmap experiment cue-integration --distance-noise 0.1   landmarks that are about as good as self-motion
"""


@click.command(name=NAME, epilog=_EPILOG)
@click.option(
    "--trials",
    type=click.IntRange(8, 100_000),
    default=200,
    show_default=True,
    help="So many of each condition.",
)
@click.option(
    "--distance-noise",
    type=click.FloatRange(0.001, 0.5),
    default=FITTED.distance,
    show_default=True,
    help="Of distances to landmarks, and of directions in rad.",
)
@click.option(
    "--fit", is_flag=True, help="Fit the noise of self-motion first; else take what a fit gave."
)
@cameras_option
@live_option
@seed_option
@processes_option
@out_option
@json_option
def cue_integration(
    trials: int,
    distance_noise: float,
    fit: bool,
    cameras: bool,
    goes_live: bool,
    seed: int,
    processes: int,
    out: Path | None,
    json_path: Path | None,
) -> None:
    """Experiment 1, figure 7: a post is carried back to its place in the dark, by self-motion,
    landmarks, or both.

    In Nardini's room, with four conditions: self-motion alone, landmarks alone after
    disorientation, both, and both in conflict, landmarks turned by 15°. The published figures
    beside ours are a simulation's, not people's.
    """
    folder = outcome.folder_for(NAME, out)
    noise = Noise(FITTED.speed, FITTED.turn, distance_noise)
    if fit:
        with bar("fitting the noise") as progress:
            noise = fitted(distance_noise, Budget(FIT_TRIALS, seed, processes, progress))
    with bar("trials") as progress:
        found = measure(noise, Budget(trials, seed, processes, progress))
    figures = found.figures()
    if cameras:
        with bar("trials with cameras") as progress:
            figures |= camera_level.figures(noise, seed, progress)
    differing = _differing(Trial(Condition.CONFLICT, 0, noise, seed)) if goes_live else []
    if goes_live:
        figures["live_same"] = float(not differing)
    outcome.say(NAME, figures)
    draw: Any = importlib.import_module(
        "cli.plots.cue_integration"
    )  # other commands have no use for matplotlib
    outcome.save(folder, NAME, draw.figure(found), figures, seed, json_path)
    live.check(differing)


def _differing(trial: Trial) -> list[str]:
    """The topics on which `trial` says other bytes through real processes, and the response where
    that is another.
    """
    inside = Session(trial)
    outside = Session(trial)
    response = inside.run()
    minds = [("workspace", "workspace"), ("codelets", agent.WORKER)]
    live.run(
        agent.SECTIONS,
        minds,
        outside.bodies(),
        lambda: outside.transcript.has_as_many_as(inside.transcript),
    )
    answer = [] if outside.room.response == response else ["the response"]
    return outside.transcript.differs_from(inside.transcript) + answer
