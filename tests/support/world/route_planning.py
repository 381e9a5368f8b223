"""The route-plan codelet, asked by hand."""

from __future__ import annotations

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer
from cogmap.schemas.codelets import Task
from cogmap.schemas.nodes import (
    PLAN_ID,
    Goal,
    Plan,
    goal_id,
)
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.route_plan import run

STAMP_NS = 7_000_000_000


def goal_at(name: str, x_m: float, y_m: float) -> Goal:
    """A goal that is a position."""
    return Goal(id=goal_id(name), base_level=1.0, x_m=x_m, y_m=y_m)


def answered(graph: Graph, config: Config | None = None) -> Answer:
    """What the codelet answers now; it is applied to the graph."""
    task = Task(stamp_ns=STAMP_NS, task_id="1/route_plan", codelet="route_plan", cycle=1, version=0)
    answer = run(task, graph, config or Config())
    graph.change(answer.operations)
    return answer


def planned(graph: Graph, config: Config | None = None) -> Plan:
    """The plan that the graph has then."""
    answered(graph, config)
    plan = graph.get(Plan, PLAN_ID)
    assert plan is not None
    return plan
