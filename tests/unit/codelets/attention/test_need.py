"""A need that is high is brought forward, and is bad."""

from __future__ import annotations

import pytest

from cogmap.schemas.cognition import Coalition
from cogmap.schemas.nodes import (
    PLAN_ID,
    Goal,
    Need,
    Object,
    Plan,
    PlanState,
    goal_id,
    need_id,
    object_id,
)
from cogmap.services.codelets.attention.need import Config
from cogmap.testing import agent, graph_of, task
from tests.support.world.scenes import run

CONFIG = Config()


def _found(*needs: Need) -> list[Coalition]:
    return run(task("need"), graph_of(agent(), *needs), CONFIG).coalitions


def _need(level: float, salience: float = 0.0) -> Need:
    return Need(
        id=need_id("energy"), label="energy", level=level, activation=level, salience=salience
    )


@pytest.mark.parametrize(("level", "number"), [(0.0, 0), (0.39, 0), (0.4, 1), (1.0, 1)])
def test_a_need_is_brought_from_the_level_on_at_which_it_is_high(level: float, number: int) -> None:
    assert len(_found(_need(level))) == number


def test_a_need_without_a_feeling_of_its_own_is_as_bad_as_it_is_high() -> None:
    (found,) = _found(_need(0.75))
    (own,) = _found(_need(0.75, salience=-0.25))

    assert [node.id for node in found.nodes] == ["self", "need:energy"]
    assert found.nodes[1].salience == -0.75
    assert own.nodes[1].salience == -0.25


def test_the_higher_a_need_the_more_active_is_its_coalition() -> None:
    activations = [_found(_need(level))[0].activation for level in (0.5, 0.75, 1.0)]

    assert activations == sorted(activations)
    assert activations[-1] > activations[0]


def _charging_place(label: str, x_m: float, function: str = "charge") -> Object:
    return Object(id=object_id(label), label=label, function=function, x_m=x_m, y_m=0.0)


def test_the_nearest_object_that_satisfies_the_need_is_brought_with_it() -> None:
    near = _charging_place("charging-place", 20.0)
    far = _charging_place("41a", -50.0)
    bakery = _charging_place("bakery", 5.0, "shop")
    (found,) = run(
        task("need"), graph_of(agent(), _need(0.75), near, far, bakery), CONFIG
    ).coalitions

    assert [node.id for node in found.nodes] == ["self", "need:energy", near.id]
    assert found.nodes[2].salience == 0.75


def test_the_next_object_is_brought_where_the_nearest_cannot_be_reached() -> None:
    near = _charging_place("charging-place", 20.0)
    far = _charging_place("41a", -50.0)
    goal = Goal(id=goal_id("energy"), object=near.label, need="energy")
    plan = Plan(id=PLAN_ID, state=PlanState.NO_ROUTE, unreachable={goal.id: PlanState.NO_ROUTE})
    graph = graph_of(agent(), _need(0.75), near, far, goal, plan)
    (found,) = run(task("need"), graph, CONFIG).coalitions

    assert found.nodes[-1].id == far.id


def test_where_nothing_is_known_that_satisfies_it_the_need_is_brought_alone() -> None:
    (found,) = _found(_need(0.75))

    assert [node.id for node in found.nodes] == ["self", "need:energy"]
