"""Action selection as a module: one action for the behaviours of each broadcast."""

from __future__ import annotations

import pytest

from cogmap.runtime.module import Module
from cogmap.schemas.cognition import Action
from cogmap.services.action.module import Config, build
from tests.support.world.behaviours import behaviour, behaviours_of, lacking

FOLLOW = behaviour("follow", 1.0, action="follow_plan", parameters={"x_m": 2.0})
WEAK = behaviour("halt", 0.65)
SELECTORS = ["behaviour_net", "most_active"]


def _module(selector: str = "most_active") -> Module:
    config = Config(selector=selector)  # type: ignore[arg-type]
    return build(config, "action")


def _action(module: Module, cycle: int = 1) -> Action:
    (action,) = module.feed(behaviours_of(WEAK, cycle=cycle))
    assert isinstance(action, Action)
    return action


@pytest.mark.parametrize("selector", SELECTORS)
def test_the_behaviours_of_a_broadcast_lead_to_an_action(selector: str) -> None:
    (action,) = _module(selector).feed(behaviours_of(WEAK, FOLLOW, cycle=7))

    assert isinstance(action, Action)
    assert (action.scheme, action.action, action.cycle) == ("follow", "follow_plan", 7)
    assert action.parameters == {"x_m": 2.0}
    assert [each.scheme for each in action.behaviours] == ["halt", "follow"]


@pytest.mark.parametrize("selector", SELECTORS)
def test_where_none_is_active_enough_that_is_published(selector: str) -> None:
    (action,) = _module(selector).feed(behaviours_of(lacking("dock", "target")))

    assert isinstance(action, Action)
    assert (action.scheme, action.action, action.activation) == ("", "", 0.0)
    assert action.threshold == pytest.approx(0.8)


@pytest.mark.parametrize("selector", SELECTORS)
def test_a_restarted_module_continues_as_if_it_had_not_been(selector: str) -> None:
    before = _module(selector)
    after = _module(selector)
    past = [_action(before, cycle) for cycle in (1, 2)]
    assert after.restore is not None
    after.restore(past)

    continued = _action(before, 3)
    restarted = _action(after, 3)

    assert restarted.behaviours == continued.behaviours
    assert (restarted.scheme, restarted.threshold) == (continued.scheme, continued.threshold)


def test_a_restarted_module_answers_nothing_twice() -> None:
    before = _module()
    after = _module()
    past = [_action(before, cycle) for cycle in (1, 2)]
    assert after.restore is not None
    after.restore(past)

    assert after.feed(behaviours_of(WEAK, cycle=2)) == []
    assert len(after.feed(behaviours_of(WEAK, cycle=3))) == 1
    assert len(after.feed(behaviours_of(WEAK, cycle=1))) == 1  # a workspace that begins anew


def test_one_action_stands_for_all_that_were_published() -> None:
    module = _module()
    actions = [_action(module, cycle) for cycle in (1, 2)]

    assert module.compact is not None
    compacted = module.compact()

    assert isinstance(compacted, Action)
    assert (compacted.cycle, compacted.threshold) == (2, actions[-1].threshold)
