"""The agent's pose by its motion and by landmarks, compared with the exact posterior."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

from cogmap.errors import MessageError
from cogmap.graph.graph import Graph
from cogmap.schemas.graph import Link
from cogmap.schemas.nodes import LinkKind, Self
from cogmap.services.codelets.config import Config
from cogmap.testing import agent, graph_of, percept, task
from tests.support.world.landmarks import (
    house,
    localized,
    motions,
    normal_samples,
    pose_of,
    samples_of,
)
from tests.support.world.scenes import run


@dataclass(frozen=True)
class Gaussian:
    """A mean and its standard deviation."""

    mean: float
    sd: float


def _posterior(prior: Gaussian, measured: Gaussian) -> Gaussian:
    """Their product."""
    of_prior = prior.sd**-2
    of_measured = measured.sd**-2
    precision = of_prior + of_measured
    weighted = of_prior * prior.mean + of_measured * measured.mean
    return Gaussian(weighted / precision, precision**-0.5)


def test_without_landmarks_the_samples_move_by_the_motion() -> None:
    two_metres = (2.0, 0.0, 1.0, 0.0, 0.0)
    quarter_turn = (0.0, math.pi / 2, 1.0, 0.0, 0.0)
    found = localized(agent(), motions=motions(two_metres, quarter_turn))
    assert pose_of(found) == pytest.approx((2.0, 0.0, math.pi / 2))

    there = agent(samples_of(found))
    three_metres = (3.0, 0.0, 1.0, 0.0, 0.0)
    again = localized(there, motions=motions(three_metres), identifier="2/localization")
    assert pose_of(again) == pytest.approx((2.0, 3.0, math.pi / 2))


def test_motion_that_a_late_answer_has_moved_the_agent_by_does_not_move_it_again() -> None:
    at_one_second = agent([(2.0, 0.0, 0.0)] * 200, stamp_ns=1_000_000_000)
    two_metres = (2.0, 0.0, 1.0, 0.0, 0.0)
    three_metres = (3.0, 0.0, 1.0, 0.0, 0.0)

    found = localized(
        at_one_second,
        motions=motions(two_metres, three_metres),
        since_ns=0,
        stamp_ns=2_000_000_000,
    )

    assert pose_of(found) == pytest.approx((5.0, 0.0, 0.0))
    assert found.odometry.x_m == pytest.approx(3.0)


def test_a_quarter_circle_ends_where_its_chord_does() -> None:
    step = (math.pi / 2, math.pi / 2, 0.05, 0.0, 0.0)
    found = localized(agent(), motions=motions(*[step] * 20))

    assert pose_of(found) == pytest.approx((1.0, 1.0, math.pi / 2), abs=1e-3)


def test_the_samples_spread_by_the_noise_of_the_motion() -> None:
    driven = localized(agent(), motions=motions((4.0, 0.0, 1.0, 0.5, 0.0)))
    turned = localized(agent(), motions=motions((0.0, 1.0, 1.0, 0.0, 0.2)))

    assert driven.x_sd_m == pytest.approx(0.5, rel=0.1)
    assert driven.y_sd_m == 0.0
    assert turned.heading_sd_rad == pytest.approx(0.2, rel=0.1)


def test_a_landmark_ahead_corrects_the_distance_to_the_exact_posterior() -> None:
    driven = Gaussian(5.5, 0.5)
    range_m = 14.0
    by_landmark = Gaussian(20.0 - range_m, 0.4)
    exact = _posterior(driven, by_landmark)

    found = localized(
        agent(),
        house(20.0, 0.0),
        motions=motions((driven.mean, 0.0, 1.0, driven.sd, 0.0)),
        percepts=[percept("house", 0.0, range_m, range_sd_m=by_landmark.sd)],
    )

    assert found.x_m == pytest.approx(exact.mean, abs=0.03)
    assert found.x_sd_m == pytest.approx(exact.sd, rel=0.1)


def test_a_bearing_corrects_the_heading_to_the_exact_gaussian_posterior() -> None:
    turned = Gaussian(0.0, 0.1)
    bearing_rad = -0.08
    by_landmark = Gaussian(-bearing_rad, 0.05)
    exact = _posterior(turned, by_landmark)

    seen = percept("house", bearing_rad, 50.0, bearing_sd_rad=by_landmark.sd, range_sd_m=5.0)
    found = localized(
        agent(),
        house(50.0, 0.0, 1e-3),
        motions=motions((1e-3, 0.0, 1.0, 0.0, turned.sd)),
        percepts=[seen],
    )

    assert found.heading_rad == pytest.approx(exact.mean, abs=0.006)
    assert found.heading_sd_rad == pytest.approx(exact.sd, rel=0.1)


def test_two_landmarks_weigh_as_much_as_their_noise_allows() -> None:
    distance_sd_m = 1.0
    near_sd_m = 0.2
    far_sd_m = 0.8
    near = percept("near", 0.0, 20.0 - 5.4, range_sd_m=near_sd_m)
    far = percept("far", 0.0, 40.0 - 4.4, range_sd_m=far_sd_m)
    found = localized(
        agent(),
        house(20.0, 0.0, 1e-3, "near"),
        house(40.0, 0.0, 1e-3, "far"),
        motions=motions((5.0, 0.0, 1.0, distance_sd_m, 0.0)),
        percepts=[near, far],
    )
    weights = np.array([distance_sd_m, near_sd_m, far_sd_m]) ** -2.0
    exact_m = weights @ [5.0, 5.4, 4.4] / weights.sum()

    assert found.x_m == pytest.approx(exact_m, abs=0.03)


def test_an_uncertain_landmark_corrects_less_than_a_certain_one() -> None:
    def corrected_m(sd_m: float) -> float:
        found = localized(
            agent(),
            house(20.0, 0.0, sd_m),
            motions=motions((5.0, 0.0, 1.0, 0.5, 0.0)),
            percepts=[percept("house", 0.0, 14.0, range_sd_m=0.2)],
        )
        return found.x_m - 5.0

    assert 0.0 < corrected_m(2.0) < corrected_m(0.5) < corrected_m(0.01) < 1.0


def test_an_agent_that_stands_still_does_not_grow_surer_of_itself_by_looking() -> None:
    def looking(seen_ns: int) -> float:
        looker = agent(normal_samples(1.0, 0.01, 0.01), stationary_since_ns=5)
        found = localized(
            looker,
            house(20.0, 0.0, last_seen_ns=seen_ns),
            motions=motions((0.0, 0.0, 0.2, 0.0, 0.0)),
            percepts=[percept("house", 0.0, 19.0)],
        )
        return found.x_m

    assert looking(seen_ns=4) == pytest.approx(0.92, abs=0.05)
    assert looking(seen_ns=5) == pytest.approx(0.0, abs=0.05)


@pytest.mark.parametrize("number", range(4))
def test_a_turned_agent_recovers_its_heading_by_three_landmarks(
    number: int,
) -> None:
    rng = np.random.default_rng(number)
    heading_rad = rng.uniform(-math.pi, math.pi)
    samples = np.zeros((200, 3))
    samples[:, :2] = rng.normal((2.0, 1.0), 0.2, (200, 2))
    samples[:, 2] = rng.uniform(-math.pi, math.pi, 200)

    landmarks = []
    seen = []
    for label, x_m, y_m in (("a", 2.5, 7.0), ("b", 4.3, 4.8), ("c", 0.7, 4.8)):
        bearing_rad = math.remainder(math.atan2(y_m - 1.0, x_m - 2.0) - heading_rad, math.tau)
        range_m = math.hypot(x_m - 2.0, y_m - 1.0)
        landmarks.append(house(x_m, y_m, label=label))
        seen.append(percept(label, bearing_rad, range_m, bearing_sd_rad=0.03, range_sd_m=0.15))

    config = Config(samples=800, landmarks="points")
    found = localized(agent(samples), *landmarks, config=config, percepts=seen)

    error_rad = math.remainder(found.heading_rad - heading_rad, math.tau)
    assert (found.x_m, found.y_m) == pytest.approx((2.0, 1.0), abs=0.2)
    assert error_rad == pytest.approx(0.0, abs=0.06)


def test_path_integration_continues_beside_the_pose_landmarks_correct() -> None:
    found = localized(
        agent(),
        house(20.0, 0.0),
        motions=motions((5.0, 0.0, 1.0, 0.5, 0.0)),
        percepts=[percept("house", 0.0, 14.0, range_sd_m=0.2)],
    )

    assert found.x_m > 5.5
    assert found.odometry.x_m == pytest.approx(5.0)


def test_the_self_node_is_linked_to_the_place_of_its_mean_alone() -> None:
    before = Link(source="self", target="place:map:0:0:0")
    graph = graph_of(agent(), before, cell_m=2.0)
    asked = task("localization", motions=motions((6.2, 0.0, 1.0, 0.0, 0.0)))
    graph.change(run(asked, graph, Config()).operations)

    assert graph.links.targets("self", LinkKind.AT) == {"place:map:0:3:0": 1.0}


def test_the_number_of_samples_does_not_fall_from_one_task_to_the_next() -> None:
    current = agent()
    for frame in range(10):
        range_m = 20.0 - 0.2 * (frame + 1)
        current = localized(
            current,
            house(20.0, 0.0),
            config=Config(),
            identifier=f"{frame}/localization",
            motions=motions((1.0, 0.0, 0.2, 0.1, 0.02)),
            since_ns=current.stamp_ns,
            percepts=[percept("house", 0.0, range_m)],
        )
        assert len(samples_of(current)) >= 50

    assert current.x_m == pytest.approx(2.0, abs=0.15)


def test_a_task_on_a_graph_without_a_self_node_is_refused() -> None:
    with pytest.raises(MessageError, match="no self node"):
        run(task("localization"), Graph(), Config())


def _sample_bytes(identifier: str) -> bytes:
    step = (2.0, 0.1, 1.0, 0.3, 0.1)
    found: Self = localized(agent(), motions=motions(step), identifier=identifier)
    return samples_of(found).tobytes()


def test_the_same_task_gives_the_same_samples_and_another_task_gives_others() -> None:
    first = _sample_bytes("1/localization")
    second = _sample_bytes("1/localization")
    other = _sample_bytes("2/localization")

    assert first == second
    assert first != other
