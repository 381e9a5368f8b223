"""Which objects are neighbours, and what stands between them."""

import numpy as np
import pytest

from cogmap.services.codelets.planning.network import grid_network
from cogmap.services.codelets.sub_maps.cut_links import CutLinks
from cogmap.services.codelets.sub_maps.neighbours import comes_between, neighbours, neighbours_of


def scattered(count, seed=4):
    return np.random.default_rng(seed).uniform(0, 100, (count, 2))


def by_definition(points_m):
    """The Gabriel graph, pair by pair."""
    edges = []
    for i in range(len(points_m)):
        for j in range(i + 1, len(points_m)):
            centre_m = (points_m[i] + points_m[j]) / 2
            radius_m = np.hypot(*(points_m[i] - points_m[j])) / 2
            distance_m = np.hypot(*(points_m - centre_m).T)
            distance_m[[i, j]] = np.inf
            if distance_m.min() >= radius_m:
                edges.append([i, j])

    return edges


def test_neighbours_have_no_other_object_in_the_circle_between_them():
    points_m = scattered(60)

    assert neighbours(points_m).tolist() == by_definition(points_m)


def test_an_object_that_arrives_has_the_neighbours_it_would_have_had():
    points_m = scattered(80)
    before = neighbours(points_m[:-1])

    near = neighbours_of(points_m[:-1], points_m[-1])
    is_parted = comes_between(points_m[:-1], before, points_m[-1])
    after = [*before[~is_parted].tolist(), *([index, 79] for index in near.tolist())]

    assert sorted(after) == neighbours(points_m).tolist()


def test_objects_at_one_place_are_neighbours_of_each_other_only_once():
    edges = neighbours(np.zeros((30, 2)))

    assert len(edges) == len(np.unique(edges, axis=0)) > 0
    assert (edges[:, 0] < edges[:, 1]).all()


@pytest.mark.parametrize("count", [0, 1])
def test_nothing_and_a_single_object_have_no_neighbours(count):
    assert neighbours(scattered(count)).shape == (0, 2)


def test_the_first_object_has_no_neighbours():
    assert not len(neighbours_of(np.zeros((0, 2)), np.zeros(2)))


def line(x0, y0, x1, y1):
    return [[x0, y0], [x1, y1]]


def test_a_line_along_links_that_are_cut_is_crossed():
    network = grid_network(np.ones((10, 6), bool), cell_m=2.0, origin=(-5, 0))
    network.weights[:, 4, :] = 0.0
    lines = np.array([line(-4, 4, 4, 4), line(4, 4, -4, 4), line(2, 0, 2, 8)], float)

    assert CutLinks(*network).are_crossed(lines).tolist() == [True, True, False]


def test_free_links_separate_nothing_and_neither_does_what_is_not_known():
    cut_links = CutLinks(*grid_network(np.ones((10, 6), bool)))
    lines = np.array([line(0, 0, 9, 5), line(-50, -50, 50, 50)], float)

    assert cut_links.are_crossed(lines).tolist() == [False, False]


def test_no_line_slips_through_a_diagonal_row_of_blocked_cells():
    free = ~np.eye(12, dtype=bool)
    lines = np.array([line(k, k + 3, k + 3, k) for k in range(8)], float)

    assert CutLinks(*grid_network(free)).are_crossed(lines).all()


def test_a_link_that_is_cut_near_an_end_that_is_kept_clear_does_not_count():
    network = grid_network(np.ones((12, 3), bool))
    network.weights[0, 2, :] = 0.0
    lines = np.array([line(0, 1, 10, 1), line(10, 1, 0, 1), line(0, 1, 10, 1)], float)
    clear_m = np.array([[3.5, 0.0], [0.0, 3.5], [1.0, 3.5]])

    assert CutLinks(*network).are_crossed(lines, clear_m).tolist() == [False, False, True]
