"""Trials on the in-memory bus, one or very many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from cogmap.errors import CogmapError
from cogmap.experiments.cue_integration import agent, analysis, participant, published, room
from cogmap.experiments.cue_integration.analysis import Gaussian
from cogmap.experiments.cue_integration.fit import coordinate_descent
from cogmap.experiments.cue_integration.geometry import Points
from cogmap.experiments.cue_integration.trial import Condition, Noise, Response, Trial
from cogmap.experiments.transcript import Transcript
from cogmap.parallel import Progress, parallel_map
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.services.codelets.rules import OURS

# What `fitted` returns with the seed and budget that the command has by default, rounded.
FITTED = Noise(speed=0.3, turn=0.173)
COMPARED = (
    topics.SELF_MOTION,
    topics.PERCEPTS,
    topics.TASK,
    topics.PROPOSAL,
    topics.DELTA,
    topics.ACTION,
)
FIT_TRIALS = 64
Metrics = dict[str, float]


@dataclass
class Session:
    """One trial to be run: the world, the participant's will, and a transcript of all messages."""

    trial: Trial
    kind: type[room.Room] = room.Room

    def __post_init__(self) -> None:
        self.room = self.kind(self.trial)
        self.transcript = Transcript(COMPARED)

    def bodies(self) -> list[Module]:
        """Return all that is not the mind. The room is the last, for it begins."""
        listener = self.transcript.module()
        subject = participant.build()
        world = room.build(self.room)
        return [listener, subject, world]

    def run(self) -> Response:
        """Run it on the in-memory bus. Raises CogmapError if no response comes."""
        mind = agent.modules(self.trial.number, self.trial.rules)
        runner = InProcessRunner([*mind, *self.bodies()])
        runner.run()
        runner.close()

        response = self.room.response
        if response is None:
            raise CogmapError(f"no response in {self.trial}")

        return response


def respond(trial: Trial) -> Response:
    """Run `trial` on the in-memory bus, from the start to the participant's answer."""
    return Session(trial).run()


@dataclass(frozen=True)
class Outcome:
    """Errors (n, 2) of every condition, along and inward, and the metrics of them."""

    noise: Noise
    errors_m: dict[Condition, Points]
    shift_m: float

    def sd_m(self, condition: Condition) -> float:
        """Return the standard deviation of a condition's responses."""
        return analysis.sd_m(self.errors_m[condition])

    def rmse_m(self, condition: Condition) -> float:
        """Return the root mean squared distance of a condition's responses from where the post
        stood.
        """
        return analysis.rmse_m(self.errors_m[condition])

    @property
    def optimal_sd_m(self) -> float:
        """Return the standard deviation of both cues, if they were combined optimally."""
        self_motion_m = self.sd_m(Condition.SELF_MOTION)
        landmarks_m = self.sd_m(Condition.LANDMARKS)
        return analysis.optimal_sd_m(self_motion_m, landmarks_m)

    @property
    def landmark_weight(self) -> float:
        """Return what landmarks would weigh if cues were combined optimally."""
        self_motion_m = self.sd_m(Condition.SELF_MOTION)
        landmarks_m = self.sd_m(Condition.LANDMARKS)
        return analysis.landmark_weight(self_motion_m, landmarks_m)

    def metrics(self) -> Metrics:
        """Return every metric, flat, beside those published; lengths in metres."""
        metrics: Metrics = {}
        for condition, errors_m in self.errors_m.items():
            name = condition.value
            metrics |= {
                f"sd_{name}_m": self.sd_m(condition),
                f"rmse_{name}_m": self.rmse_m(condition),
                f"lost_trials_{name}": float(analysis.lost(errors_m)),
                f"published_simulation_sd_{name}_m": published.SD_M[condition],
                f"published_simulation_rmse_{name}_m": published.RMSE_M[condition],
            }

        metrics["sd_optimal_m"] = self.optimal_sd_m
        metrics["sd_both_over_optimal"] = metrics["sd_both_m"] / self.optimal_sd_m
        metrics |= self.conflict_metrics()
        return metrics | {
            "sigma_v": self.noise.speed,
            "sigma_w": self.noise.turn,
            "distance_noise": self.noise.distance,
            "trials_a_condition": float(len(self.errors_m[Condition.BOTH])),
        }

    def conflict_metrics(self) -> Metrics:
        """Return how likely the conflict's responses are if cues are integrated, and if they
        alternate.

        Both predictions follow from the conditions with one cue, with nothing left to fit; the best
        alternation has the share of landmarks that suits it most.
        """
        conflict_m = self.errors_m[Condition.CONFLICT]
        own = Gaussian.of(self.errors_m[Condition.SELF_MOTION])
        landmarks_m = self.errors_m[Condition.LANDMARKS]
        seen = Gaussian.of(analysis.turned_errors(landmarks_m, self.shift_m))

        integrated = analysis.combined(own, seen).log_density(conflict_m)
        alternated = analysis.alternation_log_densities(conflict_m, own, seen, self.landmark_weight)
        best = analysis.best_alternation_log_likelihood(conflict_m, own, seen)

        total = float(integrated.sum())
        differences = integrated - alternated
        is_likelier = integrated > alternated
        return {
            "landmark_weight": self.landmark_weight,
            "conflict_shift_m": self.shift_m,
            "conflict_followed_m": float(conflict_m[:, 0].mean()),
            "integration_log_likelihood": total,
            "alternation_log_likelihood": float(alternated.sum()),
            "integration_over_alternation": float(differences.sum()),
            "integration_over_alternation_median_of_a_trial": float(np.median(differences)),
            "integration_likelier_share": float(is_likelier.mean()),
            "integration_over_best_alternation": total - best,
        }


@dataclass(frozen=True)
class Budget:
    """How many trials of each condition, with what seed, on how many processes, where the progress
    is reported, and by which preset of rules.
    """

    trials: int
    seed: int
    processes: int
    progress: Progress = lambda share: None
    rules: str = OURS


def measure(
    noise: Noise, budget: Budget, conditions: Sequence[Condition] = tuple(Condition)
) -> Outcome:
    """Run the trials of each condition. The outcome is the same for any number of processes."""
    jobs = []
    for condition in conditions:
        for number in range(budget.trials):
            trial = Trial(condition, number, noise, budget.seed, budget.rules)
            jobs.append(trial)

    responses = parallel_map(respond, jobs, budget.processes, budget.progress)
    errors_m = {}

    for place, condition in enumerate(conditions):
        first = place * budget.trials
        own = slice(first, first + budget.trials)
        errors_m[condition] = analysis.errors(jobs[own], responses[own])

    return Outcome(noise, errors_m, analysis.shift_m(jobs))


def fitted(distance: float, budget: Budget) -> Noise:
    """Fit speed and turn noise that bring self-motion's SD and RMSE nearest to those published, by
    coordinate descent.

    Only self-motion's are fitted: with distances at 3 %, no noise of self-motion makes landmarks as
    poor a cue as in the published simulation, and a fit to all would make up for that with noise
    that it does not have. The other conditions are predictions then. The trials are others than
    those that `measure` runs with the same seed.
    """
    others = replace(budget, seed=budget.seed + 1)
    own = Condition.SELF_MOTION

    @cache
    def cost(noise: Noise) -> float:
        outcome = measure(noise, others, (own,))
        sd_difference_m = outcome.sd_m(own) - published.SD_M[own]
        rmse_difference_m = outcome.rmse_m(own) - published.RMSE_M[own]
        return sd_difference_m**2 + rmse_difference_m**2

    start = Noise(speed=0.1, turn=0.1, distance=distance)
    return coordinate_descent(cost, start)
