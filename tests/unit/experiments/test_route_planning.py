"""Experiment 3: exact optima, simulated participants, and what is reported of them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from cogmap.data.human_tours import HumanTours
from cogmap.data.tsplib import EUC_2D, Problem, straight
from cogmap.experiments.route_planning import activation, published
from cogmap.experiments.route_planning.measure import (
    Planned,
    drawn_jobs,
    human_jobs,
    measure,
    planned,
)
from cogmap.experiments.route_planning.metrics import correlation, drawn_metrics, human_metrics
from cogmap.experiments.route_planning.optimum import shortest_tour
from cogmap.experiments.route_planning.participants import tours_of
from cogmap.geometry.arrays import Floats
from cogmap.services.codelets.planning.tours import route_length


def _goals(number: int, seed: int = 0) -> Floats:
    rng = np.random.default_rng([seed, number])
    return rng.uniform(0.0, 1.0, (number, 2))


def _of_people(excess: list[float], model: float) -> Planned:
    """A problem with those excesses of people, and one participant of the model."""
    visited = np.arange(4)
    return Planned(
        name="Graph0",
        positions=_goals(4),
        shortest=visited,
        people=np.array(excess),
        hierarchical=np.array([model]),
        straightened=np.array([model / 2]),
        flat=np.array([2 * model]),
        typical=visited,
        typical_flat=visited,
    )


@pytest.mark.parametrize("number", [3, 4, 6, 8])
def test_the_shortest_tour_is_that_of_all_orders(number: int) -> None:
    by_length = straight(_goals(number))
    every = []
    for rest in itertools.permutations(range(1, number)):
        visited = np.array([0, *rest])
        every.append(route_length(by_length, visited, closed=True))

    found = route_length(by_length, shortest_tour(by_length), closed=True)
    assert found == pytest.approx(min(every))


def test_the_shortest_tour_past_a_ring_of_clusters_is_one_tour() -> None:
    """Each cluster alone would have the shortest tours."""
    angles_rad = np.linspace(0.0, 2 * np.pi, 6, endpoint=False)
    centres = 10 * np.column_stack([np.cos(angles_rad), np.sin(angles_rad)])
    positions = (centres[:, None] + _goals(5)).reshape(-1, 2)

    visited = shortest_tour(straight(positions))

    assert visited[0] == 0
    assert sorted(visited.tolist()) == list(range(30))
    clusters = visited // 5
    assert np.count_nonzero(clusters != np.roll(clusters, 1)) == 6


def test_participants_are_the_same_for_a_seed_and_differ_from_each_other() -> None:
    positions = _goals(20)
    by_length = straight(positions)

    first = tours_of(by_length, positions, 4, seed=3)
    again = tours_of(by_length, positions, 4, seed=3)

    assert [tour.tolist() for tour in first.flat] == [tour.tolist() for tour in again.flat]
    orders = {tuple(tour.tolist()) for tour in first.hierarchical}
    assert len(orders) == 4
    assert orders == {tuple(tour.tolist()) for tour in again.hierarchical}
    for tour in (*first.hierarchical, *first.flat):
        assert sorted(tour.tolist()) == list(range(20))


def test_a_planned_problem_has_excesses_of_people_and_model() -> None:
    positions = _goals(12)
    problem = Problem("Graph0", EUC_2D, positions)
    best = shortest_tour(straight(positions))
    (job,) = human_jobs([HumanTours(problem, [best, best[::-1], np.arange(12)])], 5, seed=1)

    found = planned(job)

    assert found.people[:2] == pytest.approx(0.0, abs=1e-12)
    assert found.people[2] > 0
    for excess in (found.hierarchical, found.straightened, found.flat):
        assert len(excess) == 5
        assert (excess >= 0).all()
    assert found.straightened.mean() < found.flat.mean()


def test_the_model_is_within_people_where_its_median_is_within_quartiles() -> None:
    people = [0.0, 0.1, 0.2, 0.3, 0.4]
    inside = _of_people(people, 0.1)
    outside = _of_people(people, 0.31)

    assert inside.is_within_quartiles
    assert not outside.is_within_quartiles
    assert human_metrics([inside, outside])["within_iqr_share"] == 0.5


def test_errors_correlate_over_problems_by_their_means() -> None:
    problems = [_of_people([0.0, share, 2 * share], share**2) for share in (0.1, 0.2, 0.3)]
    metrics = human_metrics(problems)

    expected = float(np.corrcoef([0.01, 0.04, 0.09], [0.1, 0.2, 0.3])[0, 1])
    assert metrics["hierarchical_correlation_with_people"] == pytest.approx(expected)
    assert correlation(np.ones(5), np.arange(5.0)) == 0.0


def test_drawn_problems_stand_beside_what_is_published_for_their_size() -> None:
    jobs = drawn_jobs((4, 10), 2, seed=5)
    metrics = drawn_metrics(measure(jobs, 1, lambda share: None))

    assert metrics["goals_004_published_people"] == pytest.approx(0.009)
    assert metrics["goals_010_published_people"] == published.DRAWN_HUMAN[10]
    assert metrics["goals_004_hierarchical_above_optimum"] >= -1e-12


def test_without_peoples_tours_nothing_is_reported_of_them() -> None:
    assert human_metrics([]) == {}


def test_routes_of_figure_5_follow_activation_and_go_round_walls() -> None:
    straight_on = activation.free_ground()
    round_walls = activation.walled_ground()

    for ground in (straight_on, round_walls):
        along = ground.log_activation[tuple(ground.route.T)]
        assert (np.diff(along) > 0).all()
        assert ground.is_free[tuple(ground.route.T)].all()
        assert ground.route[0].tolist() == list(activation.START)
        assert ground.route[-1].tolist() == list(activation.GOAL)
    assert len(round_walls.route) > len(straight_on.route) + 10
