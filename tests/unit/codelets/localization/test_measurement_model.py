"""How much what is seen of landmarks informs of where the agent is."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.schemas.nodes import NEVER_NS
from cogmap.services.codelets.localization.information import new_share, variances_at
from cogmap.services.codelets.localization.measurement_model import (
    Measurements,
    compare,
    log_likelihood,
    measurements,
)
from cogmap.services.codelets.mapping.path import segments
from cogmap.testing import graph_of, landmark, percept

RANGE_M = 10.0
AGENT_SD_M = 0.5


def _agent() -> np.ndarray:
    rng = np.random.default_rng(0)
    samples = np.zeros((2000, 7))
    samples[:, :2] = rng.normal(0.0, AGENT_SD_M, (2000, 2))
    return samples


def _seen() -> Measurements:
    """A house ten metres ahead."""
    rng = np.random.default_rng(1)
    where_m = rng.normal((RANGE_M, 0.0), 0.1, (200, 2))
    graph = graph_of(landmark("house", where_m, sightings=5))

    found = measurements([percept("house")], graph, NEVER_NS)
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("since", "share"),
    [
        ((0.0, 0.0), 0.0),
        ((0.1, 0.0), 0.1 / AGENT_SD_M**2),
        ((0.0, 1e-3), 1e-3 * RANGE_M**2 / (2 * AGENT_SD_M**2)),
        ((9.0, 0.0), 1.0),
        ((math.inf, math.inf), 1.0),
    ],
    ids=["just now", "distance since", "turns since", "long ago", "before the path"],
)
def test_a_landmark_informs_by_the_uncertainty_since_it_was_placed(
    since: tuple[float, float], share: float
) -> None:
    found = new_share(_agent(), _seen(), np.array([since]))

    assert found == pytest.approx([share], rel=0.1)


def test_the_variance_when_a_landmark_was_placed_is_that_of_the_path() -> None:
    rows = np.zeros((100, 11))
    rows[:, 0] = np.arange(1.0, 101.0)
    rows[:, 7] = np.arange(100.0)
    path = segments(rows)

    between = variances_at(path, 70_500_000_000)
    after = variances_at(path, 500_000_000_000)
    before = variances_at(path, 500_000_000)
    without_path = variances_at([], 1)

    assert between == (69.0, 0.0)
    assert after == (99.0, 0.0)
    assert before == (-math.inf, -math.inf)
    assert without_path == (-math.inf, -math.inf)


def test_a_landmark_of_no_weight_leaves_all_samples_as_likely() -> None:
    density = compare(_agent(), _seen()).density

    weighted = log_likelihood(density)
    weightless = log_likelihood(density, np.zeros(1))

    assert np.ptp(weighted) > 1.0
    assert np.ptp(weightless) == 0.0
