"""Behaviours excite and inhibit each other."""

from __future__ import annotations

import msgspec
import pytest

from cogmap.schemas.cognition import Behaviour, Rejection
from cogmap.services.action.behaviour_net import (
    BROADCAST_EXCITATION,
    CONFLICTOR_INHIBITION,
    DECAY,
    PREDECESSOR_EXCITATION,
    SUCCESSOR_EXCITATION,
    BehaviourNet,
)
from tests.support.world.behaviours import behaviour, lacking


def _gathered(net: BehaviourNet, *behaviours: Behaviour) -> dict[str, float]:
    """What each behaviour has gathered after a broadcast."""
    return {level.behaviour.scheme: level.gathered for level in net.levels(behaviours)}


def _silent(scheme: str, activation: float = 1.0, **facts: object) -> Behaviour:
    """A behaviour that gathers nothing from the broadcast."""
    return behaviour(scheme, activation, **({"context": {}} | facts))


def test_a_behaviour_is_excited_by_a_broadcast_of_its_context() -> None:
    gathered = _gathered(BehaviourNet(), behaviour("dock", context={"a": 1.0, "b": 0.5}))

    assert gathered["dock"] == pytest.approx(BROADCAST_EXCITATION * 0.75)


def test_a_behaviour_excites_those_whose_missing_context_it_brings_about() -> None:
    drive = _silent("drive", 0.8, adding={"at charger": 0.0})
    dock = lacking("dock", "at charger", "hungry")

    gathered = _gathered(BehaviourNet(), drive, dock)

    assert gathered["dock"] == pytest.approx(SUCCESSOR_EXCITATION * 0.8 / 2)


def test_a_wanted_behaviour_excites_those_that_bring_its_context_about() -> None:
    dock = lacking("dock", "at charger", adding={"sated": 0.6})
    drive = _silent("drive", 0.3, adding={"at charger": 0.0})
    idle = _silent("idle", 0.3)

    gathered = _gathered(BehaviourNet(), drive, idle, dock)

    assert gathered["drive"] == pytest.approx(PREDECESSOR_EXCITATION * 0.6)
    assert gathered["idle"] == 0.0


def test_so_a_behaviour_is_preferred_that_leads_to_a_wanted_one() -> None:
    net = BehaviourNet()
    dock = lacking("dock", "at charger", adding={"sated": 0.9})
    drive = _silent("drive", 0.5, adding={"at charger": 0.0})
    wander = _silent("wander", 0.52)

    drive_level, wander_level, _ = net.levels([drive, wander, dock])

    assert drive_level.activation > wander_level.activation


def test_a_behaviour_inhibits_those_that_undo_its_context() -> None:
    rest = behaviour("rest", 0.5, context={"stands": 0.5})
    drive = _silent("drive", 0.9, deleting=["stands"])

    gathered = _gathered(BehaviourNet(), rest, drive)

    assert gathered["drive"] == pytest.approx(-CONFLICTOR_INHIBITION * 0.5)


def test_of_two_that_undo_each_others_context_the_more_active_inhibits() -> None:
    rest = behaviour("rest", 0.5, context={"stands": 0.5}, deleting=["moves"])
    drive = behaviour("drive", 0.9, context={"moves": 0.9}, deleting=["stands"])

    gathered = _gathered(BehaviourNet(), rest, drive)

    assert gathered == {
        "rest": pytest.approx(BROADCAST_EXCITATION * 0.5 - CONFLICTOR_INHIBITION * 0.9),
        "drive": pytest.approx(BROADCAST_EXCITATION * 0.9),
    }


def test_what_was_gathered_decays_and_is_lost_where_the_behaviour_is_chosen() -> None:
    net = BehaviourNet()
    dock = behaviour("dock")
    net.restore([msgspec.structs.replace(dock, gathered=0.4, rejection=Rejection.LESS_ACTIVE)])
    left = _gathered(net, dock)["dock"]
    net.on_chosen(dock)

    assert left == pytest.approx(0.4 - DECAY + BROADCAST_EXCITATION)
    assert _gathered(net, dock)["dock"] == pytest.approx(BROADCAST_EXCITATION)


def test_a_behaviour_with_other_nodes_gathers_anew() -> None:
    net = BehaviourNet()
    first = _gathered(net, behaviour("dock", bindings={"target": "object:a"}))["dock"]
    other = _gathered(net, behaviour("dock", bindings={"target": "object:b"}))["dock"]

    assert first == other == BROADCAST_EXCITATION
