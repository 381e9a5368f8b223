"""Where a landmark is, by seeing it again and again (eq. 4)."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from cogmap.schemas.nodes import Object, PathIntegration
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.localization.information import INDEPENDENT_RAD, new_view_share
from cogmap.services.codelets.localization.landmarks import MISSES
from cogmap.testing import agent, graph_of, landmark, percept, task
from tests.support.world.landmarks import house
from tests.support.world.scenes import run

CONFIG = Config(landmarks="points")
ASIDE_RAD = math.pi / 2


def _seen(
    known: Object,
    bearing_rad: float,
    range_m: float,
    number: int = 0,
    config: Config = CONFIG,
    *,
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    bearing_sd_rad: float = 0.02,
    **facts: object,
) -> Object:
    """The landmark after it was seen from there, by an agent of which there are these `facts`."""
    at = dict(zip(("x_m", "y_m", "heading_rad"), pose, strict=True))
    here = agent(np.tile(pose, (200, 1)), **at, **facts)
    seen = percept("house", bearing_rad, range_m, bearing_sd_rad=bearing_sd_rad, range_sd_m=0.4)
    asked = task("landmark", identifier=f"{number}/landmark", percepts=[seen])
    found, _ = run(asked, graph_of(here, known), config).operations
    assert isinstance(found, Object)
    return found


def test_seeing_a_landmark_again_shrinks_its_spread_around_where_it_is() -> None:
    known = house(10.0, 0.0, 1.0, sightings=1)
    spreads_m = []
    for number in range(12):
        known = _seen(known, 0.0, 10.5, number)
        spreads_m.append(math.hypot(known.x_sd_m, known.y_sd_m))

    assert spreads_m[0] < 0.6
    assert spreads_m[-1] < 0.5 * spreads_m[0]
    assert (known.x_m, known.y_m) == pytest.approx((10.5, 0.0), abs=0.25)
    assert known.sightings == 13


def test_a_landmarks_samples_become_the_exact_gaussian_posterior_of_eq_4() -> None:
    samples_m = np.random.default_rng(6).normal((10.0, 0.0), (1.0, 0.01), (8000, 2))
    known = landmark("house", samples_m)
    config = Config(landmark_jitter_m=1e-6, landmarks="points")
    found = _seen(known, 0.0, 11.0, config=config)

    prior = 1 / 1.0**2
    sensed = 1 / 0.4**2
    precision = prior + sensed
    assert found.x_m == pytest.approx((prior * 10 + sensed * 11) / precision, abs=0.03)
    assert found.x_sd_m == pytest.approx(precision**-0.5, rel=0.1)


def test_a_landmark_keeps_how_it_was_seen_last_by_path_integration() -> None:
    path = PathIntegration(x_m=3.0, y_m=4.0, heading_rad=math.pi / 2, variance_m2=0.5)
    found = _seen(house(10.0, 0.0, 1.0), 0.0, 11.0, odometry=path, range_gain=0.1)
    sighting = found.last_sighting

    assert sighting is not None
    assert (sighting.x_m, sighting.y_m) == pytest.approx((3.0, 14.0))
    assert sighting.odometry == path


def test_a_landmark_seen_by_range_alone_is_not_tracked() -> None:
    assert _seen(house(10.0, 0.0, 1.0), 0.0, 10.0, bearing_sd_rad=7.0).last_sighting is None


def test_the_number_of_a_landmarks_samples_stays() -> None:
    found = _seen(house(10.0, 0.0, 0.5), 0.0, 10.0)

    assert len(found.positions_m()) == 200


def test_a_landmark_seen_elsewhere_starts_anew_after_some_misses() -> None:
    known = house(10.0, 0.0, 0.1)
    missed = known
    for number in range(MISSES - 1):
        missed = _seen(missed, ASIDE_RAD, 6.0, number)
    assert (missed.x_m, missed.y_m) == (known.x_m, known.y_m)

    anew = _seen(missed, ASIDE_RAD, 6.0, MISSES)
    assert (anew.x_m, anew.y_m) == pytest.approx((0.0, 6.0), abs=0.2)
    assert anew.misses == 0


def test_a_landmark_that_is_seen_in_its_place_again_is_forgiven_its_misses() -> None:
    in_place = (0.0, 10.0)
    elsewhere = (1.5, 6.0)
    seen = [elsewhere, elsewhere, in_place, elsewhere, elsewhere]

    known = house(10.0, 0.0, 0.1)
    for number, (bearing_rad, range_m) in enumerate(seen):
        known = _seen(known, bearing_rad, range_m, number)

    assert known.misses == 2
    assert known.x_m == pytest.approx(10.0, abs=0.2)


def test_a_landmark_seen_once_and_then_twice_elsewhere_starts_anew_there() -> None:
    known = house(300.0, 0.0, 0.5, sightings=1)
    for number in range(2):
        known = _seen(known, 0.0, 10.0, number)

    assert known.x_m == pytest.approx(10.0, abs=0.5)
    assert (known.sightings, known.misses) == (1, 0)


def test_a_landmark_first_seen_from_afar_and_wrongly_comes_to_where_it_is_seen_from_near() -> None:
    known = house(25.0, 0.0, 1.5, sightings=1)
    for number in range(40):
        known = _seen(known, 0.0, 19.0, number)

    assert known.x_m == pytest.approx(19.0, abs=0.5)


def test_a_building_is_known_no_better_by_the_same_view_again_but_by_one_from_aside() -> None:
    config = Config(landmarks="buildings")
    known = _seen(house(10.0, 0.0, 1.0, sightings=1), 0.0, 10.0, config=config)
    again = known
    for number in range(1, 20):
        again = _seen(again, 0.0, 10.0, number, config)
    from_aside = _seen(again, 0.0, 10.0, 20, config, pose=(10.0, -10.0, ASIDE_RAD))

    assert known.x_sd_m < 0.6
    assert again.x_sd_m == pytest.approx(known.x_sd_m, rel=0.05)
    assert from_aside.x_sd_m < 0.7 * again.x_sd_m


def test_the_nearer_an_agent_drives_past_the_more_each_view_tells_of_a_building() -> None:
    far = msgspec.structs.replace(house(50.0, 0.0, 1.0), seen_from_m=(-50.0, 0.0))
    near = msgspec.structs.replace(house(5.0, 0.0, 1.0), seen_from_m=(-5.0, 0.0))
    moved_m = np.array([0.0, 0.5])

    assert new_view_share(near, moved_m, INDEPENDENT_RAD) == pytest.approx(
        10 * new_view_share(far, moved_m, INDEPENDENT_RAD), rel=0.05
    )
    assert new_view_share(house(5.0, 0.0, 1.0), moved_m, INDEPENDENT_RAD) == 1.0
