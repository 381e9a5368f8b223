"""The rules by which a walker localizes, step by step: by spikes, by samples, and exactly.

By spikes: path integration moves the phases of the grid cells, one position a cycle; place cells
fire where the border cells of the walls in reach coincide with them; the phases are reset to that
firing, each cycle's to one spike (`spikes`), or all to where the spikes are on average
(`spikes_from_mean`, as the samples of the paper's table 1 start from theirs). By samples, as many
as there are cycles, the same two ways: plain rejection (`samples`, `samples_from_mean`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from cogmap.estimation.spiking.coincidence import fire
from cogmap.experiments.spiking.network import Border
from cogmap.experiments.spiking.posterior import GridPosterior, binned, total_variation
from cogmap.experiments.spiking.room import START_SD_M, Walk, walk
from cogmap.geometry.arrays import Floats, Singles
from cogmap.services.codelets.localization.sampling import resample
from cogmap.services.codelets.localization.spiking_rule import MIN_SPIKES
from cogmap.services.codelets.public import rejection_mask

Borders = tuple[Border, ...]
Correct = Callable[[Floats, Borders, np.random.Generator], Floats]
DRAWN = "drawn_from_exact"
"""As many samples of the exact posterior as there are spikes: how far a distribution is from it by
chance alone."""


@dataclass(frozen=True)
class Rule:
    """How samples are corrected, and whether those of the next step start from their mean."""

    correct: Correct
    from_mean: bool


@dataclass(frozen=True)
class Track:
    """A rule's estimates (n, 2) of a walk, and beside the exact posterior of each step (n,): its
    total variation distance, the error of its mean in exact standard deviations, its standard
    deviation over the exact one, and how many samples it has.
    """

    mean_m: Floats
    distance: Floats
    mean_error_sd: Floats
    sd_ratio: Floats
    samples: Floats


@dataclass(frozen=True)
class Measured:
    """A walk, the tracks of all rules, the exact means (n, 2) and standard deviations (n,) of its
    steps, and where path integration alone leads, (n, 2).
    """

    walk: Walk
    tracks: dict[str, Track]
    exact_m: Floats
    exact_sd_m: Floats
    alone_m: Floats


def by_spikes(samples_m: Floats, borders: Borders, rng: np.random.Generator) -> Floats:
    """Return the places of the place cells that fire, (k, 2), one for each spike; all samples if
    hardly any does.
    """

    def tuning(places_m: Floats) -> Singles:
        share = [_likelihood(places_m, border) for border in borders]
        return np.array(share, np.float32)

    spikes_m = fire(samples_m, tuning, rng)
    return spikes_m if len(spikes_m) >= MIN_SPIKES else samples_m


def by_rejection(samples_m: Floats, borders: Borders, rng: np.random.Generator) -> Floats:
    """Return those of (n, 2) samples that rejection keeps."""
    likelihood = np.ones(len(samples_m))
    for border in borders:
        likelihood *= _likelihood(samples_m, border)

    kept_m: Floats = samples_m[rejection_mask(np.log(likelihood.clip(1e-300)), rng)]
    return kept_m


RULES: Mapping[str, Rule] = {
    "spikes": Rule(by_spikes, from_mean=False),
    "samples": Rule(by_rejection, from_mean=False),
    "spikes_from_mean": Rule(by_spikes, from_mean=True),
    "samples_from_mean": Rule(by_rejection, from_mean=True),
}


def measured(seed: int, steps: int, cycles: int) -> Measured:
    """Localize along the walk of a seed by every rule, with `cycles` gamma cycles or samples a
    step.
    """
    walked = walk(seed, steps)
    posteriors = _Exact.along(walked)
    tracks = {}
    for number, (name, rule) in enumerate(RULES.items()):
        rng = np.random.default_rng([seed, 1, number])
        tracks[name] = posteriors.compare(_localized(walked, rule, cycles, rng))

    rng = np.random.default_rng([seed, 2])
    counts = tracks["spikes"].samples.astype(int)
    drawn_m = [each.draw(count, rng) for each, count in zip(posteriors.steps, counts, strict=True)]
    tracks[DRAWN] = posteriors.compare(drawn_m)

    return Measured(
        walk=walked,
        tracks=tracks,
        exact_m=posteriors.mean_m,
        exact_sd_m=posteriors.sd_m,
        alone_m=walked.start_m + np.cumsum(walked.moved_m, axis=0),
    )


@dataclass(frozen=True)
class _Exact:
    """The exact posterior of every step, its mean (n, 2), and the root of the mean variance along x
    and y, (n,).
    """

    steps: list[GridPosterior]
    mean_m: Floats
    sd_m: Floats

    @classmethod
    def along(cls, walked: Walk) -> _Exact:
        """Compute it along a walk."""
        steps = []
        mean_m = []
        sd_m = []
        posterior = GridPosterior.about(walked.start_m)
        for number, borders in enumerate(walked.borders):
            posterior = posterior.moved(walked.moved_m[number], walked.covariance_m2[number])
            for border in borders:
                posterior = posterior.corrected(border)

            middle_m, covariance_m2 = posterior.moments()
            steps.append(posterior)
            mean_m.append(middle_m)
            sd_m.append(_sd_m(covariance_m2))

        return cls(steps, np.array(mean_m), np.array(sd_m))

    def compare(self, samples_m: list[Floats]) -> Track:
        """Compare the samples (k, 2) of each step with it."""
        middles_m = np.array([each.mean(axis=0) for each in samples_m])
        sds_m = np.array([_sd_m(np.cov(each, rowvar=False)) for each in samples_m])
        distances = [
            total_variation(step.binned(), binned(each))
            for step, each in zip(self.steps, samples_m, strict=True)
        ]
        offsets_m = np.hypot(*(middles_m - self.mean_m).T)

        return Track(
            mean_m=middles_m,
            distance=np.array(distances),
            mean_error_sd=offsets_m / self.sd_m,
            sd_ratio=sds_m / self.sd_m,
            samples=np.array([float(len(each)) for each in samples_m]),
        )


def _sd_m(covariance_m2: Floats) -> float:
    """Return the root of the mean variance along x and y."""
    return float(np.sqrt(np.trace(covariance_m2) / 2))


def _localized(walked: Walk, rule: Rule, cycles: int, rng: np.random.Generator) -> list[Floats]:
    """Return the samples (k, 2) after each step of a walk."""
    samples_m = rng.normal(walked.start_m, START_SD_M, (cycles, 2))
    after_m = []
    for number, borders in enumerate(walked.borders):
        moved_m = walked.moved_m[number]
        noise_m = rng.multivariate_normal(moved_m, walked.covariance_m2[number], cycles)
        samples_m = resample(samples_m, cycles, 0.0, rng) + noise_m
        if borders:
            samples_m = rule.correct(samples_m, borders, rng)

        after_m.append(samples_m)
        if rule.from_mean:
            samples_m = samples_m.mean(axis=0, keepdims=True)

    return after_m


def _likelihood(places_m: Floats, border: Border) -> Floats:
    """Compute how likely a sensed wall is from (n, 2) places, 1 at most."""
    deviations = (places_m[:, border.axis] - border.sensed_m) / border.sd_m
    likelihood: Floats = np.exp(-(deviations**2) / 2)
    return likelihood
