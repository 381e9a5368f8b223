"""`cogmap experiment cue-integration`: experiment 1 of the paper."""

from __future__ import annotations

import click
import msgspec

from cogmap.cli.experiment import live, results
from cogmap.cli.experiment.options import Common, common_options
from cogmap.cli.options import FiniteRange
from cogmap.cli.progress import bar
from cogmap.errors import UsageError
from cogmap.experiments.cue_integration import agent, camera_level
from cogmap.experiments.cue_integration.run import (
    FIT_TRIALS,
    FITTED,
    Budget,
    Session,
    fitted,
    measure_seeds,
    metrics_of_seeds,
    pooled,
)
from cogmap.experiments.cue_integration.trial import DISTANCE, Condition, Noise, Trial

NAME = "cue-integration"
_EPILOG = """\b
Examples:
  cogmap experiment cue-integration --json cue.json
  cogmap experiment cue-integration --seeds 1          one seed, in a minute
  cogmap experiment cue-integration --fit              fit the noise of the senses first
  cogmap experiment cue-integration --range-only       distances alone, as in the paper's table 1
  cogmap experiment cue-integration --landmark-noise 0.03   landmarks far better than self-motion
"""


@click.command(name=NAME, epilog=_EPILOG)
@click.option(
    "--trials",
    type=click.IntRange(8, 100_000),
    default=200,
    show_default=True,
    help="Trials of each condition, with each seed.",
)
@click.option(
    "--seeds",
    type=click.IntRange(1, 1000),
    default=20,
    show_default=True,
    help="Seeds to run, from --seed on.",
)
@click.option(
    "--range-only",
    is_flag=True,
    help="Landmarks show their distance and no direction, as in the paper's table 1, with its 3 %.",
)
@click.option(
    "--felt",
    is_flag=True,
    help="Disorientation takes away the pose alone; otherwise the steps after it too.",
)
@click.option(
    "--landmark-noise",
    type=FiniteRange(0.001, 0.5),
    default=None,
    help="Noise of distances to landmarks, as a share, and of directions, in rad.  "
    f"[default: {FITTED.landmark}; {DISTANCE} with --range-only]",
)
@click.option(
    "--fit",
    is_flag=True,
    help="Fit the noise of self-motion and of landmarks first, from what was found so before.",
)
@common_options
def cue_integration(
    common: Common,
    trials: int,
    seeds: int,
    range_only: bool,
    felt: bool,
    landmark_noise: float | None,
    fit: bool,
) -> None:
    """Run experiment 1, figure 7: an agent carries a post back to its place in the dark, guided by
    self-motion, landmarks, or both.

    It is in Nardini's room. There are four conditions: self-motion alone, landmarks alone after
    disorientation, both, and both in conflict, with landmarks turned by 15°. The noise of the
    senses suits the first two of a published simulation; the others are predictions. The published
    results beside ours are those of that simulation, not of people.
    """
    if fit and landmark_noise is not None:
        raise UsageError("--fit finds the noise of landmarks: leave out --landmark-noise")

    folder = results.folder_for(NAME, common.out)
    rules = results.show_rules(common)
    if landmark_noise is None:
        landmark_noise = DISTANCE if range_only else FITTED.landmark
    noise = Noise(FITTED.speed, FITTED.turn, landmark_noise, range_only, felt)

    if fit:
        with bar("fitting the noise") as progress:
            budget = Budget(FIT_TRIALS, common.seed, common.processes, progress, common.rules)
            start = msgspec.structs.replace(FITTED, range_only=range_only, felt=felt)
            noise = fitted(start, budget)

    with bar("trials") as progress:
        budget = Budget(trials, common.seed, common.processes, progress, common.rules)
        outcomes = measure_seeds(noise, budget, seeds)

    found = pooled(outcomes)
    metrics: dict[str, float | str] = {**metrics_of_seeds(outcomes, common.seed), **rules}
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
