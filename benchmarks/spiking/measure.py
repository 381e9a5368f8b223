"""Cue integration by spikes against Bayes' rule, over cues drawn at random."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.report import Metrics
from benchmarks.threshold import at_most, within
from cogmap.parallel import Progress, parallel_map
from experiments.spiking.cells import Values
from experiments.spiking.network import Border, Cues, Posterior, Recording, exact, record
from services.codelets.localization.sampling import rejection_mask

SIDE_M = 5.0
RECORDED_S = 600.0
SCENES = 40
SEED = 1
PRIOR_SD_M = (0.25, 0.5)
BORDER_SD_M = (0.15, 0.4)
THRESHOLDS = {
    "posterior_sd_ratio": within(0.9, 1.1),
    "posterior_mean_error": at_most(0.1),
}


@dataclass(frozen=True)
class Scene:
    """Cues, what the exact posterior is, what place cells' spikes say, and what rejection of
    samples says.
    """

    cues: Cues
    exact: Posterior
    spiking: Posterior
    rejection: Posterior
    spikes: int


def cues(seed: int) -> Cues:
    """A walk's end somewhere in the middle of a room, and one or two walls whose distance is
    sensed.
    """
    rng = np.random.default_rng([seed, 0])
    mean = rng.uniform(1.6, 3.4, 2)
    sds = rng.uniform(*PRIOR_SD_M, 2)
    correlation = rng.uniform(-0.6, 0.6)
    across = float(correlation * sds[0] * sds[1])
    covariance = ((float(sds[0] ** 2), across), (across, float(sds[1] ** 2)))
    true_m = rng.multivariate_normal(mean, covariance)
    axes = ((0,), (1,), (0, 1))[seed % 3]
    sd_m = rng.uniform(*BORDER_SD_M, 2)
    borders = tuple(
        Border(axis, float(rng.normal(true_m[axis], sd_m[axis])), float(sd_m[axis]))
        for axis in axes
    )
    return Cues((float(mean[0]), float(mean[1])), covariance, borders)


def recording(seed: int) -> Recording:
    """The spikes of the scene of that seed."""
    return record(cues(seed), SIDE_M, RECORDED_S, np.random.default_rng([seed, 1]))


def scene(seed: int) -> Scene:
    """One scene, recorded and compared."""
    given = cues(seed)
    spikes = recording(seed)
    return Scene(
        given, exact(given), spikes.posterior, _rejection(given, seed), int(spikes.counts.sum())
    )


def _rejection(given: Cues, seed: int) -> Posterior:
    """The posterior by the localization codelet's own rejection of samples."""
    rng = np.random.default_rng([seed, 2])
    samples = rng.multivariate_normal(given.mean_m, given.covariance_m2, 20_000)
    squared = [((samples[:, each.axis] - each.sensed_m) / each.sd_m) ** 2 for each in given.borders]
    kept = samples[rejection_mask(-np.sum(squared, axis=0) / 2, rng)]
    return Posterior(kept.mean(axis=0), np.cov(kept, rowvar=False))


def seeds(seed: int) -> list[int]:
    """Those of the SCENES scenes."""
    return [seed * SCENES + number for number in range(SCENES)]


def measure(seed: int, processes: int, progress: Progress = lambda share: None) -> list[Scene]:
    """SCENES scenes, the same for the same seed."""
    return parallel_map(scene, seeds(seed), processes, progress)


def metrics(scenes: list[Scene]) -> Metrics:
    """Ratios of standard deviations, along x and y; errors of means in exact SDs."""
    spiking = [(scene.exact, scene.spiking) for scene in scenes]
    rejection = [(scene.exact, scene.rejection) for scene in scenes]
    spikes = [scene.spikes for scene in scenes]

    return {
        **_compared("posterior", spiking),
        **_compared("rejection", rejection),
        "place_spikes_a_scene": float(np.median(spikes)),
        "recorded_s": RECORDED_S,
        "scenes": float(len(scenes)),
    }


def _compared(name: str, pairs: list[tuple[Posterior, Posterior]]) -> Metrics:
    """Of pairs of the exact posterior and another."""
    ratios: Values = np.array([other.sd_m / exact.sd_m for exact, other in pairs])
    errors = [exact.off(other.mean_m) for exact, other in pairs]

    return {
        f"{name}_sd_ratio": float(ratios.mean()),
        f"{name}_sd_ratio_least": float(ratios.min()),
        f"{name}_sd_ratio_most": float(ratios.max()),
        f"{name}_mean_error": float(np.mean(errors)),
        f"{name}_mean_error_most": float(np.max(errors)),
    }
