"""Guidance schemes are learned, come to mind, and are judged."""

from __future__ import annotations

import pytest

from cogmap.schemas.cognition import ActionName, Behaviour, GuidanceScheme
from cogmap.schemas.nodes import PLAN_ID, Plan, PlanState
from cogmap.services.procedural.guidance.guidance_memory import GuidanceMemory
from cogmap.services.procedural.patterns import Active
from cogmap.testing import PERIOD_NS
from tests.support.world.guidance import broadcast, driven, guidance, relations, selected
from tests.support.world.schemes import active

NO_GOAL = Plan(id=PLAN_ID, state=PlanState.NO_GOAL, base_level=1.0)
LONG_AFTER = 150


def _memory(*given: GuidanceScheme, limit: int = 100) -> GuidanceMemory:
    return GuidanceMemory(given, limit, step_m=2.0, ahead_m=10.0)


def _behaviours(
    memory: GuidanceMemory,
    at_m: complex = 0j,
    heading_rad: float = 0.0,
    looks: tuple[str, ...] = (),
    plan: Plan = NO_GOAL,
) -> list[Behaviour]:
    """What comes to mind of the town as seen from there."""
    seen = relations(at_m, heading_rad, *looks)
    conscious = broadcast(1, driven(at_m, heading_rad), seen)
    memory.on_broadcast(conscious)
    nodes: tuple[Active, ...] = active(*conscious.coalition.nodes, plan)
    return memory.behaviours(conscious, nodes)


def _drive(memory: GuidanceMemory, metres: int) -> list[GuidanceScheme]:
    memory.on_action(selected(1))
    learned = []
    for cycle in range(1, metres + 1):
        at_m = complex(cycle)
        learned += memory.on_broadcast(broadcast(cycle, driven(at_m, cycle=cycle), relations(at_m)))
    return learned


def test_what_stood_where_calls_for_the_path_that_was_driven_from_there() -> None:
    (found,) = _behaviours(_memory(guidance()))

    assert (found.scheme, found.action) == ("guide_1", ActionName.GUIDE)
    assert found.parameters == pytest.approx(
        {
            "seen_ns": PERIOD_NS,
            "ahead_1_m": 0.0,
            "left_1_m": 0.0,
            "ahead_2_m": 10.0,
            "left_2_m": 0.0,
        }
    )


def test_from_beside_it_the_path_is_where_it_was_driven() -> None:
    (found,) = _behaviours(_memory(guidance()), at_m=1 + 2j, heading_rad=0.1)

    ahead_m, left_m = found.parameters["ahead_2_m"], found.parameters["left_2_m"]
    assert ahead_m == pytest.approx(8.75, abs=0.1)
    assert left_m == pytest.approx(-2.9, abs=0.1)


def test_the_scheme_that_was_learned_nearest_comes_to_mind() -> None:
    memory = _memory(guidance("near", 1 + 0j), guidance("far", 4 + 0j))

    (here,) = _behaviours(memory, 1.5 + 0j)
    (there,) = _behaviours(memory, 3.5 + 0j)

    assert (here.scheme, there.scheme) == ("near", "far")


def test_fewer_landmarks_call_for_it_less() -> None:
    (by_all,) = _behaviours(_memory(guidance()))
    (by_some,) = _behaviours(_memory(guidance()), looks=("bakery", "school"))

    assert by_some.activation < by_all.activation
    assert _behaviours(_memory(guidance()), 1 + 1j, looks=("bakery",)) == []


def test_an_agent_with_a_plan_is_not_guided() -> None:
    ready = Plan(id=PLAN_ID, state=PlanState.READY, base_level=1.0)

    assert _behaviours(_memory(guidance()), plan=ready) == []


def test_a_drive_is_learned_and_does_not_compete_until_it_is_given() -> None:
    memory = _memory()
    learned = _drive(memory, 20)

    assert [scheme.name for scheme in learned] == [f"guide_{n}" for n in range(1, 6)]
    assert memory.kept == learned
    assert _behaviours(memory) == []
    assert _behaviours(_memory(*learned), 1 + 0j) != []


def test_an_agent_that_is_guided_learns_nothing_new() -> None:
    memory = _memory(guidance())
    (found,) = _behaviours(memory)
    memory.on_action(selected(1, ActionName.GUIDE, "guide_1", found.parameters))

    for cycle in range(2, 30):
        at_m = complex(cycle)
        memory.on_broadcast(broadcast(cycle, driven(at_m, cycle=cycle), relations(at_m)))

    assert [scheme.name for scheme in memory.kept] == ["guide_1"]


@pytest.mark.parametrize(("end_m", "successes"), [(9 + 0j, 1), (3 + 3j, 0)])
def test_a_scheme_is_as_reliable_as_the_agent_comes_to_the_end_of_its_path(
    end_m: complex, successes: int
) -> None:
    memory = _memory(guidance())
    (found,) = _behaviours(memory)
    memory.on_action(selected(1, ActionName.GUIDE, "guide_1", found.parameters))

    (judged,) = memory.on_broadcast(broadcast(LONG_AFTER, driven(end_m), {}))
    (again,) = _behaviours(memory)

    assert (judged.executions, judged.successes) == (1, successes)
    assert again.reliability == successes


def test_the_oldest_of_too_many_is_forgotten() -> None:
    memory = _memory(limit=3)
    learned = _drive(memory, 20)

    assert memory.kept == learned[-3:]


def test_what_was_published_is_known_again_and_numbers_go_on() -> None:
    learned = _drive(_memory(), 14)
    memory = _memory()
    memory.restore(learned)

    assert memory.kept == learned
    assert _drive(memory, 14)[0].name == f"guide_{len(learned) + 1}"


def test_an_action_without_a_path_is_not_judged() -> None:
    memory = _memory(guidance())
    _behaviours(memory)
    memory.on_action(selected(1, ActionName.GUIDE, "guide_1", {"seen_ns": "late"}))

    assert memory.on_broadcast(broadcast(LONG_AFTER, driven(), {})) == []
