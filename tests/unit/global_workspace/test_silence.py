"""A competition that leads to no broadcast states why."""

from __future__ import annotations

from cogmap.runtime.module import Module
from cogmap.schemas.cognition import Coalition, Coalitions, Competition, Silence
from cogmap.services.global_workspace.module import Config, build

CYCLE_NS = 200_000_000
ENOUGH = 0.6
LITTLE = 0.1


def _module() -> Module:
    return build(Config(), "global_workspace")


def _compete(module: Module, cycle: int, stamp_ns: int, *activations: float) -> Competition:
    coalitions = [
        Coalition(codelet=f"codelet {number}", activation=activation, nodes=[])
        for number, activation in enumerate(activations)
    ]
    brought = Coalitions(stamp_ns=stamp_ns, cycle=cycle, coalitions=coalitions)
    *_, competition = module.feed(brought)
    assert isinstance(competition, Competition)
    return competition


def test_a_competition_with_a_broadcast_is_not_silent() -> None:
    competition = _compete(_module(), 1, CYCLE_NS, ENOUGH)

    assert competition.trigger
    assert competition.silence is Silence.NONE


def test_without_coalitions_that_is_the_reason() -> None:
    competition = _compete(_module(), 1, CYCLE_NS)

    assert competition.silence is Silence.NO_COALITION


def test_within_the_refractory_period_that_is_the_reason() -> None:
    module = _module()
    _compete(module, 1, CYCLE_NS, ENOUGH)
    competition = _compete(module, 2, CYCLE_NS + CYCLE_NS // 2, ENOUGH)

    assert competition.silence is Silence.REFRACTORY


def test_below_every_threshold_that_is_the_reason() -> None:
    module = _module()
    _compete(module, 1, CYCLE_NS, ENOUGH)
    competition = _compete(module, 2, 2 * CYCLE_NS, LITTLE)

    assert not competition.trigger
    assert competition.silence is Silence.NO_TRIGGER


def test_neutral_content_at_full_activation_is_broadcast_in_each_cycle() -> None:
    module = _module()
    competitions = [_compete(module, cycle, cycle * CYCLE_NS, 0.5) for cycle in range(1, 6)]

    assert all(competition.trigger for competition in competitions)
