"""Coalitions compete until a trigger fires and the winner is broadcast."""

from __future__ import annotations

import pytest

from cogmap.errors import MessageError
from cogmap.runtime.module import Module
from cogmap.schemas.cognition import Broadcast, Coalition, Coalitions, Competition, Fate, Trigger
from cogmap.services.global_workspace.module import Config, build

TICK_NS = 5_000_000


def _with_fate(competition: Competition, fate: Fate) -> dict[str, float]:
    """The activations of the contenders of one fate, by codelet."""
    activations = {}
    for each in competition.contenders:
        if each.fate is fate:
            activations[each.codelet] = each.activation
    return activations


class Arena:
    """A global workspace in which no trigger fires but those that a test lets."""

    def __init__(self, **settings: float) -> None:
        never = {
            "no_broadcast_ticks": 10**9,
            "aggregate_above": 99.0,
            "coalition_above": 99.0,
            "refractory_ticks": 0,
            "decay": 0.0,
        }
        config = Config(**(never | settings))  # type: ignore[arg-type]
        self.module: Module = build(config, "global_workspace")
        self._cycle = 0
        # Nothing was ever broadcast, so this is: silence is counted from here.
        self.compete(0, first=0.01)

    def compete(self, at_tick: float, **activations: float) -> tuple[Competition, Broadcast | None]:
        """Coalitions of attention codelets, by name, at a time in ticks."""
        self._cycle += 1
        coalitions = [
            Coalition(codelet=name, activation=activation, nodes=[])
            for name, activation in activations.items()
        ]
        messages = self.module.feed(
            Coalitions(stamp_ns=round(at_tick * TICK_NS), cycle=self._cycle, coalitions=coalitions)
        )
        (competition,) = [item for item in messages if isinstance(item, Competition)]
        broadcast = next((item for item in messages if isinstance(item, Broadcast)), None)

        assert (broadcast is not None) == bool(competition.trigger)
        assert broadcast is None or broadcast.trigger == competition.trigger

        return competition, broadcast

    def waiting(self, at_tick: float, **activations: float) -> dict[str, float]:
        """What is left of the activations of those that compete again in the next cycle."""
        return _with_fate(self.compete(at_tick, **activations)[0], Fate.WAITING)

    def trigger(self, at_tick: float, **activations: float) -> str:
        """The trigger that fires, empty where none does."""
        return self.compete(at_tick, **activations)[0].trigger


def test_the_defaults_are_lidas_but_neutral_content_is_enough_and_decay_is_per_cycle() -> None:
    config = Config()

    assert (config.no_broadcast_ticks, config.refractory_ticks) == (100, 40)
    assert (config.aggregate_above, config.coalition_above, config.decay) == (0.8, 0.45, 0.1)


def test_the_first_coalition_ever_is_broadcast() -> None:
    messages = build(Config(), "global_workspace").feed(
        Coalitions(
            stamp_ns=TICK_NS,
            cycle=1,
            coalitions=[Coalition(codelet="a", activation=0.2, nodes=[])],
        )
    )

    assert [type(item) for item in messages] == [Broadcast, Competition]


def test_without_any_coalition_nothing_is_broadcast_however_long_it_has_been() -> None:
    arena = Arena(no_broadcast_ticks=100)

    assert arena.trigger(10_000) == ""


def test_silence_of_a_hundred_ticks_triggers_a_broadcast() -> None:
    arena = Arena(no_broadcast_ticks=100)

    assert arena.trigger(99, a=0.1) == ""
    assert arena.trigger(100, a=0.1) == "no broadcast for long"


def test_fifty_ticks_without_a_new_coalition_trigger_a_broadcast() -> None:
    arena = Arena()

    assert arena.trigger(10, a=0.1) == ""
    assert arena.trigger(40, b=0.1) == ""
    assert arena.trigger(60, a=0.2, b=0.2) == ""
    assert arena.trigger(89, a=0.1) == ""
    assert arena.trigger(90) == "no new coalition for long"


def test_activations_of_more_than_eight_tenths_together_trigger_a_broadcast() -> None:
    arena = Arena(aggregate_above=0.8)

    assert arena.trigger(10, a=0.5) == ""
    assert arena.trigger(20, b=0.25) == ""
    assert arena.trigger(30, b=0.375) == "aggregate activation over threshold"


def test_one_coalition_of_more_than_a_half_triggers_a_broadcast() -> None:
    arena = Arena(coalition_above=0.5)

    assert arena.trigger(10, a=0.5) == ""
    assert arena.trigger(20, a=0.51) == "one coalition over threshold"


def test_in_the_forty_ticks_after_a_broadcast_nothing_triggers_another() -> None:
    arena = Arena(refractory_ticks=40, coalition_above=0.5)

    assert arena.trigger(39, a=0.9) == ""
    assert arena.trigger(40, a=0.9) == "one coalition over threshold"
    assert arena.trigger(79, a=0.9) == ""
    assert arena.trigger(80) == "one coalition over threshold"


def test_the_most_active_coalition_wins_and_the_others_compete_again() -> None:
    arena = Arena(aggregate_above=0.8)
    competition, broadcast = arena.compete(10, a=0.3, b=0.4, c=0.2)

    assert _with_fate(competition, Fate.WON) == {"b": 0.4}
    assert _with_fate(competition, Fate.WAITING) == {"a": 0.3, "c": 0.2}
    assert broadcast is not None
    assert broadcast.coalition.codelet == "b"
    assert arena.waiting(20) == {"a": 0.3, "c": 0.2}


def test_of_equals_the_first_by_name_wins_whatever_the_order_they_came_in() -> None:
    winners = []
    for names in (("b", "a"), ("a", "b")):
        _, broadcast = Arena(aggregate_above=0.5).compete(10, **dict.fromkeys(names, 0.4))
        assert broadcast is not None
        winners.append(broadcast.coalition.codelet)

    assert winners == ["a", "a"]


def test_coalitions_decay_with_time_and_are_removed_at_zero() -> None:
    arena = Arena(decay=0.5)
    arena.compete(10, a=0.45, b=0.2)

    assert arena.waiting(18) == pytest.approx({"a": 0.35, "b": 0.1})

    competition, _ = arena.compete(34)

    assert _with_fate(competition, Fate.WAITING) == pytest.approx({"a": 0.15})
    assert _with_fate(competition, Fate.DECAYED) == {"b": 0.0}
    assert arena.waiting(50) == {}


def test_a_codelet_that_brings_its_coalition_again_renews_it() -> None:
    arena = Arena(decay=0.5)
    arena.compete(10, a=0.4)

    assert arena.waiting(34, a=0.4) == {"a": 0.4}


def test_a_coalition_keeps_its_id_until_its_codelet_brings_a_newer_one() -> None:
    arena = Arena()
    begun, _ = arena.compete(10, a=0.4)
    continued, _ = arena.compete(11)
    renewed, _ = arena.compete(12, a=0.3)
    (first,) = begun.contenders
    (again,) = continued.contenders
    displaced, newer = renewed.contenders

    assert first.id == again.id == displaced.id != newer.id
    assert displaced.fate is Fate.DISPLACED
    assert newer.fate is Fate.WAITING


def test_every_cycle_has_its_competition_even_where_nothing_competes() -> None:
    competition, broadcast = Arena().compete(5)

    assert (competition.cycle, competition.contenders, competition.trigger, broadcast) == (
        2,
        [],
        Trigger.NONE,
        None,
    )


def test_coalitions_of_an_earlier_time_turn_no_clock_back() -> None:
    arena = Arena(refractory_ticks=40, coalition_above=0.5)
    arena.compete(100, a=0.9)

    assert arena.trigger(60, b=0.9) == ""
    assert arena.trigger(140) == "one coalition over threshold"


def test_the_coalitions_of_a_cycle_compete_once_whoever_sends_them() -> None:
    module = build(Config(), "global_workspace")
    first = Coalitions(stamp_ns=5, cycle=7, coalitions=[])
    second = Coalitions(stamp_ns=6, cycle=8, coalitions=[])
    after_restart = Coalitions(stamp_ns=1000, cycle=7, coalitions=[])

    assert module.feed(first)
    assert module.feed(second)
    with pytest.raises(MessageError, match="cycle 7 came twice"):
        module.feed(first)
    assert module.feed(after_restart)


def test_a_contender_goes_by_the_id_that_the_workspace_gave_its_coalition() -> None:
    coalition = Coalition(id="7:attention", codelet="attention", activation=0.2, nodes=[])
    module = build(Config(), "global_workspace")

    *_, competition = module.feed(Coalitions(stamp_ns=5, cycle=7, coalitions=[coalition]))

    assert isinstance(competition, Competition)
    (contender,) = competition.contenders
    assert contender.id == "7:attention"
