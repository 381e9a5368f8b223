"""Trials on the in-memory bus, one or very many."""

from __future__ import annotations

import gc
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial

import numpy as np

from cogmap.errors import CogmapError
from cogmap.experiments.cue_integration import (
    agent,
    analysis,
    participant,
    published,
    room,
    walk,
)
from cogmap.experiments.cue_integration.analysis import Gaussian
from cogmap.experiments.cue_integration.fit import SELF_MOTION, coordinate_descent
from cogmap.experiments.cue_integration.geometry import Points
from cogmap.experiments.cue_integration.trial import Condition, Noise, Response, Trial
from cogmap.experiments.transcript import Transcript
from cogmap.parallel import Progress, parallel_map
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.services.codelets.rules import OURS

# What `fitted` found from 0.25, 0.15 and 0.25 on, with FIT_TRIALS trials of seed FIT_SEED + 1: the
# nearest to what is published of self-motion alone and of landmarks alone.
FITTED = Noise(speed=0.303, turn=0.136, landmark=0.227)
COMPARED = (
    topics.SELF_MOTION,
    topics.PERCEPTS,
    topics.TASK,
    topics.PROPOSAL,
    topics.DELTA,
    topics.ACTION,
)
FIT_TRIALS = 64
# The fit has seeds of its own: what it was fitted to is not measured on.
FIT_SEED = 1000
FITTED_CONDITIONS = (Condition.SELF_MOTION, Condition.LANDMARKS)
FITTED_NAMES = (*SELF_MOTION, "landmark")
FIT_FACTORS = (1.1,)
# Of `sd_both_over_optimal`: a seed within these combines the cues nearly optimally.
NEAR_OPTIMAL = (0.9, 1.1)
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
    """Run `trial` on the in-memory bus, from the start to the participant's answer.

    Garbage is collected between trials, not amid them: that takes a fifth of the time.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        return Session(trial).run()
    finally:
        if was_enabled:
            gc.enable()


@dataclass(frozen=True)
class Outcome:
    """Errors (n, 2) of every condition, along and inward, and the metrics of them.

    SD and RMSE leave lost trials out, which are counted. `first_look_m` are the errors if the post
    had been put after one look, (n, 2) of every condition.
    """

    noise: Noise
    errors_m: dict[Condition, Points]
    shift_m: float
    first_look_m: dict[Condition, Points] = field(default_factory=dict)

    def kept_m(self, condition: Condition) -> Points:
        """Return the errors (k, 2) of a condition's trials that are not lost."""
        errors_m = self.errors_m[condition]
        return errors_m[~analysis.is_lost(errors_m)]

    def sd_m(self, condition: Condition) -> float:
        """Return the standard deviation of a condition's responses."""
        return analysis.sd_m(self.kept_m(condition))

    def rmse_m(self, condition: Condition) -> float:
        """Return the root mean squared distance of a condition's responses from where the post
        stood.
        """
        return analysis.rmse_m(self.kept_m(condition))

    @property
    def optimal_sd_m(self) -> float:
        """Return the standard deviation of both cues, if they were combined optimally."""
        self_motion_m = self.sd_m(Condition.SELF_MOTION)
        landmarks_m = self.sd_m(Condition.LANDMARKS)
        return analysis.optimal_sd_m(self_motion_m, landmarks_m)

    @property
    def both_over_optimal(self) -> float:
        """Return the standard deviation of responses by both cues over that of the optimum."""
        return self.sd_m(Condition.BOTH) / self.optimal_sd_m

    @property
    def landmark_weight(self) -> float:
        """Return the weight of landmarks if cues were combined optimally."""
        self_motion_m = self.sd_m(Condition.SELF_MOTION)
        landmarks_m = self.sd_m(Condition.LANDMARKS)
        return analysis.landmark_weight(self_motion_m, landmarks_m)

    def metrics(self) -> Metrics:
        """Return every metric, flat, beside those published; lengths in metres."""
        metrics: Metrics = {}
        for condition, errors_m in self.errors_m.items():
            name = condition.value
            is_lost = analysis.is_lost(errors_m)
            metrics |= {
                f"{name}_sd_m": self.sd_m(condition),
                f"{name}_rmse_m": self.rmse_m(condition),
                f"{name}_lost_trials": float(is_lost.sum()),
                f"{name}_sd_m_published_simulation": published.SD_M[condition],
                f"{name}_rmse_m_published_simulation": published.RMSE_M[condition],
            }

        metrics["optimal_sd_m"] = self.optimal_sd_m
        metrics["sd_both_over_optimal"] = self.both_over_optimal
        metrics |= self.conflict_metrics()
        if self.first_look_m:
            once = Outcome(self.noise, self.first_look_m, self.shift_m)
            metrics["sd_both_over_optimal_after_one_look"] = once.both_over_optimal

        return metrics | {
            "sigma_v": self.noise.speed,
            "sigma_w": self.noise.turn,
            "landmark_noise": self.noise.landmark,
            "range_only": float(self.noise.range_only),
            "felt": float(self.noise.felt),
            "trials_a_condition": float(len(self.errors_m[Condition.BOTH])),
        }

    def conflict_metrics(self) -> Metrics:
        """Return how likely the conflict's responses are if cues are integrated, and if they
        alternate.

        Both predictions follow from the conditions with one cue, with nothing left to fit; the best
        alternation has the share of landmarks that suits it most. Either allows for LOST_SHARE of
        the trials to be lost, so that one of those does not decide.
        """
        conflict_m = self.errors_m[Condition.CONFLICT]
        own = Gaussian.of(self.kept_m(Condition.SELF_MOTION))
        landmarks_m = self.kept_m(Condition.LANDMARKS)
        seen = Gaussian.of(analysis.turned_errors(landmarks_m, self.shift_m))

        by_integration = analysis.combined(own, seen).log_density(conflict_m)
        integrated = analysis.robust(by_integration)
        by_either = analysis.alternation_log_densities(conflict_m, own, seen, self.landmark_weight)
        alternated = analysis.robust(by_either)
        best = analysis.best_alternation_log_likelihood(conflict_m, own, seen)

        total = float(integrated.sum())
        differences = integrated - alternated
        is_likelier = integrated > alternated
        return {
            "landmark_weight": self.landmark_weight,
            "conflict_shift_m": self.shift_m,
            "conflict_followed_m": float(self.kept_m(Condition.CONFLICT)[:, 0].mean()),
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
    (outcome,) = measure_seeds(noise, budget, 1, conditions)
    return outcome


def measure_seeds(
    noise: Noise, budget: Budget, seeds: int, conditions: Sequence[Condition] = tuple(Condition)
) -> list[Outcome]:
    """Run the trials of each condition with as many `seeds`, from the budget's on: an outcome for
    each.
    """
    trials = []
    for seed in range(budget.seed, budget.seed + seeds):
        for number in range(budget.trials):
            trials.append(Trial(conditions[0], number, noise, seed, budget.rules))

    respond_in = partial(walk.responses, conditions=conditions)
    responses = parallel_map(respond_in, trials, budget.processes, budget.progress)
    shift_m = analysis.shift_m(trials)

    outcomes = []
    for begin in range(0, len(trials), budget.trials):
        own = trials[begin : begin + budget.trials]
        of_conditions = zip(*responses[begin : begin + budget.trials], strict=True)
        errors_m = {}
        first_look_m = {}
        for condition, found in zip(conditions, of_conditions, strict=True):
            placed = [response.position for response in found]
            first_looks = [response.first_look for response in found]
            errors_m[condition] = analysis.errors(own, placed)
            first_look_m[condition] = analysis.errors(own, first_looks)

        outcomes.append(Outcome(noise, errors_m, shift_m, first_look_m))

    return outcomes


def pooled(outcomes: Sequence[Outcome]) -> Outcome:
    """Return the trials of all seeds as one outcome."""
    first = outcomes[0]
    errors_m = {}
    first_look_m = {}
    for condition in first.errors_m:
        errors_m[condition] = np.concatenate([one.errors_m[condition] for one in outcomes])
    for condition in first.first_look_m:
        first_look_m[condition] = np.concatenate([one.first_look_m[condition] for one in outcomes])

    return replace(first, errors_m=errors_m, first_look_m=first_look_m)


def metrics_of_seeds(outcomes: Sequence[Outcome], first_seed: int) -> Metrics:
    """Return the metrics of all trials together, and `sd_both_over_optimal` of each seed: its mean
    over the seeds, and the share of the seeds within NEAR_OPTIMAL.
    """
    metrics = pooled(outcomes).metrics()
    ratios = np.array([outcome.both_over_optimal for outcome in outcomes])
    low, high = NEAR_OPTIMAL
    is_near = (ratios >= low) & (ratios <= high)
    supports = []
    for outcome in outcomes:
        over_alternation = outcome.conflict_metrics()["integration_over_alternation"]
        supports.append(over_alternation > 0)

    metrics["sd_both_over_optimal"] = float(ratios.mean())
    metrics["sd_both_over_optimal_within_share"] = float(is_near.mean())
    metrics["integration_likelier_share_of_seeds"] = float(np.mean(supports))
    metrics["seeds"] = float(len(outcomes))
    for seed, ratio in enumerate(ratios.tolist(), start=first_seed):
        metrics[f"sd_both_over_optimal_seed_{seed}"] = ratio

    return metrics


def fitted(start: Noise, budget: Budget) -> Noise:
    """Fit the noise of speed, turn rate and landmarks, beginning at `start`, to SD and RMSE of the
    published simulation with self-motion alone and with landmarks alone, by coordinate descent.

    Both cues together, and in conflict, are predictions then. The trials have another seed than any
    that are measured.
    """
    others = replace(budget, seed=FIT_SEED + budget.seed)

    @cache
    def cost(noise: Noise) -> float:
        outcome = measure(noise, others, FITTED_CONDITIONS)
        squared_m2 = 0.0
        for condition in FITTED_CONDITIONS:
            sd_difference_m = outcome.sd_m(condition) - published.SD_M[condition]
            rmse_difference_m = outcome.rmse_m(condition) - published.RMSE_M[condition]
            squared_m2 += sd_difference_m**2 + rmse_difference_m**2

        return squared_m2

    return coordinate_descent(cost, start, FIT_FACTORS, FITTED_NAMES)
