"""The same loop, from a drive, closed by Gauss-Seidel iteration, which the paper calls the
reference, and by reverse replay: what is left of the errors after each pass over the path.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice

import numpy as np

from cogmap.estimation import printed_rule
from cogmap.estimation.gauss_seidel import NormalEquations, integrated_m, loop_passes, passes
from cogmap.estimation.pose_graph import PoseGraph
from cogmap.estimation.reverse_replay import (
    close_loops,
    displacements,
    position_cost,
)
from cogmap.experiments.loop_closing.observer import Loop, rms_m
from cogmap.geometry.arrays import Floats

GAUSS_SEIDEL = "gauss_seidel"
OVER_LOOPS = "gauss_seidel_over_loops"
REPLAY = "reverse_replay"
EQ9 = "eq9"
GAUSS_SEIDEL_PASSES = 1000
REPLAYS = 40
NEAR = 1.01
"""A cost within one percent of the least counts as solved."""


@dataclass(frozen=True)
class Curve:
    """After 0, 1, ... passes over the path, (k,) each: eq. 7 over its least, how far the positions
    are from those of the least cost, and from the truth, root mean squares.
    """

    cost_over_least: Floats
    from_solution_m: Floats
    path_error_m: Floats

    @property
    def solved_after(self) -> float | None:
        """Return after how many passes the cost is within one percent of the least; None if it
        never is.
        """
        near = np.flatnonzero(self.cost_over_least <= NEAR)
        return float(near[0]) if len(near) else None


@dataclass(frozen=True)
class Solvers:
    """The curve of each solver, how many places and closures it had, and the error of the path of
    the least cost from the truth.
    """

    curves: dict[str, Curve]
    places: int
    closures: int
    least_path_error_m: float


def solvers(loop: Loop) -> Solvers:
    """Solve the loop that a drive closed first, as it was before: from path integration alone, its
    headings being those believed.
    """
    graph = loop.constraints
    true_m = loop.before.true_path_m
    solution_m = NormalEquations(graph).solve()
    start_m = integrated_m(graph)

    replayed = [close_loops(graph, 0.0, count).positions_m for count in range(REPLAYS + 1)]
    paths = {
        GAUSS_SEIDEL: [start_m, *islice(passes(graph), GAUSS_SEIDEL_PASSES)],
        OVER_LOOPS: [start_m, *islice(loop_passes(graph), REPLAYS)],
        REPLAY: replayed,
        EQ9: _by_eq9(graph, start_m),
    }
    known = displacements(graph.poses, graph.constraints)
    least = position_cost(solution_m, graph.constraints, known)

    curves = {}
    for name, positions_m in paths.items():
        costs = [position_cost(each, graph.constraints, known) for each in positions_m]
        curves[name] = Curve(
            cost_over_least=np.array(costs) / least,
            from_solution_m=np.array([rms_m(each - solution_m) for each in positions_m]),
            path_error_m=np.array([rms_m(each - true_m) for each in positions_m]),
        )

    return Solvers(
        curves=curves,
        places=len(graph.poses),
        closures=len(graph.closures),
        least_path_error_m=rms_m(solution_m - true_m),
    )


def _by_eq9(graph: PoseGraph, start_m: Floats) -> list[Floats]:
    """Return the (n, 2) positions after 0, 1, ... replays by eq. 9 as it is printed."""
    closing = displacements(graph.poses, graph.closures)
    variance_m2 = np.trace(closing.covariance_m2, axis1=1, axis2=2) / 2
    step_m2 = graph.steps.variance_m2

    loops = printed_rule.Loops(graph.closures.i, graph.closures.j, -closing.offset_m, variance_m2)
    rates = printed_rule.rates(loops, step_m2)
    paths = [start_m]
    for _ in range(REPLAYS):
        paths.append(printed_rule.replayed(paths[-1], loops, rates))

    return paths
