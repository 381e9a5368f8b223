"""The paper's own localization (§5.4, eq. 1-4, table 1), by hand-worked numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.geometry.arrays import Floats
from cogmap.schemas.nodes import Object
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.localization import paper_rule
from cogmap.services.codelets.localization.measurement_model import Measurements
from cogmap.services.codelets.localization.motion_model import COLUMNS
from cogmap.testing import agent, graph_of, landmark, percept, task
from tests.support.world.landmarks import house, localized, motions, pose_of, samples_of
from tests.support.world.scenes import run

CONFIG = Config(localization="paper", samples=4000)
COUNT = 20_000
FACTOR = math.exp(-0.5)
"""The likelihood of what errs by one standard deviation, over that of what is exact."""


def _at(*x_m: float) -> Floats:
    """Samples of a pose that looks along x, COUNT at each of these positions."""
    samples = np.zeros((len(x_m) * COUNT, COLUMNS))
    samples[:, 0] = np.repeat(x_m, COUNT)
    return samples


def _ten_metres_ahead(*landmarks_x_m: float) -> Measurements:
    """Landmarks on the x axis, known exactly, each seen at a range of 10 +- 1 m, without a
    bearing.
    """
    count = len(landmarks_x_m)
    return Measurements(
        labels=tuple(str(number) for number in range(count)),
        mean_m=np.column_stack([landmarks_x_m, np.zeros(count)]),
        covariance_m2=np.zeros((count, 2, 2)),
        bearing_rad=np.zeros(count),
        range_m=np.full(count, 10.0),
        bearing_sd_rad=np.full(count, 4.0),
        range_sd_m=np.ones(count),
        certainty=np.ones(count),
    )


def test_samples_start_again_from_their_mean_at_each_step() -> None:
    apart = agent([(0.0, 0.0, 0.0)] * 100 + [(2.0, 0.0, 0.0)] * 100)
    found = localized(apart, config=CONFIG, motions=motions((3.0, 0.0, 1.0, 0.0, 0.0)))

    assert samples_of(found) == pytest.approx(np.tile((4.0, 0.0, 0.0), (4000, 1)))


def test_noise_multiplies_the_rates_with_a_mean_of_one() -> None:
    row = (4.0, 0.5, 1.0, 0.4, 0.1)
    driven = paper_rule.moved(_at(0.0), np.array([row]), CONFIG, np.random.default_rng(1))

    assert driven[:, 2].mean() == pytest.approx(0.5, abs=0.01)
    assert driven[:, 2].std() == pytest.approx(0.1, rel=0.05)
    assert np.hypot(*driven[:, :2].T).mean() == pytest.approx(4.0, abs=0.03)
    assert np.hypot(*driven[:, :2].T).std() == pytest.approx(0.4, rel=0.05)


def test_a_sample_is_kept_in_proportion_to_the_likelihood_of_the_view_there() -> None:
    kept, share = paper_rule.corrected(
        _at(0.0, 1.0), _ten_metres_ahead(10.0), np.random.default_rng(1)
    )

    assert share == pytest.approx((1 + FACTOR) / 2, abs=0.01)
    assert kept[:, 0].mean() == pytest.approx(FACTOR / (1 + FACTOR), abs=0.01)
    assert len(kept) == round(share * 2 * COUNT)


def test_what_fits_none_exactly_is_kept_in_proportion_too() -> None:
    """At 0 and at 1 the range errs by 2 and by 3 m: exp(-4.5) / exp(-2) is exp(-2.5)."""
    kept, share = paper_rule.corrected(
        _at(0.0, 1.0), _ten_metres_ahead(8.0), np.random.default_rng(1)
    )

    assert share == pytest.approx((1 + math.exp(-2.5)) / 2, abs=0.01)
    assert kept[:, 0].mean() == pytest.approx(1 / (1 + math.exp(2.5)), abs=0.01)


def test_likelihoods_of_landmarks_multiply_as_in_eq_2() -> None:
    two = _ten_metres_ahead(10.0, -10.0)
    kept, share = paper_rule.corrected(_at(0.0, 1.0), two, np.random.default_rng(1))

    product = FACTOR * FACTOR
    assert share == pytest.approx((1 + product) / 2, abs=0.01)
    assert kept[:, 0].mean() == pytest.approx(product / (1 + product), abs=0.01)


def test_all_samples_stay_where_they_moved_if_none_is_kept() -> None:
    seen = percept("house", 0.0, 10.0, range_sd_m=0.1)
    found = localized(
        agent(),
        house(100.0, 0.0),
        config=CONFIG,
        motions=motions((2.0, 0.0, 1.0, 0.1, 0.0)),
        percepts=[seen],
    )

    assert found.kept_share == 0.0
    assert len(samples_of(found)) == 4000
    assert pose_of(found) == pytest.approx((2.0, 0.0, 0.0), abs=0.01)
    assert found.misfits.count == 0


def test_the_estimate_is_the_posterior_of_eq_3() -> None:
    seen = percept("house", 0.0, 14.0, range_sd_m=0.4)
    found = localized(
        agent(),
        house(20.0, 0.0),
        config=CONFIG,
        motions=motions((5.5, 0.0, 1.0, 0.5, 0.0)),
        percepts=[seen],
    )

    by_motion = 0.5**-2
    by_view = 0.4**-2
    assert found.x_m == pytest.approx(
        (by_motion * 5.5 + by_view * 6.0) / (by_motion + by_view), abs=0.03
    )
    assert found.x_sd_m == pytest.approx((by_motion + by_view) ** -0.5, rel=0.1)
    assert len(samples_of(found)) == round(found.kept_share * 4000)


def test_a_landmarks_samples_are_kept_by_their_own_view_as_in_eq_4() -> None:
    places_m = np.repeat([(10.0, 0.0), (11.0, 0.0)], COUNT, axis=0)
    view = percept("house", 0.0, 10.0, bearing_sd_rad=4.0, range_sd_m=1.0)
    kept_m, share = paper_rule.landmark(places_m, _at(0.0), view, np.random.default_rng(1))

    assert share == pytest.approx((1 + FACTOR) / 2, abs=0.01)
    assert kept_m[:, 0].mean() == pytest.approx(10 + FACTOR / (1 + FACTOR), abs=0.01)
    assert kept_m.shape == places_m.shape


def _seen(known: Object, range_m: float, config: Config = CONFIG) -> Object:
    """The landmark after a view, straight ahead of an agent that stands and may be 1 m behind or
    before the origin.
    """
    places = [(-1.0, 0.0, 0.0)] * 100 + [(1.0, 0.0, 0.0)] * 100
    here = agent(places, stationary_since_ns=1)
    view = percept("house", 0.0, range_m, bearing_sd_rad=0.5, range_sd_m=0.1)
    found, _ = run(task("landmark", percepts=[view]), graph_of(here, known), config).operations
    assert isinstance(found, Object)
    return found


def test_a_landmark_is_seen_from_the_agents_samples() -> None:
    """At 10 m it would be 11 or 9 m away, 10 standard deviations off: of the others one each is."""
    known = landmark("house", [(9.0, 0.0), (10.0, 0.0), (11.0, 0.0)] * 50)
    found = _seen(known, 10.0)

    places_m = np.unique(np.rint(found.positions_m()[:, 0] * 100)) / 100
    assert places_m == pytest.approx([9.0, 11.0])
    assert found.sightings == known.sightings + 1


def test_the_same_view_counts_again_while_the_agent_stands() -> None:
    known = house(10.0, 0.0, 1.0, last_seen_ns=4)
    by_ours = _seen(known, 10.0, Config(landmarks="points"))
    by_paper = _seen(known, 10.0)

    assert by_ours.x_sd_m == known.x_sd_m
    assert by_paper.sightings == known.sightings + 1


def test_a_landmark_informs_from_its_first_sighting_on() -> None:
    once = house(20.0, 0.0, sightings=1)
    moved = motions((5.5, 0.0, 1.0, 0.5, 0.0))
    seen = [percept("house", 0.0, 14.0, range_sd_m=0.4)]
    by_ours = localized(agent(), once, motions=moved, percepts=seen)
    by_paper = localized(agent(), once, config=CONFIG, motions=moved, percepts=seen)

    assert by_ours.kept_share == 1.0
    assert by_paper.kept_share < 0.9


def test_a_landmark_that_never_fits_stays_where_it_is() -> None:
    known = house(10.0, 0.0)
    for _ in range(20):
        known = _seen(known, 30.0)

    assert known.x_m == pytest.approx(10.0, abs=0.01)
    assert known.misses == 20
