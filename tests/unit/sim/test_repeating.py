"""A frame that nobody answers in lockstep is published again."""

from __future__ import annotations

from cogmap.runtime.module import Module
from cogmap.runtime.repetition import CHECK_NS, DOUBTED_AFTER_NS, REPEAT_AFTER_NS
from cogmap.runtime.run import LOCKSTEP
from cogmap.schemas.base import Message
from cogmap.schemas.process import Clock, Presence
from cogmap.schemas.sensing import MotorCommand, Percepts, RangeScan, SelfMotion, TruePose
from cogmap.services.sim.module import Config, build
from cogmap.testing import of_type

START_NS = 10**12


class Simulator:
    """The simulation in lockstep, looked at by wall time."""

    def __init__(self, *past: Message) -> None:
        self.module: Module = build(Config(sensing="percepts"), run=LOCKSTEP)
        if past:
            assert self.module.restore is not None
            self.module.restore(past)
        assert self.module.start is not None
        self.first = self.module.stamp(self.module.start())
        self._wall_ns = START_NS

    def wait(self, duration_ns: int) -> list[Message]:
        """What is published in so much wall time."""
        (timer,) = self.module.timers
        published: list[Message] = []
        for _ in range(duration_ns // CHECK_NS):
            published += self.module.stamp(timer.handler(self._wall_ns))
            self._wall_ns += CHECK_NS
        return published

    def see(self, *, alive: bool) -> None:
        """Motor leaves, or comes back."""
        presence = Presence(module="motor", instance="motor", alive=alive, observer="sim")
        assert self.module.feed(presence) == []


def test_a_frame_is_repeated_as_it_was_soon_after_a_module_came_back() -> None:
    simulator = Simulator()
    simulator.see(alive=False)
    assert simulator.wait(2 * DOUBTED_AFTER_NS) == []
    simulator.see(alive=True)

    repeated = simulator.wait(DOUBTED_AFTER_NS + CHECK_NS)

    assert [type(message) for message in repeated] == [
        Clock,
        SelfMotion,
        RangeScan,
        Percepts,
    ]
    for message in repeated:
        (before,) = of_type(type(message), simulator.first)
        assert message.stamp_ns == before.stamp_ns


def test_where_nobody_was_away_no_frame_is_repeated_soon() -> None:
    simulator = Simulator()

    assert simulator.wait(REPEAT_AFTER_NS) == []
    assert simulator.wait(2 * CHECK_NS) != []


def test_one_that_was_restarted_repeats_its_first_frame_soon() -> None:
    before = Simulator()
    (pose,) = of_type(TruePose, before.first)

    simulator = Simulator(pose)

    assert of_type(Percepts, simulator.wait(DOUBTED_AFTER_NS + CHECK_NS))


def test_a_frame_that_is_answered_is_not_repeated() -> None:
    simulator = Simulator()
    for alive in (False, True):
        simulator.see(alive=alive)
    (percepts,) = of_type(Percepts, simulator.first)
    simulator.wait(DOUBTED_AFTER_NS // 2)
    command = MotorCommand(stamp_ns=percepts.stamp_ns, left_wheel_rad_s=0, right_wheel_rad_s=0)
    (second,) = of_type(Percepts, simulator.module.feed(command))

    (repeated,) = of_type(Percepts, simulator.wait(DOUBTED_AFTER_NS + CHECK_NS))

    assert repeated.stamp_ns == second.stamp_ns > percepts.stamp_ns
