"""What a command waits for in lockstep."""

from __future__ import annotations

from cogmap.schemas.cognition import Competition, Trigger
from cogmap.services.motor.gate import LockstepGate


def _gate() -> LockstepGate:
    """A gate for a pose whose scan and self-motion have come."""
    gate = LockstepGate()
    gate.scan_ns = 1
    gate.motion_ns = 1
    return gate


def _competition(cycle: int, trigger: Trigger = Trigger.NONE) -> Competition:
    return Competition(cycle=cycle, contenders=[], trigger=trigger)


def test_an_action_that_overtakes_its_competition_is_not_waited_for() -> None:
    gate = _gate()
    gate.on_action(1)
    gate.on_competition(_competition(1, Trigger.AGGREGATE))

    assert gate.is_open(1, 2)


def test_the_action_of_the_present_cycle_is_not_waited_for() -> None:
    gate = _gate()
    gate.on_competition(_competition(1))
    gate.on_competition(_competition(2, Trigger.AGGREGATE))

    assert gate.is_open(1, 2)
    assert not gate.is_open(1, 3)


def test_a_gate_that_resumes_waits_for_what_comes_later_alone() -> None:
    gate = _gate()
    gate.on_competition(_competition(1, Trigger.AGGREGATE))
    gate.resume(3)

    assert gate.is_open(1, 3)
    assert not gate.is_open(1, 4)
