"""The figures of the experiment as one flat object."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from experiments.city_maps import published
from experiments.city_maps.drive import SENSING
from experiments.city_maps.measure import FELT, CityMap, Learned
from services.sim.odometry import Noise

NAMES = {
    FELT: "path_integration",
    "none": "uncorrected",
    "positions": "positions",
    "heading": "corrected",
}


def figures(maps: Sequence[CityMap], noise: Noise) -> dict[str, float | str]:
    """Every figure that is printed or drawn.

    `error_corrected_over_uncorrected` is the mean over the maps of each one's ratio of mean errors.
    Corrected is with headings, beyond the paper; `positions` is the paper's own rule. Uncorrected
    is the map of an agent that knows landmarks again but closes no loops; `path_integration` what
    it would have if it did not even know them again.
    """
    errors = {
        name: np.array([each.error_km2(method) for each in maps]) for method, name in NAMES.items()
    }
    ratios = {name: errors[name] / errors["uncorrected"] for name in ("corrected", "positions")}
    found: dict[str, float | str] = {
        f"error_{name}_over_uncorrected": float(ratio.mean()) for name, ratio in ratios.items()
    }
    found["error_corrected_over_path_integration"] = float(
        (errors["corrected"] / errors["path_integration"]).mean()
    )
    for name, values in errors.items():
        found[f"error_{name}_km2"] = float(values.mean())
        found[f"error_{name}_sd_km2"] = float(values.std())
        found[f"growth_{name}_km2_per_km"] = growth(maps, values)
    found |= {
        "maps": float(len(maps)),
        "traversals": float(len(maps[0].learned)),
        "buildings_missing": float(sum(one.missing for each in maps for one in each.learned)),
        "noise_speed": noise.speed,
        "noise_turn": noise.turn,
        "noise_drift_rad_per_sqrt_m": noise.drift_rad_per_sqrt_m,
        "published_human_mean_km2": published.HUMAN_MEAN_KM2,
        "published_human_sd_km2": published.HUMAN_SD_KM2,
        "published_model_mean_km2": published.MODEL_MEAN_KM2,
        "published_model_sd_km2": published.MODEL_SD_KM2,
        "sensing": SENSING,
    }
    for number, each in enumerate(maps, start=1):
        found |= {
            f"map_{number:02d}_name": each.environment.name,
            f"map_{number:02d}_area_km2": each.environment.area_km2,
            f"map_{number:02d}_tour_km": each.environment.tour_m / 1e3,
        }
        found |= {
            f"map_{number:02d}_error_{name}_km2": float(values[number - 1])
            for name, values in errors.items()
        }
    return found


def camera_figures(seen: Learned, told: Learned) -> dict[str, float | str]:
    """Those of one traversal with cameras, and of the same one where it was told percepts."""
    found: dict[str, float | str] = {"cameras_traversals": 1.0}
    for method, name in NAMES.items():
        found[f"cameras_error_{name}_km2"] = seen.error_km2[method]
        found[f"cameras_same_traversal_by_percepts_error_{name}_km2"] = told.error_km2[method]
    for name in ("corrected", "positions"):
        ratio = found[f"cameras_error_{name}_km2"] / found["cameras_error_uncorrected_km2"]  # type: ignore[operator]
        found[f"cameras_error_{name}_over_uncorrected"] = ratio
    return found | {"cameras_buildings_missing": float(seen.missing)}


def growth(
    maps: Sequence[CityMap], errors_km2: np.ndarray[tuple[int], np.dtype[np.float64]]
) -> float:
    """By how many km^2 the error grows for a kilometre of tour: a straight line's slope, 0 for a
    single map.
    """
    length = np.array([each.environment.tour_m / 1e3 for each in maps])
    off = length - length.mean()
    return float(off @ errors_km2 / (off @ off)) if off @ off > 0 else 0.0
