"""Procedural memory as a module: behaviours for each broadcast, in the situation of its cycle."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cogmap.errors import ConfigError
from cogmap.runtime.module import Module
from cogmap.runtime.run import LOCKSTEP, REAL_TIME, Run
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Action, Behaviour, Behaviours, Broadcast, Coalition, Rejection
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.graph import Delta, Operation, Phase
from cogmap.schemas.nodes import (
    NEVER_NS,
    PLAN_ID,
    AnyNode,
    Episode,
    Plan,
    PlanState,
    Remembered,
    episode_id,
)
from cogmap.services.procedural.module import Config, build
from cogmap.testing import PERIOD_NS, agent
from tests.support.world.guidance import broadcast, driven, relations, selected
from tests.support.world.schemes import FOLLOW, HEADER, written

READY = Plan(id=PLAN_ID, state=PlanState.READY, base_level=1.0)
AT_GOAL = Plan(id=PLAN_ID, state=PlanState.AT_GOAL, base_level=1.0)


class Memory:
    """Procedural memory, and a graph that it follows."""

    def __init__(self, run: Run = LOCKSTEP, **settings: Any) -> None:
        self.module: Module = build(Config(**settings), "procedural", run)
        self._version = 0

    def commit(self, cycle: int, phase: Phase, *operations: Operation) -> list[Message]:
        """A delta of the workspace."""
        self._version += 1
        delta = Delta(version=self._version, cycle=cycle, phase=phase, operations=[*operations])
        return self.module.feed(delta)

    def pose(self, cycle: int) -> list[Message]:
        """A cycle as far as its pose."""
        before = self.commit(cycle, Phase.PERCEPTS)
        return [*before, *self.commit(cycle, Phase.LOCALIZATION, agent())]

    def broadcast(
        self, cycle: int, *nodes: AnyNode, feeling: Feeling = Feeling.NONE
    ) -> list[Message]:
        """A broadcast of the agent, or of these nodes."""
        content = [*nodes] or [agent(stationary_since_ns=NEVER_NS)]
        coalition = Coalition(codelet="whereabouts", activation=0.5, nodes=content, feeling=feeling)
        stamp_ns = cycle * PERIOD_NS
        return self.module.feed(
            Broadcast(stamp_ns=stamp_ns, cycle=cycle, trigger="t", coalition=coalition)
        )

    def action(self, cycle: int, scheme: str = "") -> list[Message]:
        """What was selected for the broadcast of a cycle."""
        stamp_ns = cycle * PERIOD_NS
        return self.module.feed(
            Action(stamp_ns=stamp_ns, cycle=cycle, scheme=scheme, activation=0.0, parameters={})
        )


def _memory(run: Run = LOCKSTEP, plan: Plan = READY) -> Memory:
    """One whose graph has a plan before cycle 1."""
    memory = Memory(run)
    memory.commit(0, Phase.END, plan)
    return memory


def _by_scheme(published: list[Message]) -> dict[str, Behaviour]:
    (behaviours,) = published
    assert isinstance(behaviours, Behaviours)
    return {each.scheme: each for each in behaviours.behaviours}


def _cycles(published: list[Message]) -> list[int]:
    return [each.cycle for each in published if isinstance(each, Behaviours)]


@pytest.mark.parametrize("run", [LOCKSTEP, REAL_TIME])
def test_a_plan_with_a_route_calls_for_following_it(run: Run) -> None:
    memory = _memory(run)
    memory.pose(1)

    found = _by_scheme(memory.broadcast(1))

    assert found["follow_route"].activation == pytest.approx(0.95)
    assert not found["follow_route"].rejection
    assert found["halt"].rejection is Rejection.CONTEXT_MISSING
    assert found["halt"].activation == 0.0


def test_following_the_route_needs_an_agent_that_knows_where_it_is() -> None:
    memory = _memory()
    memory.pose(1)

    found = _by_scheme(memory.broadcast(1, READY))

    assert found["follow_route"].rejection is Rejection.CONTEXT_MISSING
    assert found["follow_route"].context == {"self": 0.0, "plan state=ready": 1.0}


def test_a_recalled_episode_beside_the_agent_calls_for_nothing_else() -> None:
    bakery = Remembered(kind="object", label="bakery", salience=-1.0)
    recalled = Episode(
        id=episode_id(1),
        activation=0.5,
        salience=-0.5,
        number=1,
        run=1,
        x_m=0.0,
        y_m=0.0,
        from_ns=0,
        until_ns=1,
        content=[bakery],
    )
    with_it = _memory()
    with_it.pose(1)
    without = _memory()
    without.pose(1)

    found = _by_scheme(with_it.broadcast(1, agent(stationary_since_ns=NEVER_NS), recalled))
    assert found == _by_scheme(without.broadcast(1))


def test_the_end_of_the_route_calls_for_a_halt() -> None:
    memory = _memory(plan=AT_GOAL)
    memory.pose(1)

    found = _by_scheme(memory.broadcast(1))

    assert not found["halt"].rejection
    assert found["follow_route"].rejection is Rejection.CONTEXT_MISSING


def test_a_plan_that_is_broadcast_goes_before_that_of_the_graph() -> None:
    memory = _memory()
    memory.pose(1)

    assert not _by_scheme(memory.broadcast(1, AT_GOAL))["halt"].rejection


def test_a_scheme_may_depend_on_what_is_felt_about_the_broadcast(tmp_path: Path) -> None:
    text = FOLLOW.replace('"plan", state = "ready"', '"self", feeling = "danger"')
    memory = Memory(REAL_TIME, schemes=str(written(tmp_path, HEADER + text)))

    fearful = _by_scheme(memory.broadcast(1, feeling=Feeling.DANGER))
    calm = _by_scheme(memory.broadcast(2))

    assert fearful["follow"].context == {"self feeling=danger": 1.0}
    assert calm["follow"].rejection is Rejection.CONTEXT_MISSING


def test_in_lockstep_a_broadcast_waits_for_the_pose_of_its_cycle() -> None:
    memory = _memory()

    assert memory.broadcast(1) == []
    assert memory.commit(1, Phase.PERCEPTS) == []
    assert _cycles(memory.commit(1, Phase.LOCALIZATION, agent())) == [1]


def test_in_lockstep_a_cycle_without_a_pose_is_not_waited_for() -> None:
    memory = _memory()
    memory.broadcast(1)
    memory.commit(1, Phase.PERCEPTS)

    assert _cycles(memory.commit(1, Phase.END)) == [1]


def test_in_lockstep_the_plan_is_that_of_the_pose_whenever_the_broadcast_comes() -> None:
    early = _memory()
    early.broadcast(1)
    of_early = _by_scheme(early.pose(1))

    late = _memory()
    late.pose(1)
    late.commit(1, Phase.BACKGROUND, AT_GOAL)
    late.pose(2)
    of_late = _by_scheme(late.broadcast(1))

    assert of_late == of_early


def test_in_lockstep_a_broadcast_waits_for_the_action_of_the_one_before() -> None:
    memory = _memory()
    memory.pose(1)
    memory.broadcast(1)
    memory.pose(2)

    assert memory.broadcast(2) == []
    assert _cycles(memory.action(1)) == [2]


def test_in_lockstep_an_action_that_was_lost_is_given_up() -> None:
    memory = _memory()
    memory.pose(1)
    memory.broadcast(1)
    memory.pose(2)
    assert memory.broadcast(2) == []

    memory.pose(4)
    assert _cycles(memory.broadcast(4)) == [2]
    assert _cycles(memory.action(2)) == [4]


def test_in_real_time_nothing_is_waited_for() -> None:
    memory = _memory(REAL_TIME)

    assert _cycles(memory.broadcast(1)) == [1]
    assert _cycles(memory.broadcast(2)) == [2]


def test_an_agent_that_moves_as_expected_makes_the_scheme_more_reliable() -> None:
    memory = _memory()
    memory.pose(1)
    memory.broadcast(1)
    memory.action(1, "follow_route")
    memory.pose(2)

    found = _by_scheme(memory.broadcast(2))["follow_route"]

    assert (found.executions, found.successes, found.reliability) == (1, 1, 1.0)


def test_a_restarted_module_keeps_what_it_learned_and_answers_nothing_twice() -> None:
    before = _memory(REAL_TIME)
    before.broadcast(1)
    before.action(1, "follow_route")
    past = before.broadcast(2)
    after = _memory(REAL_TIME)
    assert after.module.restore is not None
    after.module.restore(past)

    assert after.broadcast(2) == []
    assert _by_scheme(after.broadcast(3))["follow_route"].executions == 1


def test_a_graph_that_is_loaded_as_a_whole_has_its_plan() -> None:
    memory = Memory()
    assert memory.module.graph is not None
    memory.module.graph.change([AT_GOAL])
    memory.module.loaded()

    assert not _by_scheme(memory.broadcast(0))["halt"].rejection


def test_a_kind_that_the_graph_does_not_find_by_kind_is_refused() -> None:
    with pytest.raises(ConfigError, match="graph_kinds names 'self': there are episode, goal"):
        Memory(graph_kinds=["plan", "self"])


def test_guidance_that_was_learned_is_journaled_and_known_after_a_restart() -> None:
    memory = _memory(REAL_TIME)
    published: list[Message] = []
    memory.module.feed(selected(1))
    for cycle in range(1, 60):
        at_m = complex(cycle)
        published += memory.module.feed(
            broadcast(cycle, driven(at_m, cycle=cycle), relations(at_m))
        )

    learned = [
        scheme for each in published if isinstance(each, Behaviours) for scheme in each.learned
    ]
    after = _memory(REAL_TIME)
    assert after.module.restore is not None
    assert after.module.compact is not None
    after.module.restore(published)
    compact = after.module.compact()

    assert len(learned) >= 10
    assert isinstance(compact, Behaviours)
    assert compact.learned == learned


@pytest.mark.parametrize(("participant", "executions"), [("sim", 1), ("player", 0)])
def test_what_follows_an_action_in_a_recording_teaches_nothing_about_its_scheme(
    participant: str, executions: int
) -> None:
    memory = _memory(Run(participants={participant: 1}))
    memory.pose(1)
    memory.broadcast(1)
    memory.action(1, "follow_route")

    # Long after, without the result that was expected.
    memory.pose(1000)
    found = _by_scheme(memory.broadcast(1000))

    assert found["follow_route"].executions == executions
