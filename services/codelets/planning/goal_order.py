"""The order in which the agent visits its goals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cogmap.geometry.arrays import Floats, Indices
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.tours import TourSettings, order_from


def goal_order(
    lengths: Floats, positions_m: Floats, before: Indices | None, config: Config
) -> list[int]:
    """The order of n goals by (n + 1, n + 1) lengths and (n + 1, 2) positions, the first being the
    agent's.

    The order `before`, as `order_before` returns it, is kept while it is nearly as short, so that
    the agent does not waver.
    """
    settings = TourSettings(config.tour_levels, config.tour_factor, config.working_memory)
    best = order_from(lengths, positions_m, settings)

    longest_m = config.keep_route * _tour_m(lengths, best)
    if before is not None and _tour_m(lengths, before) <= longest_m:
        best = before

    return [number - 1 for number in best.tolist()[1:]]


def order_before(names: list[str], planned: Sequence[str]) -> Indices | None:
    """The planned order of goals, as (n + 1,) numbers of `names` from 1 on, after the agent's 0;
    None where one of them was not planned.
    """
    if not set(names) <= set(planned):
        return None

    order = [names.index(name) + 1 for name in planned if name in names]
    return np.array([0, *order])


def _tour_m(lengths: Floats, order: Indices) -> float:
    """The length of an open tour."""
    steps = lengths[order[:-1], order[1:]]
    return float(steps.sum())
