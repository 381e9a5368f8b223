from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from cogmap.errors import MessageError
from cogmap.geometry.se2 import mean_pose, wrap_angle
from cogmap.graph.graph import Graph
from schemas.array import Array
from schemas.graph import Link, Operation
from schemas.nodes import LinkKind, Object, Self
from services.codelets.config import Config
from services.codelets.localization.sampling import (
    generator,
    rejection_mask,
    resample,
    spread,
)
from tests.support.scenes import agent, graph_of, landmark, percept, run, task

Samples = npt.NDArray[np.float64]
EXACT = Config(samples=4000, kept_samples=2000, outlier_share=1e-9, correlated_views=1.0)


def _landmark(
    x_m: float,
    y_m: float,
    sd_m: float = 0.01,
    label: str = "house",
    sightings: int = 20,
    **facts: Any,
) -> Object:
    samples = np.random.default_rng(5).normal((x_m, y_m), sd_m, (200, 2))
    return landmark(label, samples, sightings=sightings, **facts)


def _rows(*rows: tuple[float, float, float, float, float]) -> Array:
    return Array.of(np.array(rows, np.float64))


def _samples(found: Self) -> Samples:
    return found.samples.numpy()


def _pose(found: Self) -> tuple[float, float, float]:
    return found.x_m, found.y_m, found.heading_rad


def _localized(*nodes: Operation, config: Config = EXACT, **facts: Any) -> Self:
    (found, _) = run(task("localization", **facts), graph_of(*nodes), config).operations
    assert isinstance(found, Self)
    return found


def test_without_landmarks_the_samples_move_by_the_motion() -> None:
    found = _localized(
        agent(), motions=_rows((2.0, 0.0, 1.0, 0.0, 0.0), (0.0, math.pi / 2, 1.0, 0.0, 0.0))
    )

    assert _pose(found) == pytest.approx((2.0, 0.0, math.pi / 2))

    again = _localized(
        agent(_samples(found)),
        motions=_rows((3.0, 0.0, 1.0, 0.0, 0.0)),
        identifier="2/localization",
    )

    assert _pose(again) == pytest.approx((2.0, 3.0, math.pi / 2))


def test_a_quarter_circle_ends_where_its_chord_does() -> None:
    rows = [(math.pi / 2, math.pi / 2, 0.05, 0.0, 0.0)] * 20

    assert _pose(_localized(agent(), motions=_rows(*rows))) == pytest.approx(
        (1.0, 1.0, math.pi / 2), abs=1e-3
    )


def test_the_samples_spread_as_the_motions_noise_says() -> None:
    found = _localized(agent(), motions=_rows((4.0, 0.0, 1.0, 0.5, 0.0)))
    assert found.x_sd_m == pytest.approx(0.5, rel=0.1)
    assert found.y_sd_m == 0.0

    turned = _localized(agent(), motions=_rows((0.0, 1.0, 1.0, 0.0, 0.2)))
    assert turned.heading_sd_rad == pytest.approx(0.2, rel=0.1)


def test_a_landmark_ahead_corrects_the_way_to_the_exact_gaussian_posterior() -> None:
    distance_m = 5.5
    distance_sd_m = 0.5
    seen_m = 14.0
    seen_sd_m = 0.4
    prior = 1 / distance_sd_m**2
    sensed = 1 / seen_sd_m**2
    exact_m = (prior * distance_m + sensed * (20.0 - seen_m)) / (prior + sensed)
    found = _localized(
        agent(),
        _landmark(20.0, 0.0),
        motions=_rows((distance_m, 0.0, 1.0, distance_sd_m, 0.0)),
        percepts=[percept("house", 0.0, seen_m, range_sd_m=seen_sd_m)],
    )

    assert found.x_m == pytest.approx(exact_m, abs=0.03)
    assert found.x_sd_m == pytest.approx((prior + sensed) ** -0.5, rel=0.1)


def test_a_bearing_corrects_the_heading_to_the_exact_gaussian_posterior() -> None:
    turn_sd_rad = 0.1
    bearing_sd_rad = 0.05
    bearing_rad = -0.08
    prior = 1 / turn_sd_rad**2
    sensed = 1 / bearing_sd_rad**2
    found = _localized(
        agent(),
        _landmark(50.0, 0.0, 1e-3),
        motions=_rows((1e-3, 0.0, 1.0, 0.0, turn_sd_rad)),
        percepts=[
            percept("house", bearing_rad, 50.0, bearing_sd_rad=bearing_sd_rad, range_sd_m=5.0)
        ],
    )

    assert found.heading_rad == pytest.approx(-sensed * bearing_rad / (prior + sensed), abs=0.006)
    assert found.heading_sd_rad == pytest.approx((prior + sensed) ** -0.5, rel=0.1)


def test_two_landmarks_weigh_as_much_as_their_noise_allows() -> None:
    distance_sd_m = 1.0
    near_sd_m = 0.2
    far_sd_m = 0.8
    weights = np.array([distance_sd_m, near_sd_m, far_sd_m]) ** -2.0
    exact_m = weights @ [5.0, 5.4, 4.4] / weights.sum()
    found = _localized(
        agent(),
        _landmark(20.0, 0.0, 1e-3, "near"),
        _landmark(40.0, 0.0, 1e-3, "far"),
        motions=_rows((5.0, 0.0, 1.0, distance_sd_m, 0.0)),
        percepts=[
            percept("near", 0.0, 14.6, range_sd_m=near_sd_m),
            percept("far", 0.0, 35.6, range_sd_m=far_sd_m),
        ],
    )

    assert found.x_m == pytest.approx(exact_m, abs=0.03)


def test_an_uncertain_landmark_corrects_less_than_a_certain_one() -> None:
    def corrected_m(sd_m: float) -> float:
        found = _localized(
            agent(),
            _landmark(20.0, 0.0, sd_m),
            motions=_rows((5.0, 0.0, 1.0, 0.5, 0.0)),
            percepts=[percept("house", 0.0, 14.0, range_sd_m=0.2)],
        )
        return found.x_m - 5.0

    assert 0.0 < corrected_m(2.0) < corrected_m(0.5) < corrected_m(0.01) < 1.0


def test_a_landmark_whose_place_is_hardly_known_corrects_nothing() -> None:
    found = _localized(
        agent(),
        _landmark(20.0, 0.0, 6.0),
        motions=_rows((5.0, 0.0, 1.0, 0.5, 0.0)),
        percepts=[percept("house", 0.0, 12.0)],
    )

    assert found.kept_share == 1.0


def test_where_all_samples_are_unlikely_the_pose_is_still_one_of_them() -> None:
    for outlier_share in (0.0, 1e-9):
        config = Config(samples=100, kept_samples=50, outlier_share=outlier_share)
        with np.errstate(divide="ignore", invalid="ignore"):
            found = _localized(
                agent(),
                _landmark(20.0, 0.0, 1e-6),
                config=config,
                motions=_rows((5.0, 0.0, 1.0, 0.01, 0.01)),
                percepts=[percept("house", 2.0, 500.0, range_sd_m=1e-3, bearing_sd_rad=1e-3)],
            )
        x_m, y_m, heading_rad = _pose(found)

        assert len(_samples(found)) >= 1
        assert x_m == pytest.approx(5.0, abs=0.1)
        assert abs(y_m) + abs(heading_rad) < 0.2


def test_one_landmark_taken_for_another_does_not_outvote_the_rest() -> None:
    landmarks = [
        _landmark(20.0, y_m, 0.05, name) for name, y_m in (("a", -5.0), ("b", 0.0), ("c", 5.0))
    ]
    seen = [
        percept(name, math.atan2(y_m, 15.0), math.hypot(y_m, 15.0))
        for name, y_m in (("a", -5.0), ("b", 0.0))
    ]
    found = _localized(
        agent(),
        *landmarks,
        config=Config(),
        motions=_rows((5.0, 0.0, 1.0, 0.5, 0.05)),
        percepts=[*seen, percept("c", -1.0, 40.0)],
    )

    assert _pose(found)[:2] == pytest.approx((5.0, 0.0), abs=0.15)


def test_an_agent_that_stands_still_does_not_grow_surer_of_itself_by_looking() -> None:
    def looking(seen_ns: int) -> float:
        looker = agent(
            np.random.default_rng(1).normal(0.0, (1.0, 0.01, 0.01), (4000, 3)),
            stationary_since_ns=5,
        )
        house = _landmark(20.0, 0.0, last_seen_ns=seen_ns)
        motions = _rows((0.0, 0.0, 0.2, 0.0, 0.0))
        seen = [percept("house", 0.0, 19.0)]
        return _localized(looker, house, motions=motions, percepts=seen).x_m

    assert looking(seen_ns=4) == pytest.approx(0.92, abs=0.05)
    assert looking(seen_ns=5) == pytest.approx(0.0, abs=0.05)


@pytest.mark.parametrize("number", range(4))
def test_a_turned_agent_recovers_its_heading_by_three_landmarks(
    number: int,
) -> None:
    rng = np.random.default_rng(number)
    heading = rng.uniform(-math.pi, math.pi)
    places = {"a": (2.5, 7.0), "b": (4.3, 4.8), "c": (0.7, 4.8)}
    samples = np.column_stack(
        [rng.normal((2.0, 1.0), 0.2, (200, 2)), rng.uniform(-math.pi, math.pi, 200)]
    )
    seen = [
        percept(
            name,
            math.remainder(math.atan2(y - 1.0, x - 2.0) - heading, math.tau),
            math.hypot(x - 2.0, y - 1.0),
            bearing_sd_rad=0.03,
            range_sd_m=0.15,
        )
        for name, (x, y) in places.items()
    ]
    found = _localized(
        agent(samples),
        *[_landmark(x, y, label=name) for name, (x, y) in places.items()],
        config=Config(samples=800, correlated_views=1.0),
        percepts=seen,
    )
    x_m, y_m, heading_rad = _pose(found)

    assert (x_m, y_m) == pytest.approx((2.0, 1.0), abs=0.2)
    assert math.remainder(heading_rad - heading, math.tau) == pytest.approx(0.0, abs=0.06)


def test_the_self_node_is_linked_to_the_place_of_its_mean_alone() -> None:
    before = Link(source="self", target="place:map:0:0:0")
    graph = graph_of(agent(), before, cell_m=2.0)
    asked = task("localization", motions=_rows((6.2, 0.0, 1.0, 0.0, 0.0)))
    graph.change(run(asked, graph, Config()).operations)

    assert graph.links.targets("self", LinkKind.AT) == {"place:map:0:3:0": 1.0}


def test_the_number_of_samples_does_not_fall_from_one_task_to_the_next() -> None:
    current = agent()
    for frame in range(10):
        current = _localized(
            current,
            _landmark(20.0, 0.0),
            config=Config(),
            identifier=f"{frame}/localization",
            motions=_rows((1.0, 0.0, 0.2, 0.1, 0.02)),
            percepts=[percept("house", 0.0, 20.0 - 0.2 * (frame + 1))],
        )
        assert len(_samples(current)) >= 50

    assert current.x_m == pytest.approx(2.0, abs=0.15)


def test_a_task_on_a_graph_without_a_self_node_is_refused() -> None:
    with pytest.raises(MessageError, match="no self node"):
        run(task("localization"), Graph(), Config())


LANDMARK = Config(misses=3, correlated_views=1.0)


def _located(
    house: Object, bearing_rad: float, range_m: float, number: int = 0, config: Config = LANDMARK
) -> Object:
    seen = percept("house", bearing_rad, range_m, bearing_sd_rad=0.02, range_sd_m=0.4)
    asked = task("landmark", identifier=f"{number}/landmark/house", percepts=[seen])
    (found, _) = run(asked, graph_of(agent(), house), config).operations
    assert isinstance(found, Object)
    return found


def test_seeing_a_landmark_again_shrinks_its_spread_around_where_it_is() -> None:
    house = _landmark(10.0, 0.0, 1.0, sightings=1)
    spreads = []
    for number in range(12):
        house = _located(house, 0.0, 10.5, number)
        spreads.append(math.hypot(house.x_sd_m, house.y_sd_m))

    assert spreads[0] < 0.6
    assert spreads[-1] < 0.5 * spreads[0]
    assert (house.x_m, house.y_m) == pytest.approx((10.5, 0.0), abs=0.25)
    assert house.sightings == 13


def test_a_landmarks_samples_become_the_exact_gaussian_posterior_of_eq_4() -> None:
    prior = 1 / 1.0**2
    sensed = 1 / 0.4**2
    samples = np.random.default_rng(6).normal((10.0, 0.0), (1.0, 0.01), (8000, 2))
    house = landmark("house", samples)
    config = Config(landmark_jitter_m=1e-6, correlated_views=1.0)
    found = _located(house, 0.0, 11.0, config=config)

    assert found.x_m == pytest.approx((prior * 10 + sensed * 11) / (prior + sensed), abs=0.03)
    assert found.x_sd_m == pytest.approx((prior + sensed) ** -0.5, rel=0.1)


def test_the_number_of_a_landmarks_samples_stays() -> None:
    found = _located(_landmark(10.0, 0.0, 0.5), 0.0, 10.0)

    assert len(found.positions_m()) == 200


def test_a_landmark_seen_elsewhere_starts_anew_after_the_configured_misses() -> None:
    house = _landmark(10.0, 0.0, 0.1)
    places = []
    for number in range(3):
        house = _located(house, math.pi / 2, 6.0, number)
        places.append((house.x_m, house.y_m))

    assert places[0] == pytest.approx((10.0, 0.0), abs=0.1)
    assert places[1] == places[0]
    assert places[2] == pytest.approx((0.0, 6.0), abs=0.2)
    assert house.misses == 0


def test_a_landmark_that_is_seen_in_its_place_again_is_forgiven_its_misses() -> None:
    house = _landmark(10.0, 0.0, 0.1)
    for number, (bearing_rad, range_m) in enumerate(
        [(1.5, 6.0), (1.5, 6.0), (0.0, 10.0), (1.5, 6.0), (1.5, 6.0)]
    ):
        house = _located(house, bearing_rad, range_m, number)

    assert house.misses == 2
    assert house.x_m == pytest.approx(10.0, abs=0.2)


def test_the_same_task_gives_the_same_samples_and_another_task_gives_others() -> None:
    motions = _rows((2.0, 0.1, 1.0, 0.3, 0.1))
    first, second = (_samples(_localized(agent(), motions=motions)) for _ in range(2))
    other = _samples(_localized(agent(), motions=motions, identifier="2/localization"))

    assert first.tobytes() == second.tobytes()
    assert first.tobytes() != other.tobytes()


def test_rejection_keeps_samples_by_their_likelihood_and_never_none() -> None:
    rng = generator("a test")
    kept = rejection_mask(np.log(np.repeat([1.0, 0.5, 0.1], 20_000)), rng)

    assert kept.reshape(3, -1).mean(axis=1) == pytest.approx([1.0, 0.5, 0.1], abs=0.02)
    assert rejection_mask(np.array([-1e300, -1e301]), rng).tolist() == [True, False]


def test_means_and_spreads_of_headings_are_taken_on_the_circle() -> None:
    poses = np.array([[0.0, 0.0, math.pi - 0.1], [2.0, 0.0, -math.pi + 0.1]])
    mean = mean_pose(poses)

    assert abs(mean[2]) == pytest.approx(math.pi)
    assert spread(poses, mean) == pytest.approx([1.0, 0.0, 0.1])
    assert wrap_angle(np.array([3 * math.pi, -0.5, math.pi])) == pytest.approx(
        [math.pi, -0.5, math.pi]
    )


def test_refilling_draws_from_those_kept_and_jitters_each() -> None:
    kept = np.array([[1.0, 2.0], [3.0, 4.0]])

    assert {tuple(row) for row in resample(kept, 50, 0.0, generator("a")).tolist()} == {
        (1.0, 2.0),
        (3.0, 4.0),
    }
    assert len({tuple(row) for row in resample(kept, 50, 0.1, generator("a")).tolist()}) == 50


def test_a_landmark_seen_once_and_then_twice_elsewhere_starts_anew_there() -> None:
    house = _landmark(300.0, 0.0, 0.5, sightings=1)
    for number in range(2):
        house = _located(house, 0.0, 10.0, number)

    assert house.x_m == pytest.approx(10.0, abs=0.5)
    assert (house.sightings, house.misses) == (1, 0)


def test_a_landmark_that_was_seen_but_once_moves_nobody() -> None:
    def found(sightings: int) -> Self:
        house = _landmark(20.0, 0.0, sightings=sightings)
        motions = _rows((5.0, 0.0, 1.0, 0.5, 0.0))
        return _localized(
            agent(), house, motions=motions, percepts=[percept("house", 0.0, 14.0, range_sd_m=0.2)]
        )

    assert found(sightings=1).x_m == pytest.approx(5.0, abs=0.05)
    assert found(sightings=2).x_m > 5.5


def test_one_landmark_that_does_not_fit_leaves_the_pose_as_certain() -> None:
    looker = agent(np.random.default_rng(1).normal(0.0, (0.3, 0.3, 0.01), (1000, 3)))
    for number in range(20):
        looker = _localized(
            looker,
            _landmark(20.0, 0.0),
            motions=_rows((0.1, 0.0, 1.0, 0.0, 0.0)),
            percepts=[percept("house", 2.0, 50.0)],
            identifier=f"{number}/localization",
        )

    assert looker.misfit_count == 20
    assert looker.x_sd_m < 0.4


def test_path_integration_continues_beside_the_pose_landmarks_correct() -> None:
    motions = _rows((5.0, 0.0, 1.0, 0.5, 0.0))
    seen = [percept("house", 0.0, 14.0, range_sd_m=0.2)]
    found = _localized(agent(), _landmark(20.0, 0.0), motions=motions, percepts=seen)

    assert found.x_m > 5.5
    assert found.odometry_x_m == pytest.approx(5.0)
