"""The shortest closed tour, exact: an integer programme with subtour cuts (Dantzig, Fulkerson and
Johnson 1954), solved by HiGHS.

The linear relaxation comes first, cut until a fractional tour enters and leaves every set of goals.
An edge whose reduced cost is larger than what a known tour is longer than the relaxation is in no
shorter tour. So the programme is solved in whole numbers with the edges of small reduced costs
only, and solved again with more of them where the tour found does not exclude all others.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, linprog, milp
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, maximum_flow

from cogmap.errors import CogmapError
from cogmap.geometry.arrays import Booleans, Floats, Indices

_FIRST_SLACK = 0.01
_MORE_SLACK = 4.0
_ROUNDING = 1e-7
# Flows are computed with whole capacities; a set is cut where less than two enters it by so much.
_CAPACITY = 10**6
_MIN_VIOLATION = 200


@dataclass
class _Programme:
    """The edges (m, 2) between `count` goals, their lengths (m,), and `sets` (k of (count,)) of
    goals that a tour must leave.
    """

    count: int
    edges: Indices
    lengths: Floats
    sets: list[Booleans] = field(default_factory=list)

    @property
    def degrees(self) -> csr_array:
        """Return which edges end in each goal, (count, m)."""
        number = len(self.edges)
        goals = self.edges.ravel()
        columns = np.repeat(np.arange(number), 2)
        ones = np.ones(2 * number)
        return csr_array((ones, (goals, columns)), shape=(self.count, number))

    @property
    def cuts(self) -> csr_array:
        """Return which edges leave each set, (k, m)."""
        first, second = self.edges.T
        rows = np.zeros((len(self.sets), len(self.edges)))

        for row, members in zip(rows, self.sets, strict=True):
            row[:] = members[first] != members[second]

        return csr_array(rows)

    def reduced(self, is_kept: Booleans) -> _Programme:
        """Return the same with fewer edges; a set that is added to one is added to both."""
        edges = self.edges[is_kept]
        lengths = self.lengths[is_kept]
        return _Programme(self.count, edges, lengths, self.sets)

    def graph(self, values: Floats) -> csr_array:
        """Return the edges that have a value, with it: (count, count), symmetric."""
        has_value = values > _ROUNDING
        first, second = self.edges[has_value].T

        rows = np.append(first, second)
        columns = np.append(second, first)
        both = np.tile(values[has_value], 2)
        return csr_array((both, (rows, columns)), shape=(self.count, self.count))


def shortest_tour(lengths: Floats) -> Indices:
    """Find the order (n,) of the shortest closed tour by (n, n) symmetric lengths, beginning with
    0.

    A hundred goals take seconds, or half a minute. Raises CogmapError if the solver fails.
    """
    count = len(lengths)
    if count < 4:
        return np.arange(count)

    first, second = np.triu_indices(count, 1)
    edges = np.column_stack([first, second])
    programme = _Programme(count, edges, lengths[first, second])
    bound, reduced_costs = _relaxation(programme)
    slack = _FIRST_SLACK * bound

    while True:
        kept = programme.reduced(reduced_costs <= slack)
        chosen = _whole(kept)
        if chosen is None and len(kept.edges) == len(programme.edges):
            raise CogmapError("no shortest tour: the solver of the integer programme found none")
        if chosen is None:
            slack *= _MORE_SLACK
            continue

        excess = float(kept.lengths @ chosen) - bound
        if excess <= slack:
            return _visited(kept.graph(chosen))
        slack = excess * (1 + _ROUNDING)


def _relaxation(programme: _Programme) -> tuple[float, Floats]:
    """Return the length of the shortest fractional tour, and by how much longer each edge (m,) that
    it lacks would make it; cuts are added to the programme.
    """
    while True:
        result = linprog(
            programme.lengths,
            A_ub=-programme.cuts,
            b_ub=np.full(len(programme.sets), -2.0),
            A_eq=programme.degrees,
            b_eq=np.full(programme.count, 2.0),
            bounds=(0, 1),
            method="highs",
        )
        if result.x is None:
            raise CogmapError(f"no shortest tour: {result.message}")
        violated = _violated_sets(programme.graph(result.x))
        if not violated:
            return float(result.fun), np.asarray(result.lower.marginals)
        programme.sets += violated


def _whole(programme: _Programme) -> Floats | None:
    """Choose the edges (m,) of the shortest tour, 1 or 0; None if there is no tour of them."""
    while True:
        leaves_sets = LinearConstraint(programme.cuts, 2, np.inf)
        result = milp(
            programme.lengths,
            constraints=[LinearConstraint(programme.degrees, 2, 2), leaves_sets],
            bounds=Bounds(0, 1),
            integrality=np.ones(len(programme.edges)),
            options={"mip_rel_gap": 0.0},
        )
        if result.x is None:
            return None

        chosen: Floats = np.rint(result.x)
        tours, tour = connected_components(programme.graph(chosen), directed=False)
        if tours == 1:
            return chosen
        programme.sets += [tour == number for number in range(tours)]


def _violated_sets(graph: csr_array) -> list[Booleans]:
    """Return sets of goals that a fractional tour leaves by less than two edges."""
    parts, part = connected_components(graph, directed=False)
    if parts > 1:
        return [part == number for number in range(parts)]

    capacities = csr_array(graph)
    whole = np.rint(graph.data * _CAPACITY)
    capacities.data = whole.astype(np.int32)
    violated: dict[bytes, Booleans] = {}

    for goal in range(1, graph.shape[0]):
        flow = maximum_flow(capacities, 0, goal)
        if flow.flow_value < 2 * _CAPACITY - _MIN_VIOLATION:
            # The goals that more could flow to from goal 0.
            residual = capacities - flow.flow
            residual.data[residual.data < 0] = 0
            residual.eliminate_zeros()
            members = np.zeros(residual.shape[0], bool)
            members[breadth_first_order(residual, 0, return_predecessors=False)] = True
            violated[members.tobytes()] = members

    return list(violated.values())


def _visited(graph: csr_array) -> Indices:
    """Return the goals in the order of the tour that the graph consists of, to the nearer number
    first.
    """
    order = [0]
    before = -1

    while True:
        here = order[-1]
        neighbours = sorted(graph.indices[graph.indptr[here] : graph.indptr[here + 1]].tolist())
        following = [goal for goal in neighbours if goal != before]
        before = here
        if following[0] == 0:
            return np.array(order, np.int64)
        order.append(following[0])
