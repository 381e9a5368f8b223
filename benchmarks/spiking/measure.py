"""Cue integration by spikes against Bayes' rule, over cues drawn at random."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np

from benchmarks.benchmark import PROCESSES, Setting
from benchmarks.report import Metrics
from benchmarks.threshold import at_most, within
from cogmap.cli.experiment.results import save_figure
from cogmap.cli.progress import bar
from cogmap.estimation.spiking.cells import Values
from cogmap.experiments.spiking.network import Border, Cues, Posterior, Recording, exact, record
from cogmap.parallel import parallel_map
from cogmap.services.codelets.public import rejection_mask

SIDE_M = 5.0
RECORDED_S = 600.0
SCENES = 40
SEED = 1
MIDDLE_M = (1.6, 3.4)
PRIOR_SD_M = (0.25, 0.5)
MAX_CORRELATION = 0.6
BORDER_SD_M = (0.15, 0.4)
SENSED_AXES = ((0,), (1,), (0, 1))
SAMPLES = 20_000
THRESHOLDS = {
    "posterior_sd_ratio": within(0.9, 1.1),
    "posterior_mean_error": at_most(0.1),
}


OPTIONS = (
    click.Option(
        ["--seed"],
        type=click.IntRange(0, 2**16),
        default=SEED,
        show_default=True,
        help="Which scenes.",
    ),
    PROCESSES,
    click.Option(
        ["--figure", "folder"],
        type=click.Path(file_okay=False, exists=True, path_type=Path),
        metavar="FOLDER",
        help="Draw figure 4 there too, spiking.png and spiking.pdf.",
    ),
)


@dataclass(frozen=True)
class Scene:
    """Cues, and the posterior by Bayes' rule, by place cells' spikes, which are counted in
    `spikes`, and by rejection of samples.
    """

    cues: Cues
    exact: Posterior
    spiking: Posterior
    rejection: Posterior
    spikes: int


def cues(seed: int) -> Cues:
    """Draw a walk's end somewhere in the middle of a room, and one or two walls whose distance is
    sensed.
    """
    rng = np.random.default_rng([seed, 0])
    x_m, y_m = rng.uniform(*MIDDLE_M, 2).tolist()

    # That of path integration: correlated standard deviations.
    x_sd_m, y_sd_m = rng.uniform(*PRIOR_SD_M, 2).tolist()
    across_m2 = float(rng.uniform(-MAX_CORRELATION, MAX_CORRELATION)) * x_sd_m * y_sd_m
    covariance_m2 = ((x_sd_m**2, across_m2), (across_m2, y_sd_m**2))
    true_m = rng.multivariate_normal((x_m, y_m), covariance_m2)

    axes = SENSED_AXES[seed % len(SENSED_AXES)]
    sds_m = rng.uniform(*BORDER_SD_M, 2).tolist()
    borders = []
    for axis in axes:
        sensed_m = float(rng.normal(true_m[axis], sds_m[axis]))
        borders.append(Border(axis, sensed_m, sds_m[axis]))

    return Cues((x_m, y_m), covariance_m2, tuple(borders))


def recording(seed: int) -> Recording:
    """Record the spikes of the scene of that seed."""
    rng = np.random.default_rng([seed, 1])
    return record(cues(seed), SIDE_M, RECORDED_S, rng)


def scene(seed: int) -> Scene:
    """Record one scene and compare its posteriors."""
    given = cues(seed)
    spikes = recording(seed)

    # The localization codelet's own rejection of samples.
    rng = np.random.default_rng([seed, 2])
    samples = rng.multivariate_normal(given.mean_m, given.covariance_m2, SAMPLES)
    log_likelihood = np.zeros(SAMPLES)
    for border in given.borders:
        log_likelihood -= ((samples[:, border.axis] - border.sensed_m) / border.sd_m) ** 2 / 2
    kept = samples[rejection_mask(log_likelihood, rng)]

    return Scene(
        cues=given,
        exact=exact(given),
        spiking=spikes.posterior,
        rejection=Posterior(kept.mean(axis=0), np.cov(kept, rowvar=False)),
        spikes=int(spikes.counts.sum()),
    )


def measure(setting: Setting, *, seed: int = SEED, folder: Path | None = None) -> Metrics:
    """Measure the posterior that spikes of place cells give, and that by rejection sampling,
    against the exact one.

    Scenes with cues drawn at random: a position by path integration, and the distance to one or two
    walls. A ratio is of standard deviations along x and y, an error is of the mean in exact
    standard deviations.
    """
    seeds = range(seed * SCENES, (seed + 1) * SCENES)
    with bar("recording") as progress:
        scenes = parallel_map(scene, seeds, setting.processes, progress)

    if folder is not None:
        from benchmarks.spiking.figure import figure  # matplotlib takes long to import

        for path in save_figure(folder, "spiking", figure(scenes, seeds)):
            setting.announce(str(path))

    return metrics(scenes)


def metrics(scenes: list[Scene]) -> Metrics:
    """Compute ratios of standard deviations, along x and y; errors of means in exact SDs."""
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
    """Compare pairs of the exact posterior and another."""
    ratios: Values = np.array([other.sd_m / exact.sd_m for exact, other in pairs])
    errors = np.array([exact.off(other.mean_m) for exact, other in pairs])

    return {
        f"{name}_sd_ratio": float(ratios.mean()),
        f"{name}_sd_ratio_least": float(ratios.min()),
        f"{name}_sd_ratio_most": float(ratios.max()),
        f"{name}_mean_error": float(errors.mean()),
        f"{name}_mean_error_most": float(errors.max()),
    }
