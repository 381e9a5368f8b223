"""The goals that an agent has from its start."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from cogmap.errors import ConfigError
from cogmap.schemas.graph import Snapshot
from cogmap.schemas.nodes import NEVER_NS, Goal, goal_id
from cogmap.services.workspace.module import Config, build
from tests.support.world.scenes import Desk

INN = {"name": "inn", "object": "inn"}
KIOSK = {"name": "kiosk", "x_m": 12.0, "y_m": -3.0}


def _goals(desk: Desk) -> list[Goal]:
    """The goals that the workspace has committed, in order."""
    operations = [operation for delta in desk.deltas for operation in delta.operations]
    return [operation for operation in operations if isinstance(operation, Goal)]


def _config(**settings: Any) -> Config:
    return msgspec.convert(settings, Config)


def _after_a_cycle(*goals: dict[str, object], in_order: bool = False) -> Desk:
    config = _config(goals=[*goals])
    desk = Desk("w1", goals=config.goals, in_order=in_order)
    desk.see(0)
    desk.work()
    return desk


def test_the_agent_has_its_goals_from_its_first_cycle_on() -> None:
    desk = _after_a_cycle(INN, KIOSK)
    inn, kiosk = _goals(desk)

    assert (inn.id, inn.object, inn.base_level) == (goal_id("inn"), "inn", 1.0)
    assert (kiosk.id, kiosk.object) == (goal_id("kiosk"), "")
    assert (kiosk.x_m, kiosk.y_m) == (12.0, -3.0)
    assert {goal.reached_ns for goal in (inn, kiosk)} == {NEVER_NS}
    assert {goal.after for goal in (inn, kiosk)} == {""}
    assert desk.deltas[0].cycle == 1


def test_goals_in_order_each_come_after_the_one_before() -> None:
    inn, kiosk = _goals(_after_a_cycle(INN, KIOSK, in_order=True))

    assert inn.after == ""
    assert kiosk.after == inn.id


def test_goals_may_be_given_later_and_are_given_once() -> None:
    desk = Desk("w1", goals=_config(goals=[INN]).goals, goals_after_s=0.5)
    given = []
    for frame in range(5):
        desk.see(frame)
        desk.work()
        given.append(len(_goals(desk)))

    assert given == [0, 0, 1, 1, 1]


def test_goals_are_given_once() -> None:
    desk = _after_a_cycle(INN)
    desk.see(1)
    desk.work()

    assert len(_goals(desk)) == 1


def test_a_restarted_workspace_gives_no_goal_again_that_was_taken_back() -> None:
    desk = _after_a_cycle(INN)
    assert desk.module.compact is not None
    snapshot = desk.module.compact()
    assert isinstance(snapshot, Snapshot)

    left = [node for node in snapshot.nodes if not isinstance(node, Goal)]
    without = msgspec.structs.replace(snapshot, nodes=left)

    after = Desk("w1", goals=_config(goals=[INN]).goals)
    assert after.module.restore is not None
    after.module.restore([without])
    after.see(1)
    after.work()

    assert after.deltas
    assert _goals(after) == []


def test_two_goals_of_one_name_are_refused() -> None:
    config = _config(goals=[INN, KIOSK, INN])

    with pytest.raises(ConfigError, match=r"\[workspace\] goals: two are named 'inn'"):
        build(config, "workspace", ())
