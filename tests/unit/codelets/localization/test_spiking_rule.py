"""Localization by spikes (§5.4, figure 4), by hand-worked numbers."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.schemas.nodes import Object
from cogmap.services.codelets.config import Config
from cogmap.testing import agent, graph_of, landmark, percept, task
from tests.support.world.landmarks import house, localized, motions, pose_of, samples_of
from tests.support.world.scenes import run

CONFIG = Config(localization="spiking", samples=4000)
AHEAD = ((5.5, 0.0, 1.0, 0.5, 0.0),)


def test_phases_are_reset_to_the_mean_of_the_spikes_at_each_step() -> None:
    apart = agent([(0.0, 0.0, 0.0)] * 100 + [(2.0, 0.0, 0.0)] * 100)
    found = localized(apart, config=CONFIG, motions=motions((3.0, 0.0, 1.0, 0.0, 0.0)))

    assert samples_of(found) == pytest.approx(np.tile((4.0, 0.0, 0.0), (4000, 1)))


def test_the_spikes_are_the_posterior_of_eq_3() -> None:
    seen = percept("house", 0.0, 14.0, range_sd_m=0.4)
    found = localized(
        agent(), house(20.0, 0.0), config=CONFIG, motions=motions(*AHEAD), percepts=[seen]
    )

    by_motion = 0.5**-2
    by_view = 0.4**-2
    expected_m = (by_motion * 5.5 + by_view * 6.0) / (by_motion + by_view)
    assert found.x_m == pytest.approx(expected_m, abs=0.03)
    assert found.x_sd_m == pytest.approx((by_motion + by_view) ** -0.5, rel=0.1)


def test_landmarks_one_after_another_give_the_product_of_eq_2() -> None:
    views = [percept("house", 0.0, 14.0, range_sd_m=0.4), percept("mill", 0.0, 24.0)]
    found = localized(
        agent(),
        house(20.0, 0.0),
        house(30.0, 0.0, label="mill"),
        config=CONFIG,
        motions=motions(*AHEAD),
        percepts=views,
    )

    precisions = np.array([0.5, 0.4, views[1].range_sd_m]) ** -2
    expected_m = precisions @ (5.5, 6.0, 6.0) / precisions.sum()
    assert found.x_m == pytest.approx(expected_m, abs=0.04)
    assert found.x_sd_m == pytest.approx(precisions.sum() ** -0.5, rel=0.12)


def test_phases_stay_where_they_moved_if_no_place_cell_fires() -> None:
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


def test_a_landmark_that_fits_nowhere_does_not_silence_the_others() -> None:
    views = [percept("house", 0.0, 14.0, range_sd_m=0.4), percept("mill", 0.0, 24.0)]
    elsewhere = house(90.0, 0.0, label="mill")
    nodes = (agent(), house(20.0, 0.0), elsewhere)
    both = localized(*nodes, config=CONFIG, motions=motions(*AHEAD), percepts=views)
    alone = localized(*nodes, config=CONFIG, motions=motions(*AHEAD), percepts=views[:1])

    assert both.x_m == pytest.approx(alone.x_m, abs=0.03)
    assert 0 < both.kept_share < alone.kept_share


def test_a_view_turns_an_agent_whose_heading_is_little_known() -> None:
    """0 +- 0.2 rad by path integration, 0.1 +- 0.2 rad by a landmark straight ahead."""
    seen = percept("house", -0.1, 20.0, bearing_sd_rad=0.2, range_sd_m=5.0)
    found = localized(
        agent(),
        house(20.0, 0.0),
        config=CONFIG,
        motions=motions((0.0, 0.0, 1.0, 0.01, 0.2)),
        percepts=[seen],
    )

    assert found.heading_rad == pytest.approx(0.05, abs=0.015)
    assert found.heading_sd_rad == pytest.approx(0.2 / 2**0.5, rel=0.1)


def test_the_same_task_gives_the_same_spikes() -> None:
    seen = [percept("house", 0.0, 14.0, range_sd_m=0.4)]
    first, again = (
        localized(agent(), house(20.0, 0.0), config=CONFIG, motions=motions(*AHEAD), percepts=seen)
        for _ in range(2)
    )

    assert np.array_equal(samples_of(first), samples_of(again))


def test_landmarks_follow_eq_4_beside_localization_by_spikes() -> None:
    """At 10 m it would be 11 or 9 m away, 10 standard deviations off: of the others one each is."""
    known = landmark("house", [(9.0, 0.0), (10.0, 0.0), (11.0, 0.0)] * 50)
    here = agent([(-1.0, 0.0, 0.0)] * 100 + [(1.0, 0.0, 0.0)] * 100)
    view = percept("house", 0.0, 10.0, bearing_sd_rad=0.5, range_sd_m=0.1)
    found, _ = run(task("landmark", percepts=[view]), graph_of(here, known), CONFIG).operations

    assert isinstance(found, Object)
    assert np.unique(np.rint(found.positions_m()[:, 0])) == pytest.approx([9.0, 11.0])
