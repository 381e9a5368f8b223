from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
import pytest

from cogmap.errors import CogmapError, UsageError
from experiments.city_maps.correction import settings
from experiments.city_maps.drive import Tour, sections, traverse
from experiments.city_maps.environment import BUILDINGS, MAX_KM2, City, environments
from experiments.city_maps.measure import NOISE, CityMap, Learned, map_error_km2
from experiments.city_maps.metrics import map_metrics
from experiments.city_maps.observer import WHEELS
from experiments.city_maps.sources import from_osm, grown, plane_m
from experiments.city_maps.streets import Streets, shortest_path
from experiments.city_maps.tour import shortest_tour
from services.sim.odometry import Noise

CROSS = Streets(
    np.array([(0.0, 0.0), (100.0, 0.0), (-100.0, 0.0), (0.0, 100.0)]),
    np.array([(0, 1), (0, 2), (0, 3)]),
)


@pytest.mark.parametrize("seed", range(4))
def test_the_tour_is_as_short_as_any(seed: int) -> None:
    points = np.random.default_rng(seed).uniform(0, 1, (6, 2))
    distance = np.hypot(*(points[:, None] - points).transpose(2, 0, 1))
    length, order = shortest_tour(distance)
    every = [[0, *rest] for rest in itertools.permutations(range(1, 6))]
    lengths = [
        sum(distance[a, b] for a, b in zip(tour, [*tour[1:], 0], strict=True)) for tour in every
    ]

    assert length == pytest.approx(min(lengths))
    assert sum(
        distance[a, b] for a, b in zip(order, [*order[1:], 0], strict=True)
    ) == pytest.approx(length)
    assert sorted(order) == list(range(6))


def test_a_tour_past_what_cannot_be_reached_is_refused() -> None:
    distance = np.full((4, 4), np.inf)

    with pytest.raises(CogmapError, match="cannot be reached"):
        shortest_tour(distance)


def test_ways_follow_the_streets_between_points_put_on_them() -> None:
    streets, (east, north) = CROSS.with_points(np.array([(60.0, 9.0), (-5.0, 80.0)]))
    distance, before = streets.shortest_paths(np.array([east, north]))
    assert distance[0, north] == pytest.approx(140.0)

    way = streets.points_m[shortest_path(before[0], int(north))]
    assert way.tolist() == [[60.0, 0.0], [0.0, 0.0], [0.0, 80.0]]


def test_two_points_on_one_piece_stand_in_order() -> None:
    streets, (far, near) = CROSS.with_points(np.array([(80.0, 1.0), (20.0, 1.0)]))
    distance, _ = streets.shortest_paths(np.array([near]))

    assert distance[0, far] == pytest.approx(60.0)
    assert distance[0, 0] == pytest.approx(20.0)
    assert streets.length_m == pytest.approx(CROSS.length_m)


def test_only_the_connected_part_is_kept() -> None:
    apart = Streets(
        np.vstack([CROSS.points_m, [(500.0, 0.0), (600.0, 0.0)]]),
        np.vstack([CROSS.pieces, [(4, 5)]]),
    )

    assert apart.connected().points_m.tolist() == CROSS.points_m.tolist()


@pytest.mark.parametrize("seed", range(3))
def test_an_environment_has_eight_buildings_in_4_km2_and_a_tour_past_them(
    seed: int,
) -> None:
    (environment,) = environments(grown(seed), 1, seed)

    assert environment.buildings_m.shape == (BUILDINGS, 2)
    assert len(set(environment.names)) == BUILDINGS
    assert environment.area_km2 <= MAX_KM2
    for leg, building in zip(environment.legs_m, environment.buildings_m, strict=True):
        assert np.hypot(*(leg[0] - building)) < 40.0
    for leg, following in zip(
        environment.legs_m, [*environment.legs_m[1:], environment.legs_m[0]], strict=True
    ):
        assert leg[-1] == pytest.approx(following[0])


def test_the_line_of_a_tour_comes_up_to_its_start_and_goes_on_beyond_its_end() -> None:
    (environment,) = environments(grown(3), 1, 3)
    for backward in (False, True):
        line = environment.line(2, backward, 70.0, 100.0)
        length = np.hypot(*np.diff(line, axis=0).T).sum()
        assert length == pytest.approx(environment.tour_m + 170.0, abs=0.1)


def test_the_same_seed_grows_the_same_city() -> None:
    assert (
        grown(5).buildings_m.tolist()
        == grown(5).buildings_m.tolist()
        != grown(6).buildings_m.tolist()
    )


def test_a_city_with_too_few_buildings_is_named() -> None:
    with pytest.raises(UsageError, match="hamlet: no 8 buildings"):
        environments(City("hamlet", CROSS, ("a",), np.array([(50.0, 10.0)])), 1, 1)


def test_degrees_become_metres() -> None:
    metres = plane_m(np.array([(15.0, 48.001), (15.001, 48.0)]), np.array([15.0, 48.0]))

    assert metres[0] == pytest.approx([0.0, 111.2], abs=0.1)
    assert metres[1] == pytest.approx([74.4, 0.0], abs=0.1)


def test_an_extract_without_streets_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "sea.osm"
    path.write_text('<osm version="0.6"><node id="1" lat="1" lon="1"/></osm>')

    with pytest.raises(UsageError, match="has no streets"):
        from_osm(path)


def test_the_error_is_the_sum_of_squares_in_square_kilometres() -> None:
    true = np.zeros((8, 2))
    learned = np.tile([300.0, 400.0], (8, 1))
    assert map_error_km2(learned, true) == pytest.approx(8 * 0.25)

    learned[:4] = np.nan
    assert map_error_km2(learned, true) == pytest.approx(8 * 0.25)


def test_the_ratio_is_the_mean_of_the_maps_own_ratios() -> None:
    (environment,) = environments(grown(1), 1, 1)
    nothing = dict.fromkeys((WHEELS, "none", "positions", "heading"), np.zeros((0, 2)))
    errors = [(3.0, 4.0, 2.0, 1.0), (3.0, 2.0, 2.0, 1.0)]
    maps = [
        CityMap(
            environment,
            (Learned(dict(zip(nothing, error, strict=True)), 0, nothing, nothing, nothing),),
        )
        for error in errors
    ]
    metrics = map_metrics(maps, NOISE)

    assert metrics["error_corrected_over_uncorrected"] == pytest.approx((0.25 + 0.5) / 2)
    assert metrics["error_uncorrected_km2"] == pytest.approx(3.0)
    assert metrics["sensing"] == "percept-level sensing"
    assert json.loads(json.dumps(metrics)) == metrics


def test_without_noise_and_confusions_the_map_is_right_and_repeatable() -> None:
    (environment,) = environments(grown(7), 1, 7)
    quiet = Noise(speed=0.0, turn=0.0, drift_rad_per_sqrt_m=0.0)
    configured = sections(environment, Tour(start=0, backward=True, seed=1), quiet, "none")
    configured["sim"]["trajectory"]["line_m"] = configured["sim"]["trajectory"]["line_m"][:12]
    configured["sim"]["percepts"] |= {"right_name": 1.0, "precision": 1.0, "place_precision": 1.0}
    made, again = (traverse(configured) for _ in range(2))

    assert made.believed[:, :2] == pytest.approx(made.true[:, :2], abs=1.0)

    known = ~np.isnan(made.buildings_m[:, 0])
    assert known.any()
    assert np.hypot(*(made.buildings_m - environment.buildings_m)[known].T).max() < 5.0
    assert np.hypot(*(made.alone_m[WHEELS] - environment.buildings_m)[known].T).max() < 5.0
    assert made.believed.tolist() == again.believed.tolist()


def test_loops_are_closed_only_where_that_is_asked_for() -> None:
    assert settings("none", 5.0)["codelets"]["revisit_s"] > 1e6
    assert "revisit_s" not in settings("positions", 5.0)["codelets"]
    assert settings("heading", 5.0)["codelets"]["correct"] == "heading"
