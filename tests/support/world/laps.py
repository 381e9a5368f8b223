"""Noisy laps round a square, as pose graphs for the solvers of map correction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cogmap.estimation.pose_graph import Constraints, PoseGraph
from cogmap.geometry.se2 import integrate

SIDE = 20
LAP = 4 * SIDE
EVERY = 9
MIN_APART_M = 5
STEP_SD = np.array([0.05, 0.05, 0.01])
CLOSURE_SD = np.array([0.3, 0.3, 0.05])
START = np.zeros(3)

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Laps:
    """True poses, the graph of what was measured, and which of its closures are true."""

    truth: Floats
    graph: PoseGraph
    is_true: npt.NDArray[np.bool_]

    def with_closures(self, closures: Constraints) -> PoseGraph:
        """The same path with other closures."""
        return PoseGraph(self.graph.poses, self.graph.steps, closures)

    def without_closures(self) -> PoseGraph:
        """The path alone."""
        none = self.graph.closures.select(slice(0, 0))
        return self.with_closures(none)


def between(
    first: npt.NDArray[np.int64], second: npt.NDArray[np.int64], measured: Floats, sd: Floats
) -> Constraints:
    """Constraints of equal standard deviations (x, y, heading)."""
    information = np.diag(sd**-2.0)
    each = np.tile(information, (len(first), 1, 1))
    return Constraints(first, second, measured, each)


def one_between(
    first: int, second: int, measured: tuple[float, float, float], sd: Floats
) -> Constraints:
    """A single constraint."""
    return between(np.array([first]), np.array([second]), np.array([measured]), sd)


def steps_along(measured: Floats, sd: Floats) -> Constraints:
    """The constraints from each pose to the next."""
    at = np.arange(len(measured))
    return between(at, at + 1, measured, sd)


def laps(count: int = 3, seed: int = 0, false: int = 0) -> Laps:
    """Laps with noise, closures between one lap and the next, and `false` ones elsewhere."""
    rng = np.random.default_rng(seed)
    exact = np.tile([1.0, 0.0, 0.0], (count * LAP, 1))
    exact[SIDE - 1 :: SIDE, 2] = np.pi / 2
    truth = integrate(START, exact)
    noisy = exact + rng.normal(0.0, 1.0, exact.shape) * STEP_SD

    ends = [(first, first + LAP) for first in range(0, len(truth) - LAP, EVERY)]
    ends += _false_ends(rng, truth, false)
    i, j = np.array(ends).T
    measured = rng.normal(0.0, 1.0, (len(ends), 3)) * CLOSURE_SD
    closures = between(i, j, measured, CLOSURE_SD)

    steps = steps_along(noisy, STEP_SD)
    graph = PoseGraph(integrate(START, noisy), steps, closures)
    is_true = (j - i) % LAP == 0
    return Laps(truth, graph, is_true)


def _false_ends(rng: np.random.Generator, truth: Floats, number: int) -> list[tuple[int, int]]:
    """So many pairs of poses at different places, as loop detection may mistake them."""
    ends: list[tuple[int, int]] = []
    while len(ends) < number:
        first, second = np.sort(rng.integers(0, len(truth), 2)).tolist()
        offset_m = (truth[first] - truth[second])[:2]
        if second - first > SIDE and np.hypot(*offset_m) > MIN_APART_M:
            ends.append((first, second))
    return ends


def error_m(poses: Floats, truth: Floats) -> float:
    """The root mean square distance of the positions; both paths begin at one pose."""
    offsets_m = (poses - truth)[:, :2]
    squared_m2 = (offsets_m**2).sum(axis=1)
    return float(np.sqrt(squared_m2.mean()))
