"""Plans to drive: routes past place nodes a metre apart."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cogmap.geometry.polylines import distances_along, points_at
from cogmap.runtime.module import Module
from cogmap.schemas.array import Matrix
from cogmap.schemas.graph import Operation
from cogmap.schemas.nodes import PLAN_ID, Plan, PlanState

Floats = npt.NDArray[np.float64]
Point = tuple[float, float]


def places_m(*corners: Point) -> Floats:
    """(n, 2): place nodes a metre apart along straight streets between corners, these included."""
    line_m = np.array(corners, float)
    along_m = distances_along(line_m)
    steps_m = np.arange(0.0, along_m[-1], 1.0)

    return points_at(line_m, np.union1d(steps_m, along_m))


def plan_along(*corners: Point, planned_ns: int = 1) -> Plan:
    """A plan whose route leads past corners."""
    route = Matrix.of(places_m(*corners))
    return Plan(id=PLAN_ID, state=PlanState.READY, planned_ns=planned_ns, route=route)


def joined(module: Module, *nodes: Operation) -> Module:
    """The module as it joins a system whose graph has these nodes."""
    assert module.graph is not None
    module.graph.change([*nodes])
    module.loaded()
    return module
