"""Routes over a grid map that others made, for the problems that came with it, through the
route-plan codelet: the one that the agent drives by.
"""

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
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, NoSettings
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Cells
from cogmap.schemas.nodes import (
    NEVER_NS,
    ROOT_MAP,
    SELF_ID,
    Goal,
    Map,
    PlaceColumn,
    Plan,
    Self,
    goal_id,
)
from cogmap.services.codelets.public import PlanningConfig, coarse_places, route_plan

THRESHOLDS = {
    "solved_share": at_least(1.0),
    "flat_over_optimal": at_most(1.001),
    "hierarchical_over_optimal": at_most(1.05),
    "hierarchical_speedup": at_least(5.0),
    "time_vs_dijkstra": at_most(1.0),
}

REPEATS = 3
"""Each route is found so often, in turn, and the least time of each counts: other jobs of the
machine only add to it."""

CLOSED_CELLS = 5
"""So many cells wide and high is the part of the map that is closed, and opened again."""

CELL_M = 2.0
"""A cell is wider than the robot, which can pass between two others that are blocked."""

AT_GOAL_M = 0.5 * CELL_M
"""A goal is reached in its own cell."""

FLAT = PlanningConfig(search_places=2**31, reached_m=AT_GOAL_M)
HIERARCHICAL = PlanningConfig(search_places=0, reached_m=AT_GOAL_M)
GOAL = goal_id("benchmark")
T = TypeVar("T")


class Outcome(NamedTuple):
    """The lengths in cells of both routes of a problem, None if one cannot be driven; the seconds
    that the flat one, the hierarchical one and the peer's took, (3,).
    """

    flat: float | None
    hierarchical: float | None
    took_s: Floats


def measure(map_path: Path, scenario_path: Path) -> Metrics:
    """Measure the metrics of THRESHOLDS, and the times that the ratios are of.

    The codelet plans on the graph as it is, from the columns of the map on: flat, on the whole map,
    or hierarchically, on the coarse maps first. The peer does what a user would do: it makes the
    graph of the grid's free cells, searches it by Dijkstra's method, and follows the predecessors.

    Raises UsageError if a file cannot be read.
    """
    is_passable = read_map(map_path)
    problems = read_problems(scenario_path, is_passable)
    graph = _graph(is_passable)
    build_s, _ = _timed(partial(coarse_places.make_all, graph))

    outcomes = []
    with bar("planning routes") as progress:
        for number, problem in enumerate(problems, start=1):
            outcomes.append(_outcome(graph, problem, is_passable))
            progress(number / len(problems))

    speed = _speed(outcomes)
    return _quality(problems, outcomes) | speed | _updating(graph, build_s)


def _graph(is_passable: Booleans) -> Graph:
    """Make a graph whose root map has the free cells as road, obstacles elsewhere and around."""
    is_blocked = np.pad(~is_passable, 1, constant_values=True)
    graph = Graph()
    graph.change([Map(id=ROOT_MAP, cell_m=CELL_M)])
    graph.change([_column(PlaceColumn.ROAD, np.argwhere(is_passable), 1.0)])
    graph.change([_column(PlaceColumn.OBSTACLE, np.argwhere(is_blocked) - 1, 1.0)])
    graph.change([_agent((0, 0))])
    return graph


def _column(column: PlaceColumn, cells: Indices, value: float) -> Cells:
    """Set one value in a column of (n, 2) cells."""
    values = np.full(len(cells), value, np.float32)
    return Cells(column=column, cells=Array.of(cells, "<i4"), values=Array.of(values))


def _agent(cell: tuple[int, int]) -> Self:
    """Make an agent in the middle of a cell."""
    x_m, y_m = CELL_M * np.array(cell)
    pose = np.array([[x_m, y_m, 0.0]])
    return Self(id=SELF_ID, activation=1.0, x_m=x_m, y_m=y_m, samples=Matrix.of(pose))


def _outcome(graph: Graph, problem: Problem, is_passable: Booleans) -> Outcome:
    """Find the routes of one problem by the codelet, both ways, and by the peer."""
    x_m, y_m = CELL_M * np.array(problem.goal)
    goal = Goal(id=GOAL, base_level=1.0, x_m=x_m, y_m=y_m)
    graph.change([_agent(problem.start), goal])
    task = Task(task_id="0/route_plan", codelet="route_plan", cycle=0, version=0)

    took_s = np.full(3, np.inf)
    for _ in range(REPEATS):
        flat_s, flat = _timed(partial(route_plan.run, task, graph, FLAT))
        hierarchical_s, hierarchical = _timed(partial(route_plan.run, task, graph, HIERARCHICAL))
        peer_s, _ = _timed(partial(_peer, is_passable, problem))
        took_s = np.minimum(took_s, [flat_s, hierarchical_s, peer_s])

    return Outcome(
        flat=_length(flat, problem, is_passable),
        hierarchical=_length(hierarchical, problem, is_passable),
        took_s=took_s,
    )


def _peer(is_passable: Booleans, problem: Problem) -> Indices:
    """Find the cheapest route as a user of scipy would, (n,) numbers of cells."""
    _, height = is_passable.shape
    padded = np.pad(is_passable, 1)
    number = np.arange(is_passable.size).reshape(is_passable.shape)
    rows = []
    columns = []
    lengths = []
    for di, dj in ((1, 0), (0, 1), (1, 1), (-1, 1)):
        beyond = np.roll(padded, (-di, -dj), (0, 1))
        beside_i = np.roll(padded, -di, 0)
        beside_j = np.roll(padded, -dj, 1)
        is_open = (padded & beyond & beside_i & beside_j)[1:-1, 1:-1]
        rows.append(number[is_open])
        columns.append(number[is_open] + di * height + dj)
        lengths.append(np.full(int(is_open.sum()), np.hypot(di, dj)))

    entries = (np.concatenate(lengths), (np.concatenate(rows), np.concatenate(columns)))
    links = sparse.csr_matrix(entries, shape=(is_passable.size, is_passable.size))
    start = int(number[problem.start])
    goal = int(number[problem.goal])
    _, upward = dijkstra(links, directed=False, indices=goal, return_predecessors=True)

    route = [start]
    while route[-1] != goal and upward[route[-1]] >= 0:
        route.append(int(upward[route[-1]]))
    return np.array(route)


def _quality(problems: Sequence[Problem], outcomes: Sequence[Outcome]) -> Metrics:
    """Return how many problems were solved both ways, and how long the routes are."""
    flat = []
    hierarchical = []
    solved = 0
    for problem, outcome in zip(problems, outcomes, strict=True):
        if outcome.flat is None or outcome.hierarchical is None:
            continue

        solved += 1
        if problem.optimal > 0:
            flat.append(outcome.flat / problem.optimal)
            hierarchical.append(outcome.hierarchical / problem.optimal)

    return {
        "problems": float(len(problems)),
        "solved_share": solved / len(problems),
        "flat_over_optimal": float(np.mean(flat or [1.0])),
        "hierarchical_over_optimal": float(np.mean(hierarchical or [1.0])),
        "hierarchical_over_optimal_max": max(hierarchical, default=1.0),
    }


def _speed(outcomes: Sequence[Outcome]) -> Metrics:
    """Return the mean times, and their ratios."""
    took_s = np.array([outcome.took_s for outcome in outcomes])
    flat_s, hierarchical_s, dijkstra_s = took_s.mean(axis=0).tolist()
    return {
        "hierarchical_speedup": flat_s / hierarchical_s,
        "time_vs_dijkstra": flat_s / dijkstra_s,
        "flat_ms": 1e3 * flat_s,
        "hierarchical_ms": 1e3 * hierarchical_s,
        "dijkstra_ms": 1e3 * dijkstra_s,
    }


def _updating(graph: Graph, build_s: float) -> Metrics:
    """Return the time to make the coarse maps, and to change them if a part of the map around the
    agent is closed.
    """
    agent = graph.agent
    assert agent is not None
    corner = np.rint(np.array([agent.x_m, agent.y_m]) / CELL_M).astype(np.int64)
    closed = corner + np.argwhere(np.ones((CLOSED_CELLS, CLOSED_CELLS)))
    graph.change([_column(PlaceColumn.OBSTACLE, closed, 1.0)])

    task = Task(task_id="0/coarse_places", codelet="coarse_places", cycle=0, version=0)
    update_s, _ = _timed(partial(coarse_places.run, task, graph, NoSettings()))
    return {"hierarchy_build_ms": 1e3 * build_s, "hierarchy_update_ms": 1e3 * update_s}


def _length(answer: Answer, problem: Problem, is_passable: Booleans) -> float | None:
    """Return the length in cells of the route in an answer, None if it cannot be driven or there is
    none.
    """
    for operation in answer.operations:
        if isinstance(operation, Goal) and operation.reached_ns != NEVER_NS:
            return 0.0
        if isinstance(operation, Plan) and operation.route is not None:
            route = operation.route.numpy() / CELL_M
            cells = np.rint(route).astype(np.int64)
            ends = cells[[0, -1]].tolist()
            if ends == [list(problem.start), list(problem.goal)] and _is_open(cells, is_passable):
                return float(np.hypot(*np.diff(route, axis=0).T).sum())

    return None


def _is_open(cells: Indices, is_passable: Booleans) -> bool:
    """Decide whether (n, 2) cells are neighbours one after the other, free, and cut no corner."""
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


def _timed(work: Callable[[], T]) -> tuple[float, T]:
    """Return the seconds that `work` took, and what it returned."""
    began_s = time.perf_counter()
    result = work()
    return time.perf_counter() - began_s, result
