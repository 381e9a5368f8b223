"""How much what is seen of landmarks informs of where the agent is."""

from __future__ import annotations

import numpy as np
import pytest

from services.codelets.config import Config
from services.codelets.localization.measurement_model import (
    Sighting,
    compare,
    log_likelihood,
    novelty,
    sightings,
)
from tests.support.scenes import node, percept

CONFIG = Config()
NOW = np.array([0.5, 0.0])
AGENT_SD_M = 0.5


def _agent() -> np.ndarray:
    samples = np.zeros((2000, 7))
    samples[:, :2] = np.random.default_rng(0).normal(0.0, AGENT_SD_M, (2000, 2))
    return samples


def _seen(**placed: float) -> Sighting:
    """A house ten metres ahead, placed when path integration had the given variances."""
    where_m = np.random.default_rng(1).normal((10.0, 0.0), 0.1, (200, 2))
    house = node("object:house", where_m, label="house", sightings=5, **placed)
    found = sightings([percept("house")], [house], CONFIG, -1, NOW)
    assert found is not None
    return found


def test_a_landmark_placed_just_now_informs_of_nothing_new() -> None:
    seen = _seen(placed_variance_m2=0.5, placed_variance_rad2=0.0)
    assert novelty(_agent(), seen) == pytest.approx([0.0])


def test_a_landmark_informs_by_the_share_of_uncertainty_since_it_was_placed() -> None:
    since_m2 = 0.1
    seen = _seen(placed_variance_m2=0.5 - since_m2, placed_variance_rad2=0.0)
    assert novelty(_agent(), seen) == pytest.approx([since_m2 / AGENT_SD_M**2], rel=0.1)


def test_turns_since_a_landmark_was_placed_count_by_its_distance() -> None:
    seen = _seen(placed_variance_m2=0.5, placed_variance_rad2=-1e-3)
    assert novelty(_agent(), seen) == pytest.approx([1e-3 * 100 / (2 * AGENT_SD_M**2)], rel=0.1)


@pytest.mark.parametrize("placed", [{}, {"placed_variance_m2": -9.0, "placed_variance_rad2": 0.0}])
def test_a_surveyed_landmark_and_one_from_long_ago_inform_fully(placed: dict[str, float]) -> None:
    assert novelty(_agent(), _seen(**placed)) == pytest.approx([1.0])


def test_a_landmark_of_no_weight_leaves_all_samples_as_likely() -> None:
    density = compare(_agent(), _seen()).density
    assert np.ptp(log_likelihood(density, CONFIG.outlier_share)) > 1.0
    assert np.ptp(log_likelihood(density, CONFIG.outlier_share, np.zeros(1))) == 0.0
