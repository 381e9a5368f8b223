"""Maps of cities: tours, environments, and errors of the buildings learned."""

from __future__ import annotations

import itertools
import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from cogmap.errors import CogmapError, UsageError
from cogmap.experiments.city_maps import drive
from cogmap.experiments.city_maps.correction import settings
from cogmap.experiments.city_maps.drive import LEG, VIEW, Tour, sections, traverse
from cogmap.experiments.city_maps.environment import (
    BUILDINGS,
    MAX_KM2,
    City,
    Environment,
    environments,
)
from cogmap.experiments.city_maps.fit import Fit, fitted, halves
from cogmap.experiments.city_maps.kept import traverse_once
from cogmap.experiments.city_maps.measure import (
    NOISE,
    CityMap,
    Learned,
    aligned_error_km2,
    configurations,
    jobs,
    map_error_km2,
)
from cogmap.experiments.city_maps.metrics import fit_metrics, map_metrics
from cogmap.experiments.city_maps.observer import WHEELS
from cogmap.experiments.city_maps.sources import from_osm, grown, plane_m
from cogmap.experiments.city_maps.streets import Streets, shortest_path
from cogmap.experiments.city_maps.tour import shortest_tour
from cogmap.runtime.config import Sections
from cogmap.services.sim.odometry import Noise
from tests.support.paths import steps_m

CROSS = Streets(
    np.array([(0.0, 0.0), (100.0, 0.0), (-100.0, 0.0), (0.0, 100.0)]),
    np.array([(0, 1), (0, 2), (0, 3)]),
)


def _environment(seed: int) -> Environment:
    """One environment in a grown city."""
    (environment,) = environments(grown(seed), 1, seed)
    return environment


def _length(distance: np.ndarray, order: list[int]) -> float:
    """The length of a closed tour."""
    following = [*order[1:], order[0]]
    return sum(distance[a, b] for a, b in zip(order, following, strict=True))


@pytest.mark.parametrize("seed", range(4))
def test_the_tour_is_as_short_as_any(seed: int) -> None:
    points = np.random.default_rng(seed).uniform(0, 1, (6, 2))
    distance = np.hypot(*(points[:, None] - points).transpose(2, 0, 1))
    every = [[0, *rest] for rest in itertools.permutations(range(1, 6))]
    shortest = min(_length(distance, order) for order in every)

    length, order = shortest_tour(distance)

    assert length == pytest.approx(shortest)
    assert _length(distance, order) == pytest.approx(length)
    assert sorted(order) == list(range(6))


def test_a_tour_past_what_cannot_be_reached_is_refused() -> None:
    distance = np.full((4, 4), np.inf)

    with pytest.raises(CogmapError, match="cannot be reached"):
        shortest_tour(distance)


def test_shortest_paths_follow_the_streets_between_points_put_on_them() -> None:
    beside_streets_m = np.array([(60.0, 9.0), (-5.0, 80.0)])
    streets, (east, north) = CROSS.with_points(beside_streets_m)
    distance, before = streets.shortest_paths(np.array([east, north]))
    assert distance[0, north] == pytest.approx(140.0)

    path = shortest_path(before[0], int(north))
    path_m = streets.points_m[path].tolist()
    assert path_m == [[60.0, 0.0], [0.0, 0.0], [0.0, 80.0]]


def test_two_points_on_one_piece_stand_in_order() -> None:
    points_m = np.array([(80.0, 1.0), (20.0, 1.0)])
    streets, (far, near) = CROSS.with_points(points_m)
    distance, _ = streets.shortest_paths(np.array([near]))

    assert distance[0, far] == pytest.approx(60.0)
    assert distance[0, 0] == pytest.approx(20.0)
    assert streets.length_m == pytest.approx(CROSS.length_m)


def test_only_the_connected_part_is_kept() -> None:
    points_m = np.vstack([CROSS.points_m, [(500.0, 0.0), (600.0, 0.0)]])
    pieces = np.vstack([CROSS.pieces, [(4, 5)]])
    apart = Streets(points_m, pieces)

    assert apart.connected().points_m.tolist() == CROSS.points_m.tolist()


@pytest.mark.parametrize("seed", range(3))
def test_an_environment_has_eight_buildings_in_4_km2_and_a_tour_past_them(
    seed: int,
) -> None:
    environment = _environment(seed)
    assert environment.buildings_m.shape == (BUILDINGS, 2)
    assert len(set(environment.names)) == BUILDINGS
    assert environment.area_km2 <= MAX_KM2

    legs_m = environment.legs_m
    following_m = [*legs_m[1:], legs_m[0]]
    for leg, building in zip(legs_m, environment.buildings_m, strict=True):
        assert np.hypot(*(leg[0] - building)) < 40.0

    for leg, following in zip(legs_m, following_m, strict=True):
        assert leg[-1] == pytest.approx(following[0])


@pytest.mark.parametrize("backward", [False, True])
def test_the_line_of_a_tour_begins_before_its_start_and_ends_after_its_end(
    backward: bool,
) -> None:
    environment = _environment(3)
    before_m = 70.0
    after_m = 100.0

    line = environment.line(2, backward, before_m, after_m)

    expected_m = before_m + environment.tour_m + after_m
    assert steps_m(line).sum() == pytest.approx(expected_m, abs=0.1)


def test_the_same_seed_grows_the_same_city() -> None:
    assert (
        grown(5).buildings_m.tolist()
        == grown(5).buildings_m.tolist()
        != grown(6).buildings_m.tolist()
    )


def test_a_city_with_too_few_buildings_is_named() -> None:
    hamlet = City("hamlet", CROSS, ("a",), np.array([(50.0, 10.0)]))

    with pytest.raises(UsageError, match="hamlet: no 8 buildings"):
        environments(hamlet, 1, 1)


def test_degrees_become_metres() -> None:
    origin = np.array([15.0, 48.0])
    points = np.array([(15.0, 48.001), (15.001, 48.0)])
    north_m, east_m = plane_m(points, origin)

    assert north_m == pytest.approx([0.0, 111.2], abs=0.1)
    assert east_m == pytest.approx([74.4, 0.0], abs=0.1)


def test_an_extract_without_streets_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "sea.osm"
    path.write_text('<osm version="0.6"><node id="1" lat="1" lon="1"/></osm>')

    with pytest.raises(UsageError, match="has no streets"):
        from_osm(path)


def test_the_error_is_the_sum_of_squares_in_square_kilometres() -> None:
    true = np.zeros((8, 2))
    half_km_away = np.tile([300.0, 400.0], (8, 1))
    assert map_error_km2(half_km_away, true) == pytest.approx(8 * 0.25)

    half_missing = half_km_away.copy()
    half_missing[:4] = np.nan
    assert map_error_km2(half_missing, true) == pytest.approx(8 * 0.25)


def test_a_map_that_is_turned_moved_and_scaled_alone_has_no_aligned_error() -> None:
    true_m = _environment(1).buildings_m
    quarter_turn = np.array([(0.0, -1.0), (1.0, 0.0)])
    learned_m = 0.3 * true_m @ quarter_turn + (900.0, -70.0)
    assert map_error_km2(learned_m, true_m) > 1
    assert aligned_error_km2(learned_m, true_m) == pytest.approx(0, abs=1e-9)

    mirrored_m = true_m * (1, -1)
    assert aligned_error_km2(mirrored_m, true_m) > 0.01


def _map(environment: Environment, errors_km2: dict[str, float]) -> CityMap:
    """A map learned in one traverse, of which only the errors count."""
    nothing = dict.fromkeys(errors_km2, np.zeros((0, 2)))
    right = dict.fromkeys(errors_km2, environment.buildings_m)
    learned = Learned(errors_km2, 0, right, nothing, nothing)
    return CityMap(environment, (learned,))


def test_the_ratio_is_the_mean_of_the_maps_own_ratios() -> None:
    environment = _environment(1)
    quarter = {WHEELS: 3.0, "none": 4.0, "positions": 2.0, "heading": 1.0}
    half = {WHEELS: 3.0, "none": 2.0, "positions": 2.0, "heading": 1.0}
    maps = [_map(environment, quarter), _map(environment, half)]

    metrics = map_metrics(maps, NOISE)

    assert metrics["error_corrected_over_uncorrected"] == pytest.approx((0.25 + 0.5) / 2)
    assert metrics["error_uncorrected_km2"] == pytest.approx(3.0)
    assert metrics["sensing"] == "percept-level sensing"
    assert json.loads(json.dumps(metrics)) == metrics


def test_noise_is_fitted_on_every_second_map_by_name() -> None:
    environments = [_named(_environment(1), name) for name in ("d", "b", "a", "c")]
    to, others = halves(environments)

    assert [each.name for each in to] == ["a", "c"]
    assert [each.name for each in others] == ["b", "d"]
    with pytest.raises(UsageError, match="two maps or more"):
        halves(to[:1])


def test_with_the_fitted_noise_the_papers_rule_errs_as_people_do() -> None:
    environments = [_environment(seed) for seed in (1, 2)]

    fits = fitted(environments, environments, 1, lambda share: None)

    for fit in fits.values():
        assert fit.fitted_km2 == pytest.approx(1.07, rel=0.05)
        assert 0.01 < fit.noise.speed == fit.noise.turn < 1


def test_a_map_whose_error_no_noise_makes_human_is_named_with_the_remedy() -> None:
    small = _environment(1)
    legs_m = tuple(leg / 100 for leg in small.legs_m)
    tiny = replace(small, buildings_m=small.buildings_m / 100, legs_m=legs_m)

    with pytest.raises(UsageError, match="give larger or other cities, or --noise"):
        fitted([tiny], [tiny], 1, lambda share: None)


def test_the_model_is_compared_with_people_on_tested_maps_by_mean_errors() -> None:
    errors = {WHEELS: 3.0, "none": 4.0, "positions": 2.14, "heading": 0.214}
    fit = Fit(NOISE, fitted_km2=1.07, tested_km2=0.535)

    found = fit_metrics([_map(_environment(1), errors)], {"view": fit}, 3)

    assert found["paper_over_people"] == pytest.approx(2.0)
    assert found["ours_over_paper"] == pytest.approx(0.1)
    assert found["ours_over_paper_se"] == pytest.approx(0.0)
    assert found["rule_by_view_over_people"] == pytest.approx(0.5)
    assert found["maps_fitted"] == 3
    assert found["maps_tested"] == 1


def test_the_ratio_of_means_is_as_uncertain_as_the_maps_differ() -> None:
    environment = _environment(1)
    fit = Fit(NOISE, fitted_km2=1.07, tested_km2=1.07)
    nothing = {WHEELS: 1.0, "none": 1.0}
    maps = [
        _map(environment, nothing | {"positions": paper, "heading": ours})
        for paper, ours in ((2.0, 0.0), (2.0, 1.0))
    ]

    found = fit_metrics(maps, {"view": fit}, 2)

    assert found["ours_over_paper"] == pytest.approx(0.25)
    assert found["ours_over_paper_se"] == pytest.approx(0.25)
    assert found["paper_over_people_se"] == pytest.approx(0.0)


def _named(environment: Environment, name: str) -> Environment:
    return replace(environment, name=name)


def _beginning_of_a_tour(environment: Environment, points: int) -> Sections:
    """The configuration of a drive without noise and confusions along so many of its points."""
    quiet = Noise(speed=0.0, turn=0.0, drift_rad_per_sqrt_m=0.0)
    configured = sections(environment, Tour(start=0, backward=True, seed=1), quiet, "none")
    simulated = configured["sim"]
    simulated["trajectory"]["line_m"] = simulated["trajectory"]["line_m"][:points]
    simulated["percepts"] |= {"right_name": 1.0, "precision": 1.0, "place_precision": 1.0}
    return configured


def test_a_traversal_that_is_kept_is_not_driven_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    configured = _beginning_of_a_tour(_environment(7), 2)
    driven = traverse_once(configured, tmp_path)

    # A module that there is not: a drive would fail.
    monkeypatch.setattr(drive, "MODULES", ("nothing",))
    kept = traverse_once(configured, tmp_path)

    for name, value in asdict(driven).items():
        np.testing.assert_equal(getattr(kept, name), value)
    other = configured | {"workspace": configured["workspace"] | {"cell_m": 4.0}}
    with pytest.raises(UsageError, match="no module"):
        traverse_once(other, tmp_path)


def test_without_noise_and_confusions_the_map_is_right_and_repeatable() -> None:
    environment = _environment(7)
    configured = _beginning_of_a_tour(environment, 12)

    made = traverse(configured)
    again = traverse(configured)

    assert made.believed[:, :2] == pytest.approx(made.true[:, :2], abs=1.0)
    assert made.believed.tolist() == again.believed.tolist()

    known = ~np.isnan(made.buildings_m[:, 0])
    off_m = (made.buildings_m - environment.buildings_m)[known]
    off_by_wheels_m = (made.alone_m[WHEELS] - environment.buildings_m)[known]
    assert known.any()
    assert np.hypot(*off_m.T).max() < 5.0
    assert np.hypot(*off_by_wheels_m.T).max() < 5.0


def test_every_method_has_the_same_noise_drawn_by_view_or_by_leg() -> None:
    (by_leg,) = jobs([_environment(1)], NOISE, 1, 1, drawn=LEG)
    (by_view,) = jobs([_environment(1)], NOISE, 1, 1)

    simulated = [each["sim"] for each in configurations(by_leg).values()]

    assert simulated[0]["trajectory"]["noise_drawn"] == LEG
    assert all(each == simulated[0] for each in simulated)
    assert configurations(by_view)["none"]["sim"]["trajectory"]["noise_drawn"] == VIEW


def test_loops_are_closed_only_where_that_is_asked_for() -> None:
    never = settings("none", 5.0)["codelets"]
    positions = settings("positions", 5.0)["codelets"]
    headings = settings("heading", 5.0)["codelets"]

    assert never["revisit_s"] > 1e6
    assert "revisit_s" not in positions
    assert headings["correct"] == "heading"
