"""Sensory-motor memory in lockstep: a command waits for all that it depends on."""

from __future__ import annotations

import msgspec

from cogmap.runtime.module import Module
from cogmap.runtime.run import LOCKSTEP
from cogmap.schemas.codelets import Offer
from cogmap.schemas.cognition import ActionName, MotorProgram, Trigger
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.sensing import MotorCommand, SpeedLimit
from cogmap.testing import agent
from tests.support.world.motor import (
    PERIOD_NS,
    action_of,
    command_after,
    commands_in,
    competition_of,
    module_ahead,
    module_without_plan,
    motion_of,
    no_action_of,
    plan_delta,
    pose_delta,
    scan_of,
)
from tests.support.world.plans import plan_along


def test_in_lockstep_a_plan_that_comes_after_the_pose_waits_for_the_next_one() -> None:
    module = module_ahead(LOCKSTEP)
    for message in (action_of(0), motion_of(), pose_delta(1)):
        module.feed(message)
    module.feed(plan_delta(2, (0.0, 0.0), (0.0, 20.0)))
    command = command_after(module, scan_of())

    assert command.left_wheel_rad_s == command.right_wheel_rad_s > 0.0


def test_in_lockstep_the_command_waits_for_the_senses_and_the_cycle_before() -> None:
    inputs = {
        "delta": pose_delta(2),
        "scan": scan_of(cycle=2),
        "motion": motion_of(2),
        "competition": competition_of(1),
    }
    for last, last_message in inputs.items():
        module = module_ahead(LOCKSTEP)
        for name, message in inputs.items():
            if name != last:
                assert module.feed(message) == []
        assert len(commands_in(module.feed(last_message))) == 1


def test_in_lockstep_the_command_waits_for_the_action_of_a_broadcast() -> None:
    module = module_ahead(LOCKSTEP)
    module.feed(motion_of(2))
    module.feed(scan_of(cycle=2))
    module.feed(competition_of(1, Trigger.NO_BROADCAST))

    assert module.feed(pose_delta(2)) == []

    program, _, command = module.feed(action_of(1))

    assert isinstance(program, MotorProgram)
    assert isinstance(command, MotorCommand)
    assert command.left_wheel_rad_s > 0


def test_in_lockstep_an_action_that_overtakes_its_pose_counts_after_the_command() -> None:
    module = module_ahead(LOCKSTEP)
    for message in (
        action_of(0),
        motion_of(),
        scan_of(),
        pose_delta(1),
        motion_of(2),
        scan_of(cycle=2),
    ):
        module.feed(message)
    module.feed(competition_of(1))

    assert module.feed(action_of(2, ActionName.HALT)) == []
    _, command, program = module.feed(pose_delta(2, x_m=1.0))

    assert isinstance(command, MotorCommand)
    assert command.left_wheel_rad_s > 0
    assert isinstance(program, MotorProgram)
    assert (program.action, program.cycle) == (ActionName.HALT, 2)


def test_in_lockstep_a_later_competition_does_not_end_the_wait_for_an_action() -> None:
    module = module_ahead(LOCKSTEP)
    module.feed(motion_of(2))
    module.feed(scan_of(cycle=2))
    module.feed(competition_of(1, Trigger.NO_BROADCAST))
    module.feed(pose_delta(2))

    assert module.feed(competition_of(2)) == []
    assert len(commands_in(module.feed(action_of(1)))) == 1


def test_in_lockstep_that_no_action_was_chosen_is_waited_for_too() -> None:
    module = module_ahead(LOCKSTEP)
    module.feed(motion_of(2))
    module.feed(scan_of(cycle=2))
    module.feed(competition_of(1, Trigger.NO_BROADCAST))
    module.feed(pose_delta(2))

    (command,) = commands_in(module.feed(no_action_of(1)))

    assert command.halted_by is SpeedLimit.NO_ACTION


def test_in_lockstep_an_action_that_was_lost_is_waited_for_once() -> None:
    module, _ = _answered_lockstep()
    module.feed(competition_of(1, Trigger.NO_BROADCAST))
    for message in (motion_of(2), scan_of(cycle=2), pose_delta(2)):
        assert module.feed(message) == []
    assert len(commands_in(module.feed(scan_of(cycle=2)))) == 1

    for message in (competition_of(2), motion_of(3), scan_of(cycle=3)):
        assert module.feed(message) == []
    assert len(commands_in(module.feed(pose_delta(3)))) == 1


def test_in_lockstep_the_first_cycle_waits_for_no_competition() -> None:
    module = module_ahead(LOCKSTEP)
    module.feed(motion_of())
    module.feed(scan_of())

    assert len(commands_in(module.feed(pose_delta(1)))) == 1


def _answered_lockstep() -> tuple[Module, MotorCommand]:
    """A module in lockstep that has answered the pose of cycle 1, and its command."""
    module = module_ahead(LOCKSTEP)
    for message in (action_of(0), motion_of(), scan_of()):
        module.feed(message)

    (command,) = commands_in(module.feed(pose_delta(1)))

    return module, command


def test_in_lockstep_a_repeated_pose_is_answered_by_the_same_command() -> None:
    module, command = _answered_lockstep()

    assert command.left_wheel_rad_s > 0

    (again,) = commands_in(module.feed(pose_delta(1)))

    assert (again.stamp_ns, again.left_wheel_rad_s) == (command.stamp_ns, command.left_wheel_rad_s)
    assert again.seq == command.seq + 1


def test_in_lockstep_a_repeated_scan_ends_the_wait_for_a_lost_competition() -> None:
    module, _ = _answered_lockstep()

    for message in (motion_of(2), scan_of(cycle=2), pose_delta(2)):
        assert module.feed(message) == []

    module.feed(motion_of(2))
    (command,) = commands_in(module.feed(scan_of(cycle=2)))

    assert command.stamp_ns == 2 * PERIOD_NS


def test_in_lockstep_a_restarted_module_without_a_pose_halts_for_a_frame() -> None:
    module = module_ahead(LOCKSTEP)
    module.feed(motion_of(6))
    assert module.feed(scan_of(cycle=6)) == []

    module.feed(motion_of(6))
    command = command_after(module, scan_of(cycle=6))
    assert command.stamp_ns == 6 * PERIOD_NS
    assert command.halted_by is SpeedLimit.NO_POSE


def _joining(stamp_ns: int, phase: Phase, cycle: int = 6) -> Module:
    """A module in lockstep that joins a running system, whose graph is at a phase of a cycle."""
    module = module_without_plan(LOCKSTEP)
    assert module.graph is not None
    past = Delta(
        stamp_ns=stamp_ns,
        version=1,
        cycle=cycle,
        phase=phase,
        operations=[agent(stamp_ns=stamp_ns), plan_along((0.0, 0.0), (20.0, 0.0))],
    )
    module.graph.apply(past)
    assert module.loaded() == []
    return module


def test_in_lockstep_a_restarted_module_answers_the_pose_that_it_finds_in_the_graph() -> None:
    module = _joining(6 * PERIOD_NS, Phase.END)

    assert module.feed(motion_of(6)) == []
    offer, command = module.feed(scan_of(cycle=6))

    assert isinstance(offer, Offer)
    assert offer.cycle == 6
    assert isinstance(command, MotorCommand)
    assert command.stamp_ns == 6 * PERIOD_NS


def test_in_lockstep_a_restarted_module_answers_the_pose_of_a_cycle_under_way() -> None:
    module = _joining(5 * PERIOD_NS, Phase.PERCEPTS)

    module.feed(motion_of(6))
    (command,) = commands_in(module.feed(scan_of(cycle=6)))
    assert command.stamp_ns == 5 * PERIOD_NS

    (command,) = commands_in(module.feed(pose_delta(6)))
    assert command.stamp_ns == 6 * PERIOD_NS


def test_in_lockstep_a_pose_that_was_answered_is_not_answered_again_when_a_graph_is_loaded() -> (
    None
):
    module, command = _answered_lockstep()
    assert module.graph is not None
    module.graph.change([agent(stamp_ns=command.stamp_ns)])

    assert commands_in(module.loaded()) == []
    assert commands_in(module.feed(scan_of(cycle=2))) == []


def test_in_lockstep_one_that_halted_before_it_has_the_graph_offers_nothing_for_its_cycle() -> None:
    module = module_without_plan(LOCKSTEP)
    module.feed(scan_of(cycle=7))
    (command,) = commands_in(module.feed(scan_of(cycle=7)))
    assert command.halted_by is SpeedLimit.NO_POSE
    assert module.graph is not None
    past = Delta(stamp_ns=PERIOD_NS, version=1, cycle=5, phase=Phase.END, operations=[agent()])
    module.graph.apply(past)

    (offer,) = module.loaded()

    assert isinstance(offer, Offer)
    assert (offer.cycle, offer.operations) == (5, [])


def test_in_lockstep_a_repeated_scan_repeats_the_offer_and_the_command_of_its_view() -> None:
    module, command = _answered_lockstep()

    offer, again = module.feed(scan_of())

    assert isinstance(offer, Offer)
    assert (offer.stamp_ns, offer.operations) == (command.stamp_ns, [])
    assert isinstance(again, MotorCommand)
    assert msgspec.structs.replace(again, seq=command.seq) == command


def test_in_lockstep_a_restarted_module_waits_for_no_past_competition() -> None:
    module = module_ahead(LOCKSTEP)
    assert module.restore is not None

    (program,) = module_ahead().feed(action_of(4))
    module.restore([program])

    for message in (motion_of(6), scan_of(cycle=6)):
        assert module.feed(message) == []
    assert len(commands_in(module.feed(pose_delta(6)))) == 1
