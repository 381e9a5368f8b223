"""The examples in docs/modules.md do what the page says."""

from __future__ import annotations

import re
import sys
import threading
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from cogmap.bus.codec import decode, encode
from cogmap.bus.interface import Arrival, Member
from cogmap.bus.memory import MemoryBus
from cogmap.errors import MessageError
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from schemas import topics
from schemas.array import Array
from schemas.cognition import Task
from schemas.graph import Node, Proposal
from schemas.sensing import MotorCommand, RangeScan, TruePose
from services.codelets import module as codelets
from services.workspace.commit import Ledger
from tests.support.networks import TIMEOUT_S, OverZenoh, Peer, publish

PAGE = Path(__file__).parents[2] / "docs" / "modules.md"


def example(name: str) -> str:
    """The code of an example on the page."""
    found = re.findall(
        rf"<!-- example: {name} -->\n```python\n(.*?)```", PAGE.read_text(), re.DOTALL
    )
    assert len(found) == 1, f"{name}: {len(found)} examples of that name"
    return found[0]


@pytest.fixture
def loaded() -> Iterator[Any]:
    """Makes a module of Python from the code of an example."""
    names = []

    def load(name: str) -> types.ModuleType:
        made = types.ModuleType(f"example_{name.replace(' ', '_')}")
        sys.modules[made.__name__] = made
        names.append(made.__name__)
        exec(compile(example(name), f"{PAGE.name}: {name}", "exec"), made.__dict__)
        return made

    yield load
    for name in names:
        del sys.modules[name]


def _scan(range_m: float, seq: int = 0) -> RangeScan:
    bearing = Array.of(np.linspace(-0.5, 0.5, 5, dtype=np.float32))
    ranges = Array.of(np.full(5, range_m, np.float32))
    return RangeScan(
        stamp_ns=7, seq=seq, source="sensory", frame=seq, bearing_rad=bearing, range_m=ranges
    )


def test_the_module_goes_straight_where_the_way_is_clear_and_turns_left_where_it_is_not(
    loaded: Any,
) -> None:
    page = loaded("module")
    module: Module = page.build(page.Config(), "action")
    for range_m, left_rad_s in ((20.0, 10.0), (0.0, 10.0), (2.0, 0.0)):
        (command,) = module.feed(_scan(range_m))
        assert isinstance(command, MotorCommand)
        assert (command.left_wheel_rad_s, command.right_wheel_rad_s, command.stamp_ns) == (
            left_rad_s,
            10.0,
            7,
        )


def test_the_module_refuses_a_scan_that_makes_no_sense(loaded: Any) -> None:
    page = loaded("module")
    bad = _scan(1.0)
    bad.range_m = Array.of(np.ones(2, np.float32))
    with pytest.raises(MessageError, match="5,\\) bearings and \\(2"):
        page.build(page.Config(), "action").feed(bad)


def test_the_module_drives_the_robot_in_one_process(loaded: Any) -> None:
    page = loaded("module")
    exec(example("runner"), page.__dict__)
    runner: InProcessRunner = page.runner
    poses: list[TruePose] = []

    def keep(arrival: Arrival) -> None:
        pose = decode(arrival.topic, arrival.payload)
        assert isinstance(pose, TruePose)
        poses.append(pose)

    MemoryBus(runner.network).subscribe(topics.TRUE_POSE, keep, lambda name, number: None)
    runner.run(lambda: len(poses) >= 4)
    runner.close()
    assert poses[-1].travelled_m > poses[1].travelled_m > 0


def test_the_foreign_module_answers_scans_over_zenoh(loaded: Any, over_zenoh: OverZenoh) -> None:
    page = loaded("foreign module")
    stop = threading.Event()
    here = over_zenoh.join()
    peer = Peer(here, topics.MOTOR_COMMAND)
    ready = threading.Event()
    here.watch(
        lambda member, alive: (
            ready.set() if alive and member == Member("action", "action") else None
        )
    )
    here.declare(topics.SCAN)
    thread = threading.Thread(target=page.run, args=(over_zenoh.endpoint, over_zenoh.agent, stop))
    thread.start()
    try:
        assert ready.wait(TIMEOUT_S)
        for seq, range_m in enumerate((20.0, 2.0)):
            publish(here, _scan(range_m, seq))
            (arrival,) = peer.take(1)
            command = decode(topics.MOTOR_COMMAND, arrival.payload)
            assert isinstance(command, MotorCommand)
            assert (command.left_wheel_rad_s, command.seq, command.source) == (
                0.0 if seq else 10.0,
                seq,
                "action",
            )
            assert arrival.envelope is not None
            assert (arrival.envelope.source, arrival.envelope.seq) == ("action", seq)
    finally:
        stop.set()
        thread.join()


def test_the_foreign_module_says_what_ours_does(loaded: Any) -> None:
    ours = loaded("module")
    foreign = loaded("foreign module")
    page = ours.build(ours.Config(), "action")
    for seq, range_m in enumerate((20.0, 2.0)):
        scan = _scan(range_m, seq)
        said = foreign.command(msgspec.msgpack.decode(encode(scan)), seq)
        (expected,) = page.feed(scan)
        assert decode(topics.MOTOR_COMMAND, msgspec.msgpack.encode(said)) == expected


def test_the_codelet_counts_the_way_over_two_cycles(
    loaded: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = loaded("codelet")
    ledger = Ledger(1.0)
    monkeypatch.setitem(codelets.BUILDERS, "count_way", page.count_way)
    worker = codelets.build(codelets.Config(), "w")
    for cycle in (1, 2):
        motions = Array.of(np.array([[2.0, 0.0, 0.5, 0.1, 0.1], [1.0, 0.0, 0.5, 0.1, 0.1]]))
        asked = Task(
            task_id=f"{cycle}/count_way",
            codelet="count_way",
            worker="w",
            attempt=0,
            cycle=cycle,
            base_version=ledger.graph.version,
            cell_m=1.0,
            nodes=[node for node in ledger.graph.nodes.values() if node.id == page.TRIP],
            percepts=[],
            motions=motions,
            road_m=Array.of(np.zeros((0, 2), np.float32)),
        )
        (proposal,) = worker.feed(asked)
        assert isinstance(proposal, Proposal)
        operations, tasks = ledger.judge([proposal])
        assert tasks == [asked.task_id]
        ledger.commit(0, cycle, "objects", operations, tasks)
    trip = ledger.graph.nodes[page.TRIP]
    assert isinstance(trip, Node)
    assert trip.attributes["way_m"] == pytest.approx(3.0)
