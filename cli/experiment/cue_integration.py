"""`cogmap experiment cue-integration`: experiment 1 of the paper."""

from __future__ import annotations

import click

from cogmap.cli.experiment import live, results
from cogmap.cli.experiment.options import Common, common_options
from cogmap.cli.options import FiniteRange
from cogmap.cli.progress import bar
from cogmap.experiments.cue_integration import agent, camera_level
from cogmap.experiments.cue_integration.run import (
    FIT_TRIALS,
    FITTED,
    Budget,
    Session,
    fitted,
    measure,
)
from cogmap.experiments.cue_integration.trial import Condition, Noise, Trial

NAME = "cue-integration"
_EPILOG = """\b
Examples:
  cogmap experiment cue-integration --json cue.json
  cogmap experiment cue-integration --fit             fit the noise of self-motion first
  cogmap experiment cue-integration --distance-noise 0.1   landmarks about as good as self-motion
"""


@click.command(name=NAME, epilog=_EPILOG)
@click.option(
    "--trials",
    type=click.IntRange(8, 100_000),
    default=200,
    show_default=True,
    help="Trials of each condition.",
)
@click.option(
    "--distance-noise",
    type=FiniteRange(0.001, 0.5),
    default=FITTED.distance,
    show_default=True,
    help="Noise of distances to landmarks, as a share, and of directions, in rad.",
)
@click.option(
    "--fit",
    is_flag=True,
    help="Fit the noise of self-motion first; otherwise it is known from a fit.",
)
@common_options
def cue_integration(common: Common, trials: int, distance_noise: float, fit: bool) -> None:
    """Run experiment 1, figure 7: an agent carries a post back to its place in the dark, guided by
    self-motion, landmarks, or both.

    It is in Nardini's room. There are four conditions: self-motion alone, landmarks alone after
    disorientation, both, and both in conflict, with landmarks turned by 15°. The published results
    beside ours are those of a simulation, not of people.
    """
    folder = results.folder_for(NAME, common.out)
    rules = results.show_rules(common)
    noise = Noise(FITTED.speed, FITTED.turn, distance_noise)

    if fit:
        with bar("fitting the noise") as progress:
            budget = Budget(FIT_TRIALS, common.seed, common.processes, progress, common.rules)
            noise = fitted(distance_noise, budget)

    with bar("trials") as progress:
        budget = Budget(trials, common.seed, common.processes, progress, common.rules)
        found = measure(noise, budget)

    metrics: dict[str, float | str] = {**found.metrics(), **rules}
    if common.cameras:
        with bar("trials with cameras") as progress:
            metrics |= camera_level.metrics(noise, common.seed, progress, common.rules)

    differing = None
    if common.live:
        differing = _differing(Trial(Condition.CONFLICT, 0, noise, common.seed, common.rules))
        metrics[live.SAME] = float(not differing)

    results.show(NAME, metrics)

    from cogmap.cli.plots.cue_integration import figure  # matplotlib takes long to import

    results.save(folder, NAME, figure(found), metrics, common)
    live.check(differing)


def _differing(trial: Trial) -> list[str]:
    """Return the topics on which `trial` publishes other bytes through real processes.

    The response is named too if it is another.
    """
    inside = Session(trial)
    outside = Session(trial)
    response = inside.run()
    instances = [("workspace", "workspace"), ("codelets", agent.WORKER)]

    def is_done() -> bool:
        return outside.transcript.has_as_many_as(inside.transcript)

    live.run(agent.sections(trial.rules), instances, outside.bodies(), is_done)
    differing = outside.transcript.differs_from(inside.transcript)

    if outside.room.response != response:
        differing.append("the response")

    return differing
