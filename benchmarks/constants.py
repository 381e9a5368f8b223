"""How much results move if constants that were tuned are halved and doubled, on held-out cases."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import click
import msgspec
import numpy as np

from benchmarks.benchmark import PROCESSES, Setting
from benchmarks.perception.scenes import anywhere, drawn
from benchmarks.perception.stereo import off_share
from benchmarks.report import Metrics
from cogmap.cli.progress import bar
from cogmap.errors import CogmapError
from cogmap.experiments.ablation.town import TownDrive
from cogmap.experiments.city_maps.correction import HEADING
from cogmap.experiments.city_maps.drive import traverse
from cogmap.experiments.city_maps.measure import NOISE, configurations, jobs, map_error_km2
from cogmap.experiments.city_maps.sources import grown_environments
from cogmap.geometry.arrays import Singles
from cogmap.parallel import parallel_map
from cogmap.runtime.config import Sections
from cogmap.schemas.sensing import Calibration
from cogmap.services.codelets.public import CodeletsConfig
from cogmap.services.sensory.public import StereoMatcher, rectification

STEREO = "stereo"
TOWN = "town"
CITIES = "cities"
FIRST_SEED = 9901
SEEDS = 2
VIEWS = 8
MAX_OFF_PX = 0.5
NEAREST_M = 2.0
FARTHEST_M = 60.0
MAX_PX = 48.0
FACTORS = {"halved": 0.5, "doubled": 2.0}

# Chosen on rendered towns 9911 to 9913 and a pair of photographs.
OF_STEREO = ("MAX_STEP_PX", "MAX_JUMP_PX", "NOISE_GRADIENT", "PREFILTER_CAP", "REFINEMENTS")
# Chosen on towns and cities grown from small seeds.
OF_CODELETS = (
    "samples",
    "kept_samples",
    "landmark_samples",
    "landmark_jitter_m",
    "revisit_s",
    "closure_spacing_s",
    "path_variance_per_m",
    "heading_variance_per_m",
    "heading_variance_per_rad",
)
CONSTANTS = {STEREO: OF_STEREO, TOWN: OF_CODELETS, CITIES: OF_CODELETS}
OPTIONS = (
    click.Option(
        ["--only"],
        type=click.Choice([*CONSTANTS]),
        multiple=True,
        help="Just the constants measured there; repeatable.",
    ),
    click.Option(
        ["--seeds"],
        type=click.IntRange(1, 1000),
        default=SEEDS,
        show_default=True,
        help=f"How many towns and cities, from seed {FIRST_SEED} on.",
    ),
    PROCESSES,
)


@dataclass(frozen=True)
class Job:
    """A case with one constant multiplied; with none if it has no name."""

    domain: str
    seed: int
    constant: str = ""
    factor: float = 1.0


def measure(setting: Setting, *, only: Sequence[str] = (), seeds: int = SEEDS) -> Metrics:
    """Measure by how much errors move if a constant that was tuned is halved or doubled, on towns
    and cities that nothing was chosen on.

    Stereo: the share of pixels of rendered views that errs by more than half a pixel. Towns: the
    mean error of the estimate on laps, in metres. Cities: the error of the map of a tour, in km².
    `..._over_ours` is the mean over that with our constants. Takes some twenty minutes.
    """
    every = planned([name for name in CONSTANTS if not only or name in only], seeds)
    with bar("drives and views") as progress:
        errors = parallel_map(evaluate, every, setting.processes, progress)

    return summary(every, errors)


def planned(domains: Sequence[str], seeds: int) -> list[Job]:
    """Return every case as it is, then with each constant halved and doubled."""
    found = []
    for domain in domains:
        for seed in range(FIRST_SEED, FIRST_SEED + seeds):
            found.append(Job(domain, seed))
            for constant in CONSTANTS[domain]:
                found += [Job(domain, seed, constant, factor) for factor in FACTORS.values()]

    return found


def summary(every: Sequence[Job], errors: Sequence[float]) -> Metrics:
    """Return the mean errors by domain, and the ratios over them by constant."""
    by_change: dict[tuple[str, str, float], list[float]] = {}
    for job, error in zip(every, errors, strict=True):
        by_change.setdefault((job.domain, job.constant, job.factor), []).append(error)

    means = {change: float(np.mean(values)) for change, values in by_change.items()}
    words = {factor: word for word, factor in FACTORS.items()}
    metrics: Metrics = {}
    for (domain, constant, factor), mean in means.items():
        if constant:
            key = f"{domain}_{constant.lower()}_{words[factor]}_over_ours"
            metrics[key] = mean / means[domain, "", 1.0]
        else:
            metrics[f"{domain}_error"] = mean

    return metrics


def evaluate(job: Job) -> float:
    """Return the error of a case, NaN if it cannot be driven so."""
    try:
        return MEASURED_BY[job.domain](job)
    except CogmapError:
        return float("nan")


def _stereo_error(job: Job) -> float:
    shares = []
    with drawn(job.seed, 0, anywhere(VIEWS)) as (_, calibration, views), _constant(job):
        matcher = StereoMatcher(MAX_PX)
        straight = rectification(calibration)
        for view in views:
            found_px = matcher.disparity_px(*straight.apply(view.left, view.right))
            shares.append(off_share(found_px, _true_px(view.depth_m, calibration), MAX_OFF_PX))

    return float(np.mean(shares))


@contextmanager
def _constant(job: Job) -> Iterator[None]:
    """Let the stereo matcher have the constant of `job` multiplied for a while."""
    if not job.constant:
        yield
        return

    module = sys.modules[StereoMatcher.__module__]
    value = getattr(module, job.constant)
    setattr(module, job.constant, _multiplied(value, job.factor))
    try:
        yield
    finally:
        setattr(module, job.constant, value)


def _true_px(depth_m: Singles, calibration: Calibration) -> Singles:
    """Return the true disparities, 0 of what is too near or too far."""
    true_px = np.zeros(depth_m.shape, np.float32)
    is_known = (depth_m > NEAREST_M) & (depth_m < FARTHEST_M)
    focal_baseline = np.float32(calibration.fx_px * calibration.baseline_m)
    np.divide(focal_baseline, depth_m, out=true_px, where=is_known)
    return true_px


@dataclass(frozen=True)
class ChangedTown(TownDrive):
    """Laps with a setting of the codelets changed."""

    job: Job = Job(TOWN, FIRST_SEED)

    def sections(self, goals_m: list[tuple[float, float]]) -> Sections:
        """Return the configuration of every module."""
        return super().sections(goals_m) | {"codelets": _settings(self.job)}


def _town_error_m(job: Job) -> float:
    return ChangedTown(job.seed, job=job).drive({}).error


def _city_error_km2(job: Job) -> float:
    places = grown_environments(1, job.seed)
    (tour,) = jobs(places, NOISE, 1, job.seed)
    configured = configurations(tour)[HEADING]
    codelets = configured["codelets"] | _settings(job)
    traversal = traverse({**configured, "codelets": codelets})
    return map_error_km2(traversal.buildings_m, places[0].buildings_m)


def _settings(job: Job) -> dict[str, float]:
    """Return the setting of the codelets that `job` changes."""
    if not job.constant:
        return {}

    value = msgspec.structs.asdict(CodeletsConfig())[job.constant]
    return {job.constant: _multiplied(value, job.factor)}


def _multiplied(value: float, factor: float) -> float:
    """Return a number multiplied; one that counts something stays whole."""
    return max(1, round(factor * value)) if isinstance(value, int) else factor * value


MEASURED_BY = {STEREO: _stereo_error, TOWN: _town_error_m, CITIES: _city_error_km2}
