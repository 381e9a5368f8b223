"""The metrics of the experiment as one flat object."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from cogmap.experiments.city_maps import published
from cogmap.experiments.city_maps.correction import HEADING, METHODS, POSITIONS
from cogmap.experiments.city_maps.drive import SENSING
from cogmap.experiments.city_maps.fit import Fit
from cogmap.experiments.city_maps.measure import CityMap, Learned
from cogmap.experiments.city_maps.observer import FUSED, WHEELS
from cogmap.services.sim.odometry import Noise
from cogmap.services.sim.trajectory import Drawn

# Of what was learned, how it is named: by wheels alone, without closing loops, by the paper's own
# rule, and by ours, which corrects headings too.
NAMES = {
    WHEELS: "wheels_alone",
    "none": "uncorrected",
    "positions": "positions",
    "heading": "corrected",
}
CAMERA_NAMES = NAMES | {FUSED: "fused_alone"}
Errors = npt.NDArray[np.float64]
Metrics = dict[str, float | str]


def map_metrics(maps: Sequence[CityMap], noise: Noise) -> Metrics:
    """Return every metric that is printed or drawn.

    `error_corrected_over_uncorrected` is the mean over the maps of each one's ratio of mean errors.
    Corrected is with headings, beyond the paper; `positions` corrects these alone, by reverse
    replay or, with the paper's rules, by eq. 9 as it is printed. Uncorrected
    is the map of an agent that recognises landmarks but closes no loops; `wheels_alone` the map by
    path integration alone, which without images is that of fused self-motion, too.
    """
    metrics: Metrics = {}
    errors_km2 = {}
    for method, name in NAMES.items():
        errors_km2[name] = np.array([city.error_km2(method) for city in maps])

    for name in ("corrected", "positions"):
        ratio = errors_km2[name] / errors_km2["uncorrected"]
        metrics[f"error_{name}_over_uncorrected"] = float(ratio.mean())
    over_wheels = errors_km2["corrected"] / errors_km2["wheels_alone"]
    metrics["error_corrected_over_fused_alone"] = float(over_wheels.mean())
    metrics["error_fused_alone_km2"] = float(errors_km2["wheels_alone"].mean())

    for name, values_km2 in errors_km2.items():
        metrics[f"error_{name}_km2"] = float(values_km2.mean())
        metrics[f"error_{name}_sd_km2"] = float(values_km2.std())
        metrics[f"growth_{name}_km2_per_km"] = growth(maps, values_km2)

    for method in METHODS:
        aligned_km2 = np.mean([city.aligned_error_km2(method) for city in maps])
        metrics[f"error_{NAMES[method]}_aligned_km2"] = float(aligned_km2)

    metrics |= {
        "maps": float(len(maps)),
        "traversals": float(len(maps[0].learned)),
        "buildings_missing": float(sum(one.missing for city in maps for one in city.learned)),
        "noise_speed": noise.speed,
        "noise_turn": noise.turn,
        "noise_drift_rad_per_sqrt_m": noise.drift_rad_per_sqrt_m,
        "published_human_mean_km2": published.HUMAN_MEAN_KM2,
        "published_human_sd_km2": published.HUMAN_SD_KM2,
        "published_model_mean_km2": published.MODEL_MEAN_KM2,
        "published_model_sd_km2": published.MODEL_SD_KM2,
        "sensing": SENSING,
        "self_motion": "wheels",
    }

    for number, city in enumerate(maps, start=1):
        prefix = f"map_{number:02d}"
        metrics[f"{prefix}_name"] = city.environment.name
        metrics[f"{prefix}_area_km2"] = city.environment.area_km2
        metrics[f"{prefix}_tour_km"] = city.environment.tour_m / 1e3
        for method, name in NAMES.items():
            metrics[f"{prefix}_error_{name}_km2"] = city.error_km2(method)
        for method in METHODS:
            key = f"{prefix}_error_{NAMES[method]}_aligned_km2"
            metrics[key] = city.aligned_error_km2(method)

    return metrics


def fit_metrics(maps: Sequence[CityMap], fits: Mapping[Drawn, Fit], fitted_maps: int) -> Metrics:
    """Return how the errors of the `maps` that the noise was not fitted to compare with people's:
    ratios of mean errors, with standard errors `_se`.

    `paper` is of agents whose positions alone are corrected, `ours` of those whose headings are
    too. `rule` is of the paper's rule without any percept, by which the noise was fitted: drawn
    anew each `view`, or alike for all views of a `leg`; `noise_drawn` is which the agents had.
    """
    people_km2 = published.HUMAN_MEAN_KM2
    people = np.full(len(maps), people_km2)
    paper_km2 = np.array([city.error_km2(POSITIONS) for city in maps])
    ours_km2 = np.array([city.error_km2(HEADING) for city in maps])
    paper_aligned_km2 = np.array([city.aligned_error_km2(POSITIONS) for city in maps])
    ours_aligned_km2 = np.array([city.aligned_error_km2(HEADING) for city in maps])
    metrics: Metrics = {
        **_ratio("paper_over_people", paper_km2, people),
        **_ratio("ours_over_paper", ours_km2, paper_km2),
        **_ratio("paper_aligned_over_people", paper_aligned_km2, people),
        **_ratio("ours_aligned_over_paper_aligned", ours_aligned_km2, paper_aligned_km2),
        "split": "by name: the first, third and so on fitted to, the others tested",
        "maps_fitted": float(fitted_maps),
        "maps_tested": float(len(maps)),
    }

    for drawn, fit in fits.items():
        metrics |= {
            f"noise_speed_by_{drawn}": fit.noise.speed,
            f"noise_turn_by_{drawn}": fit.noise.turn,
            f"rule_by_{drawn}_fitted_over_people": fit.fitted_km2 / people_km2,
            f"rule_by_{drawn}_over_people": fit.tested_km2 / people_km2,
        }

    return metrics


def drive_metrics(maps: Sequence[CityMap]) -> Metrics:
    """Return how agents that drove themselves came to their goals, by method: goals and buildings
    reached and given, the way driven over that of the tour as far as it was driven, on the mean
    over the drives that reached a goal, how many drives ended by time before the last goal, and how
    many with an agent that took itself for lost.

    Each drive that ended so has a key of its own, with its map and its number.
    """
    metrics: Metrics = {"agents": "driven"}
    for method in METHODS:
        name = NAMES[method]
        outcomes = [one.outcomes[method] for city in maps for one in city.learned]
        ways = [each.driven_m / each.tour_m for each in outcomes if each.tour_m > 0]
        metrics |= {
            f"goals_reached_{name}": float(sum(each.stops for each in outcomes)),
            f"buildings_reached_{name}": float(sum(each.buildings for each in outcomes)),
            f"way_over_tour_{name}": float(np.mean(ways)) if ways else float("nan"),
            f"drives_unfinished_{name}": float(sum(not each.is_finished for each in outcomes)),
            f"drives_lost_{name}": float(sum(each.is_lost for each in outcomes)),
            f"drive_{name}_s": float(np.mean([each.duration_s for each in outcomes])),
        }

    # All methods are given the same goals.
    metrics["goals_given"] = float(sum(each.stops_given for each in outcomes))
    metrics["buildings_given"] = float(sum(each.buildings_given for each in outcomes))
    for map_number, city in enumerate(maps, start=1):
        for number, one in enumerate(city.learned, start=1):
            for method, each in one.outcomes.items():
                key = f"map_{map_number:02d}_traversal_{number:02d}_{NAMES[method]}"
                if not each.is_finished:
                    ended = f"{each.stops} of {each.stops_given} goals when its time was up"
                    metrics[f"{key}_unfinished"] = ended
                if each.is_lost:
                    metrics[f"{key}_lost"] = "took itself for lost in the end"

    return metrics


def _ratio(name: str, above: Errors, below: Errors) -> Metrics:
    """Return the ratio of two means over the maps, and its standard error `_se`, by how much the
    maps differ, to first order; 0 for one map.
    """
    mean = float(below.mean())
    ratio = float(above.mean()) / mean
    residual = above - ratio * below
    spread = float(residual.std(ddof=1)) if len(above) > 1 else 0.0
    return {name: ratio, f"{name}_se": spread / mean / len(above) ** 0.5}


def camera_metrics(drawn: Learned, percepts: Learned) -> Metrics:
    """Return the metrics of one traversal with cameras, and of the same one at percept level.

    With cameras self-motion is fused: `fused_alone` is path integration of that alone.
    """
    metrics: Metrics = {"cameras_traversals": 1.0}
    errors_km2 = drawn.error_km2

    for method, name in CAMERA_NAMES.items():
        metrics[f"cameras_error_{name}_km2"] = errors_km2[method]
        percepts_km2 = percepts.error_km2.get(method)
        if percepts_km2 is not None:
            metrics[f"cameras_same_traversal_by_percepts_error_{name}_km2"] = percepts_km2

    for method in ("heading", "positions"):
        ratio = errors_km2[method] / errors_km2["none"]
        metrics[f"cameras_error_{NAMES[method]}_over_uncorrected"] = ratio

    over_fused = errors_km2[HEADING] / errors_km2[FUSED]
    metrics["cameras_error_corrected_over_fused_alone"] = over_fused
    metrics["cameras_buildings_missing"] = float(drawn.missing)
    return metrics


def growth(maps: Sequence[CityMap], errors_km2: Errors) -> float:
    """Return by how many km^2 the error grows for a kilometre of tour: a line's slope, 0 for one
    map.
    """
    length_km = np.array([city.environment.tour_m / 1e3 for city in maps])
    centred_km = length_km - length_km.mean()
    variation = float(centred_km @ centred_km)

    if variation == 0:
        return 0.0

    covariation = centred_km @ errors_km2
    return float(covariation / variation)
