"""Several goals in an order that makes the route short: roughly on a coarse map, then refined on
finer ones (paper §5.5, figure 5 D; Madl et al. 2013).

The goals lie on a hierarchy of grids. The occupied cells of the coarsest are ordered first, each
standing for the goals in it, by following activation. Each cell is then replaced by its cells on
the next finer grid, in the same manner, down to the goals themselves. On every grid, successive
stops are put into their best order, as many at a time as working memory holds. At the end the route
is straightened, which removes what crosses.

Lengths are those along the map, from whatever planner. They are added up as whole numbers, so that
ties are broken the same everywhere, in favour of the goal that comes first.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cogmap.errors import CogmapError
from cogmap.geometry.arrays import Floats, Indices
from cogmap.services.codelets.planning.activation import DECAY_PER_CELL
from cogmap.services.codelets.planning.tour_refinement import length_of, reorder, straighten

# Of the longest length: sums of thousands of lengths stay exact.
_UNITS = 2**40
_START = 0


class TourSettings(NamedTuple):
    """`levels` grids, the first of `factor` by `factor` cells, each cell divided so on the next;
    `span` goals fit into working memory at a time. With `straightens` the whole route is looked at
    again in the end, and any part of it reversed that is shorter so.

    Three levels and factor 3 are those of Madl et al. (2013), a span of four chunks that of Cowan
    (2001).
    """

    levels: int = 3
    factor: int = 3
    span: int = 4
    straightens: bool = True


def order(lengths: Floats, positions_m: Floats, settings: TourSettings) -> Indices:
    """Find the order (n,) in which a closed tour visits n goals, beginning with goal 0.

    `lengths` (n, n), in any one unit, are symmetric and finite; `positions_m` (n, 2) are where the
    goals lie on the map. Raises CogmapError where `lengths` are not so.
    """
    return _ordered(_units(lengths), positions_m, settings, closed=True)


def order_from(lengths: Floats, positions_m: Floats, settings: TourSettings) -> Indices:
    """Find the order (n,) of a route from point 0, the agent, past all other points; it ends at the
    last.

    Otherwise as `order`.
    """
    return _ordered(_units(lengths), positions_m, settings, closed=False)


def follow_activation(lengths: Floats) -> Indices:
    """Find the order (n,) on one flat grid (figure 5 C): from goal 0 on, always to the goal whose
    activation is highest there, which is the nearest; of equally near ones the first.

    Raises CogmapError as `order` does.
    """
    units = _units(lengths)
    is_left = np.ones(len(units), bool)
    visited: list[int] = []
    here = _START

    while is_left.any():
        visited.append(here)
        is_left[here] = False
        to_those_left = np.where(is_left, units[here], np.iinfo(np.int64).max)
        here = int(to_those_left.argmin())

    return np.array(visited, np.int64)


def route_length(lengths: Floats, visited: Indices, *, closed: bool) -> float:
    """Measure the route past `visited` (n,) in that order, and back to the first where it is
    closed.
    """
    following = np.roll(visited, -1)
    legs = lengths[visited, following]
    if not closed:
        legs = legs[:-1]
    return float(legs.sum())


def _units(lengths: Floats) -> Indices:
    """Round `lengths` to whole numbers. Raises CogmapError if they are not symmetric and finite."""
    is_square = lengths.ndim == 2 and lengths.shape[0] == lengths.shape[1]
    is_finite = bool(np.isfinite(lengths).all())
    if not is_square or not is_finite or not np.allclose(lengths, lengths.T):
        raise CogmapError(
            "the lengths between goals must be a symmetric square of finite numbers: "
            "leave out the goals that cannot be reached"
        )

    longest = float(lengths.max(initial=0.0)) or 1.0
    units = np.rint(lengths * (_UNITS / longest)).astype(np.int64)
    return np.maximum(units, units.T)


def _ordered(
    units: Indices, positions_m: Floats, settings: TourSettings, *, closed: bool
) -> Indices:
    """Find the order of stops, the end of the route being a stop of its own, with the number n."""
    end = len(units)
    if end <= 2:
        return np.arange(end)

    # The end stands where the start does; of an open route no length leads to it.
    lengths = np.pad(units, (0, 1))
    if closed:
        lengths[:-1, -1] = units[:, _START]
        lengths[-1, :-1] = units[_START]

    route = np.array([_START, end])
    clusters = [np.arange(1, end)]
    for level, cells in enumerate(grids(positions_m, settings), start=1):
        cell_length = lengths.max() / settings.factor**level
        clusters = _finer(clusters, cells, lengths, cell_length)

        # A goal stands for each cluster; as many as `span` at a time are put into their best order.
        by_stop = {_middle(members, lengths): members for members in clusters}
        route = reorder(np.array([_START, *by_stop, end]), lengths, settings.span)
        clusters = [by_stop[stop] for stop in route[1:-1].tolist()]

    before = None
    while settings.straightens and length_of(route, lengths) != before:
        before = length_of(route, lengths)
        route = straighten(route, lengths)
        route = reorder(route, lengths, settings.span)

    return route[:-1]


def grids(positions_m: Floats, settings: TourSettings) -> list[Indices]:
    """Return the cell (n,) of each goal on every grid, the coarsest first, and at last the goals
    themselves. The grids cover the same square around all goals.
    """
    lowest_m = positions_m.min(axis=0)
    highest_m = positions_m.max(axis=0)
    side_m = float(np.max(highest_m - lowest_m)) or 1.0
    corner_m = (lowest_m + highest_m - side_m) / 2
    share = (positions_m - corner_m) / side_m

    found = []
    for level in range(1, settings.levels + 1):
        cells = settings.factor**level
        indices = np.floor(share * cells).astype(np.int64)
        column, row = np.clip(indices, 0, cells - 1).T
        found.append(column * cells + row)

    return [*found, np.arange(len(positions_m))]


def _finer(
    clusters: Sequence[Indices], cells: Indices, lengths: Indices, cell_length: float
) -> list[Indices]:
    """Divide each cluster of goals by the cells of the next grid, in the order of activation."""
    found: list[Indices] = []
    here = _START

    for cluster in clusters:
        left = [cluster[cells[cluster] == cell] for cell in np.unique(cells[cluster])]
        while left:
            # The logarithm of the activation that arrives here from each part.
            decays = [-DECAY_PER_CELL * lengths[here, part] / cell_length for part in left]
            activations = [float(np.logaddexp.reduce(decay)) for decay in decays]
            strongest = int(np.argmax(activations))
            found.append(left.pop(strongest))
            here = _middle(found[-1], lengths)

    return found


def _middle(members: Indices, lengths: Indices) -> int:
    """Return the goal of a cluster that is nearest to all others: it stands for them."""
    between = lengths[np.ix_(members, members)]
    nearest = between.sum(axis=0).argmin()
    return int(members[nearest])
