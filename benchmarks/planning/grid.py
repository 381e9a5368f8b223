"""Routes over a grid map that others made, for the problems that came with it."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most
from cogmap.cli.progress import bar
from cogmap.data.moving_ai import Problem, read_map, read_problems
from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.services.codelets.planning.network import Cell, PlaceNetwork, grid_network
from cogmap.services.codelets.planning.search.flat import FlatPlanner
from cogmap.services.codelets.planning.search.hierarchy import HierarchicalPlanner
from cogmap.services.codelets.planning.search.links import Links
from cogmap.services.codelets.planning.search.route import NoRoute, NoRouteReason, Route

THRESHOLDS = {
    "solved_share": at_least(1.0),
    "flat_over_optimal": at_most(1.001),
    "hierarchical_over_optimal": at_most(1.05),
    "hierarchical_speedup": at_least(5.0),
    "time_vs_dijkstra": at_most(1.0),
}
# Each route is found so often, by one planner after the other, and the least time of each counts:
# other jobs of the machine only add to it.
REPEATS = 3
# How many cells wide and high the part of the map is that is closed, and opened again.
CLOSED_CELLS = 5
T = TypeVar("T")


class Answers(NamedTuple):
    """What the planners answered to one problem, and how long they took, and Dijkstra's method."""

    flat: Route | NoRoute
    hierarchical: Route | NoRoute
    took_s: Floats


class Subject(NamedTuple):
    """A map, the planners for it, and the same graph for scipy, all of them made before."""

    is_passable: Booleans
    flat: FlatPlanner
    hierarchical: HierarchicalPlanner
    peer: sparse.csr_matrix
    links: Links

    def peer_number(self, goal: Cell) -> int:
        """The number of a cell's node for scipy."""
        node = self.links.node(goal)
        before = self.links.is_linked[:node]
        return int(before.sum())


def measure(map_path: Path, scenario_path: Path) -> Metrics:
    """The metrics of THRESHOLDS, and the times that the ratios are of.

    Raises UsageError where a file cannot be read.
    """
    is_passable = read_map(map_path)
    problems = read_problems(scenario_path, is_passable)
    network = grid_network(is_passable)

    flat_s, flat = _timed(partial(FlatPlanner, network))
    hierarchical_s, hierarchical = _timed(partial(HierarchicalPlanner, network))
    links = Links(network)
    subject = Subject(is_passable, flat, hierarchical, _graph(links), links)

    answers = _answer_all(subject, problems)
    building = {
        "flat_build_ms": 1e3 * flat_s,
        "hierarchy_build_ms": 1e3 * hierarchical_s,
        "hierarchy_update_ms": 1e3 * _update_s(network, problems[0].goal),
    }
    return _quality(subject, problems, answers) | _speed(answers) | building


def _answer_all(subject: Subject, problems: Sequence[Problem]) -> list[Answers]:
    """All answers, one problem after the other, each of them by both planners and by scipy."""
    answers = []
    with bar("planning routes") as progress:
        for number, problem in enumerate(problems, start=1):
            answers.append(_answer(subject, problem))
            progress(number / len(problems))

    return answers


def _answer(subject: Subject, problem: Problem) -> Answers:
    start, goal, _ = problem
    goal_number = subject.peer_number(goal)

    flat_s, flat = _fastest(partial(subject.flat.find_route, start, goal))
    rough_s, rough = _fastest(partial(subject.hierarchical.find_route, start, goal))
    peer_s, _ = _fastest(partial(dijkstra, subject.peer, indices=goal_number))
    return Answers(flat, rough, np.array([flat_s, rough_s, peer_s]))


def _quality(subject: Subject, problems: Sequence[Problem], answers: Sequence[Answers]) -> Metrics:
    """How many problems both planners solved, and how long their routes are."""
    flat = []
    hierarchical = []
    solved = 0

    for problem, answer in zip(problems, answers, strict=True):
        flat_length = _length(answer.flat, problem, subject.is_passable)
        rough_length = _length(answer.hierarchical, problem, subject.is_passable)
        if flat_length is None or rough_length is None:
            continue

        solved += 1
        if problem.optimal > 0:
            flat.append(flat_length / problem.optimal)
            hierarchical.append(rough_length / problem.optimal)

    return {
        "problems": float(len(problems)),
        "solved_share": solved / len(problems),
        "flat_over_optimal": float(np.mean(flat or [1.0])),
        "hierarchical_over_optimal": float(np.mean(hierarchical or [1.0])),
        "hierarchical_over_optimal_max": max(hierarchical, default=1.0),
    }


def _speed(answers: Sequence[Answers]) -> Metrics:
    """The mean times, and their ratios."""
    took_s = np.array([answer.took_s for answer in answers])
    flat_s, hierarchical_s, dijkstra_s = took_s.mean(axis=0).tolist()
    return {
        "hierarchical_speedup": flat_s / hierarchical_s,
        "time_vs_dijkstra": flat_s / dijkstra_s,
        "flat_ms": 1e3 * flat_s,
        "hierarchical_ms": 1e3 * hierarchical_s,
        "dijkstra_ms": 1e3 * dijkstra_s,
    }


def _length(answer: Route | NoRoute, problem: Problem, is_passable: Booleans) -> float | None:
    """The length in cells of a route that can be driven, None where it cannot or there is none."""
    if isinstance(answer, NoRoute):
        return 0.0 if answer.reason is NoRouteReason.AT_GOAL else None

    cells = answer.cells
    ends = cells[[0, -1]].tolist()
    if ends != [list(problem.start), list(problem.goal)] or not _is_open(cells, is_passable):
        return None

    steps = np.diff(cells, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    return float(lengths.sum())


def _is_open(cells: Indices, is_passable: Booleans) -> bool:
    """Whether (n, 2) cells are neighbours one after the other, free, and cut no corner."""
    steps = np.diff(cells, axis=0)
    if np.abs(steps).max() > 1:
        return False

    i, j = cells[:-1].T
    di, dj = steps.T
    here = is_passable[i, j]
    there = is_passable[i + di, j + dj]
    beside_i = is_passable[i + di, j]
    beside_j = is_passable[i, j + dj]
    is_open = here & there & beside_i & beside_j
    return bool(is_open.all())


def _graph(links: Links) -> sparse.csr_matrix:
    """The links that are not cut, between the nodes that have any, as scipy takes a graph."""
    graph = links.matrix().copy()
    graph.data[np.isinf(graph.data)] = 0
    graph.eliminate_zeros()
    return graph[links.is_linked][:, links.is_linked]


def _update_s(network: PlaceNetwork, cell: Cell) -> float:
    """The time to take a change of the map: what is about a cell is closed, and opened again."""
    planner = HierarchicalPlanner(network)
    i, j = cell
    closed = network._replace(weights=network.weights.copy())
    closed.weights[:, i : i + CLOSED_CELLS, j : j + CLOSED_CELLS] = 0

    planner.update(closed)
    opening_s, _ = _timed(partial(planner.update, network))
    closing_s, _ = _timed(partial(planner.update, closed))
    return max(opening_s, closing_s)


def _fastest(work: Callable[[], T]) -> tuple[float, T]:
    """The least seconds that `work` took of REPEATS times, and what it returned."""
    took_s, result = _timed(work)
    for _ in range(REPEATS - 1):
        again_s, result = _timed(work)
        took_s = min(took_s, again_s)

    return took_s, result


def _timed(work: Callable[[], T]) -> tuple[float, T]:
    """The seconds that `work` took, and what it returned."""
    began_s = time.perf_counter()
    result = work()
    return time.perf_counter() - began_s, result
