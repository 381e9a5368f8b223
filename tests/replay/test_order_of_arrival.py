"""In lockstep nothing depends on when which message arrives."""

from __future__ import annotations

import random
from collections import defaultdict

import msgspec
import pytest

from cogmap.bus.interface import Arrival
from cogmap.bus.memory import MemoryBus
from cogmap.runtime.config import Sections
from cogmap.runtime.in_process import InProcessRunner
from cogmap.schemas import topics
from cogmap.services import registry
from cogmap.services.sim.odometry import FUSED
from tests.support.reference import COMPARED, Published

COMMANDS = 20
MIND = ("workspace", "codelets", "global_workspace", "procedural", "action", "motor")
SECTIONS: Sections = {
    "run": {"lockstep": True, "participants": dict.fromkeys(("sim", *MIND), 1)},
    "sim": {
        "town": "blocks",
        "sensing": "percepts",
        "noise": msgspec.to_builtins(FUSED),
    },
    "planning": {"explore": True},
}


def _drive(seed: int) -> Published:
    """What is published until so many commands have come, one module after another taking one
    message, in an order drawn at random.
    """
    rng = random.Random(seed)
    runner = InProcessRunner([registry.build(name, SECTIONS) for name in ("sim", *MIND)])
    published: Published = defaultdict(list)
    bus = MemoryBus(runner.network)

    def keep(arrival: Arrival) -> None:
        published[arrival.topic.name].append(bytes(arrival.payload))

    for topic in COMPARED:
        bus.subscribe(topic, keep, lambda name, number: None)

    commands = published[topics.MOTOR_COMMAND.name]
    while len(commands) < COMMANDS:
        shells = rng.sample(runner.shells, len(runner.shells))
        assert any(shell.spin_once() for shell in shells), "everybody waits"

    runner.close()
    return published


@pytest.fixture(scope="module")
def first() -> Published:
    """A drive in one order."""
    return _drive(0)


def test_the_drive_is_one_in_which_the_robot_moves(first: Published) -> None:
    assert len(first[topics.ACTION.name]) > COMMANDS / 4
    assert len(first[topics.MOTOR_PROGRAM.name]) >= 1


@pytest.mark.parametrize("seed", [1, 2])
def test_messages_that_arrive_in_another_order_give_the_same_bytes(
    seed: int, first: Published
) -> None:
    other = _drive(seed)

    for name in first:
        pairs = zip(first[name], other[name], strict=False)
        assert all(left == right for left, right in pairs), name
