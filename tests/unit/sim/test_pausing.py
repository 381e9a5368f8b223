"""Time that somebody lets stand, of the simulation."""

from __future__ import annotations

import numpy as np

from cogmap.runtime.module import Module
from cogmap.runtime.pausing import SAID_PERIOD_NS
from cogmap.runtime.run import LOCKSTEP
from cogmap.schemas.base import Message
from cogmap.schemas.process import Clock, Pause, Paused
from cogmap.schemas.sensing import MotorCommand, Odometry, Percepts, StereoFrame
from cogmap.services.sim.module import Config, build
from cogmap.testing import of_type

CAMERAS = Config(egl=False, width_px=64, height_px=64)
PERCEPTS = Config(sensing="percepts")
START_NS = 10**12
TICK_NS = 50_000_000


def _started(module: Module) -> list[Message]:
    assert module.start is not None
    return module.stamp(module.start())


def _ticks(module: Module, first: int, count: int) -> list[Message]:
    """What is published in so many ticks of real time, each view answered."""
    messages: list[Message] = []
    for number in range(first, first + count):
        new = module.stamp(module.timers[0].handler(START_NS + number * TICK_NS))
        messages += new
        for view in of_type(StereoFrame, new):
            module.feed(_answer(view))
    return messages


def _answer(view: Message) -> MotorCommand:
    return MotorCommand(stamp_ns=view.stamp_ns, left_wheel_rad_s=9.0, right_wheel_rad_s=9.0)


def test_in_real_time_nothing_is_sensed_while_time_stands() -> None:
    module = build(CAMERAS)
    _started(module)
    before = _ticks(module, 0, 20)
    (said,) = of_type(Paused, module.feed(Pause(is_paused=True)))
    meanwhile = _ticks(module, 20, 45)
    (passes,) = of_type(Paused, module.feed(Pause(is_paused=False)))
    after = _ticks(module, 65, 20)

    assert said.is_paused
    assert not passes.is_paused
    assert {type(message) for message in meanwhile} == {Paused}
    assert len(meanwhile) == 45 * TICK_NS // SAID_PERIOD_NS + 1
    last = of_type(Clock, before)[-1]
    first = of_type(Clock, after)[0]
    assert 0 < first.stamp_ns - last.stamp_ns <= TICK_NS


def test_in_real_time_a_step_leads_to_the_next_view() -> None:
    module = build(CAMERAS)
    _started(module)
    before = _ticks(module, 0, 22)
    module.feed(Pause(is_paused=True, views=2))
    steps = _ticks(module, 22, 15)

    frames = [view.frame for view in of_type(StereoFrame, before + steps)]
    assert len(of_type(StereoFrame, steps)) == 2
    assert frames == list(range(len(frames)))
    stamps_ns = [odometry.stamp_ns for odometry in of_type(Odometry, before + steps)]
    assert set(np.diff(stamps_ns)) == {TICK_NS}


def test_in_lockstep_the_next_view_waits_though_the_last_is_answered() -> None:
    module = build(PERCEPTS, run=LOCKSTEP)
    (first,) = of_type(Percepts, _started(module))
    module.feed(Pause(is_paused=True))

    assert module.feed(_answer(first)) == []
    waiting = [module.stamp(module.timers[0].handler(START_NS + n * 10**9)) for n in range(30)]
    assert {type(message) for said in waiting for message in said} == {Paused}

    stepped = module.feed(Pause(is_paused=True, views=1))
    (second,) = of_type(Percepts, stepped)
    assert second.frame == first.frame + 1
    assert module.feed(_answer(second)) == []

    (third,) = of_type(Percepts, module.feed(Pause(is_paused=False)))
    assert third.frame == second.frame + 1
    assert of_type(Percepts, module.feed(_answer(third)))


def test_a_pause_changes_nothing_of_what_is_sensed() -> None:
    def driven(pauses: bool) -> list[Message]:
        module = build(PERCEPTS, run=LOCKSTEP)
        messages = _started(module)
        for _ in range(5):
            view = of_type(Percepts, messages)[-1]
            if pauses:
                module.feed(Pause(is_paused=True))
            messages += module.feed(_answer(view))
            if pauses:
                messages += module.feed(Pause(is_paused=False))
        return [message for message in messages if not isinstance(message, Paused)]

    assert driven(pauses=True) == driven(pauses=False)
