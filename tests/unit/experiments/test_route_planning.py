"""Experiment 3: exact optima, simulated participants, and what is reported of them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from cogmap.data.human_tours import HumanTours
from cogmap.data.tsplib import EUC_2D, Problem, straight
from cogmap.errors import UsageError
from cogmap.experiments.route_planning import activation, cross_validation, published
from cogmap.experiments.route_planning.cross_validation import CANDIDATES, Compared
from cogmap.experiments.route_planning.crossings import uncrossed
from cogmap.experiments.route_planning.measure import (
    Planned,
    drawn_jobs,
    human_jobs,
    measure,
    planned,
)
from cogmap.experiments.route_planning.metrics import correlation, drawn_metrics, human_metrics
from cogmap.experiments.route_planning.optimum import shortest_tour
from cogmap.experiments.route_planning.participants import (
    DEFAULT,
    Revision,
    Start,
    tours_of,
    tours_under,
)
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
    assert human_metrics([inside, outside])["within_iqr_share_in_sample"] == 0.5


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


def test_a_tour_that_is_uncrossed_is_a_shorter_one_past_all_goals() -> None:
    positions = _goals(25)
    by_length = straight(positions)
    crossed = np.random.default_rng(1).permutation(25)

    found = uncrossed(crossed, positions)
    again = uncrossed(found, positions)

    assert sorted(found.tolist()) == list(range(25))
    before = route_length(by_length, crossed, closed=True)
    assert route_length(by_length, found, closed=True) < before
    assert again.tolist() == found.tolist()


def test_a_square_drawn_across_is_drawn_around_once_uncrossed() -> None:
    square = np.array([[0.0, 0.0], [9.0, 9.0], [0.0, 9.0], [9.0, 0.0]])

    found = uncrossed(np.arange(4), square)

    assert route_length(straight(square), found, closed=True) == pytest.approx(36.0)


def test_participants_differ_by_what_is_assumed_of_them() -> None:
    positions = _goals(20)
    by_length = straight(positions)
    mean = {}
    for revision in Revision:
        assumptions = DEFAULT._replace(start=Start.GIVEN, revision=revision)
        tours = tours_under(assumptions, by_length, positions, 10, seed=3, given=7)
        lengths = [route_length(by_length, tour, closed=True) for tour in tours]
        mean[revision] = np.mean(lengths)

        for tour in tours:
            assert tour[0] == 7 or revision is Revision.CROSSINGS
            assert sorted(tour.tolist()) == list(range(20))

    assert mean[Revision.STRAIGHTENED] <= mean[Revision.CROSSINGS] <= mean[Revision.NONE]


def test_the_default_participants_are_one_of_the_candidates() -> None:
    positions = _goals(12)
    by_length = straight(positions)

    expected = tours_of(by_length, positions, 4, seed=3).hierarchical
    tours = tours_under(DEFAULT, by_length, positions, 4, seed=3, given=5)

    assert DEFAULT in CANDIDATES
    assert [tour.tolist() for tour in tours] == [tour.tolist() for tour in expected]


def _compared(name: str, *nearest: int) -> Compared:
    """A problem on which those candidates agree with people exactly, and the others do not."""
    medians = np.full(len(CANDIDATES), 0.9)
    medians[list(nearest)] = 0.2
    return Compared(name, np.array([0.0, 0.1, 0.2, 0.3, 0.4]), medians)


def test_a_problem_is_compared_by_what_was_chosen_on_the_others() -> None:
    """Each problem alone would have another candidate, and the last agrees with the others'."""
    problems = [_compared("Graph0", 1, 3), _compared("Graph1", 1, 4), _compared("Graph2", 3, 4)]

    metrics = cross_validation.metrics(problems)

    assert metrics["within_iqr_share"] == 0.0
    assert metrics["within_iqr_share_in_sample"] == pytest.approx(2 / 3)
    assert metrics["folds_that_agree_share"] == pytest.approx(1 / 3)
    assert metrics["graph2_left_out_span"] == np.mean(CANDIDATES[1].spans)


def test_one_problem_alone_cannot_be_left_out() -> None:
    with pytest.raises(UsageError, match="at least 2"):
        cross_validation.metrics([_compared("Graph0", 1)])


def test_candidates_are_compared_on_real_tours_of_people() -> None:
    problems = []
    for seed in range(2):
        positions = _goals(5, seed)
        best = shortest_tour(straight(positions))
        problem = Problem(f"Graph{seed}", EUC_2D, positions)
        problems.append(HumanTours(problem, [best, best[::-1], np.arange(5)]))

    compared = cross_validation.measure(problems, 2, 1, 1, lambda share: None)
    metrics = cross_validation.metrics(compared)

    assert [problem.name for problem in compared] == ["Graph0", "Graph1"]
    assert all((problem.medians >= 0).all() for problem in compared)
    assert 0.0 <= metrics["within_iqr_share"] <= 1.0
