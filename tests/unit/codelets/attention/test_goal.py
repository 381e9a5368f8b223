"""Goals and the plan towards them are brought forward, all the more where they have changed."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, CycleContext, NoSettings
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.graph import Delta, Link, Operation, Phase
from cogmap.schemas.nodes import (
    NEVER_NS,
    PLAN_ID,
    Attention,
    Goal,
    LinkKind,
    Plan,
    PlanState,
    attention_id,
    goal_id,
)
from cogmap.services.codelets.attention import goal
from cogmap.testing import agent, graph_of, percepts
from tests.support.world.scenes import run

CONFIG = NoSettings()
INN = goal_id("inn")
TOWARDS = Link(source=PLAN_ID, target=INN, kind=LinkKind.TOWARDS)


def _inn(reached_ns: int = NEVER_NS) -> Goal:
    return Goal(id=INN, base_level=1.0, x_m=9.0, reached_ns=reached_ns)


def _plan(planned_ns: int = 1, **facts: Any) -> Plan:
    route = Matrix.of([[0.0, 0.0], [9.0, 0.0]])
    usual: dict[str, Any] = {"state": PlanState.READY, "goals": [INN], "route": route}
    return Plan(id=PLAN_ID, base_level=1.0, planned_ns=planned_ns, **(usual | facts))


class Story:
    """An agent with goals and plans, cycle by cycle."""

    def __init__(self, *operations: Operation) -> None:
        self.graph: Graph = graph_of(agent(), *operations)

    def cycle(self, *operations: Operation) -> dict[str, float] | None:
        """The salience of what is brought in the next cycle, by id; None where nothing is."""
        self._commit(Phase.BACKGROUND, list(operations), self.graph.cycle + 1)
        motions = Array.of(np.zeros((0, 5)))
        context = CycleContext(self.graph.cycle, percepts(self.graph.cycle), motions)
        answer = Answer()
        for asked in goal.due(context, self.graph, CONFIG):
            answer = run(asked, self.graph, CONFIG)

        self._commit(Phase.ATTENTION, answer.operations, self.graph.cycle)
        for found in answer.coalitions:
            return {node.id: node.salience for node in found.nodes}
        return None

    def waits(self) -> bool:
        """If nothing is brought for as long as the refractory period lasts."""
        return [self.cycle() for _ in range(goal.REFRACTORY_CYCLES)] == [
            None
        ] * goal.REFRACTORY_CYCLES

    def broadcast(self) -> None:
        """What was brought last becomes conscious."""
        memory = self.graph.get(Attention, attention_id("goal"))
        assert memory is not None
        conscious = msgspec.structs.replace(memory, conscious_cycle=self.graph.cycle)
        self._commit(Phase.PERCEPTS, [conscious], self.graph.cycle)

    def _commit(self, phase: Phase, operations: list[Operation], cycle: int) -> None:
        delta = Delta(
            version=self.graph.version + 1, cycle=cycle, phase=phase, operations=operations
        )
        assert self.graph.apply(delta)


def test_without_goals_and_plans_nothing_is_brought() -> None:
    assert Story().cycle() is None


def test_a_plan_that_is_new_is_salient_until_it_is_conscious() -> None:
    story = Story(_inn(), _plan(), TOWARDS)
    new = {"self": 0.0, PLAN_ID: 0.5, INN: 0.0}
    assert story.cycle() == new
    assert story.waits()
    assert story.cycle() == new

    story.broadcast()
    assert story.waits()
    assert story.cycle() == {"self": 0.0, PLAN_ID: 0.0, INN: 0.0}


def test_a_plan_to_explore_is_brought_without_a_goal() -> None:
    assert Story(_plan(goals=[], explores=True)).cycle() == {"self": 0.0, PLAN_ID: 0.5}


def test_a_goal_that_is_reached_is_salient_once() -> None:
    story = Story(_inn(), _plan(), TOWARDS)
    story.cycle()
    story.broadcast()
    arrived = _plan(2, state=PlanState.AT_GOAL, goals=[], route=None)
    assert story.cycle(_inn(reached_ns=5), arrived) is None
    for _ in range(goal.REFRACTORY_CYCLES - 1):
        assert story.cycle() is None

    assert story.cycle() == {"self": 0.0, PLAN_ID: 0.5, INN: 0.5}
    story.broadcast()
    assert [story.cycle() for _ in range(8)] == [None] * 8


def test_a_plan_that_has_no_route_is_brought_once() -> None:
    blocked = _plan(state=PlanState.NO_ROUTE, goals=[], route=None)
    story = Story(_inn(), blocked)
    assert story.cycle() == {"self": 0.0, PLAN_ID: 0.5}
    story.broadcast()

    assert [story.cycle() for _ in range(8)] == [None] * 8


def test_the_plan_is_linked_to_its_next_goal() -> None:
    graph = graph_of(agent(), _inn(), _plan(), TOWARDS)
    motions = Array.of(np.zeros((0, 5)))
    (asked,) = goal.due(CycleContext(1, percepts(1), motions), graph, CONFIG)
    (found,) = run(asked, graph, CONFIG).coalitions

    assert TOWARDS in found.links
