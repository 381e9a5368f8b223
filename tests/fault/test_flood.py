"""A stranger floods the workspace with percepts: cycles go on, and the flood is named."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import zenoh

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.interface import Incarnation
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import Percepts
from tests.support.system.live import Feeder, Witness
from tests.support.system.processes import AGENT, System, wait_until

SOURCE = "flood"
STARTED = 1


@contextmanager
def flooding(bus: ZenohBus, percepts: Percepts) -> Iterator[None]:
    """Send the same percepts as fast as they can be sent, as a source that is on the bus."""
    bus.claim(Incarnation("epam", SOURCE, STARTED))
    publisher = bus.session.declare_publisher(
        topics.PERCEPTS.key(AGENT), congestion_control=zenoh.CongestionControl.BLOCK
    )
    payload = encode(percepts)
    ended = threading.Event()

    def send() -> None:
        while not ended.is_set():
            now_ns = time.time_ns()
            envelope = Envelope(SOURCE, percepts.seq, STARTED, now_ns, now_ns)
            publisher.put(payload, attachment=encode(envelope))

    thread = threading.Thread(target=send, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        publisher.undeclare()  # type: ignore[no-untyped-call]


def test_a_flood_is_shed_and_named_and_cycles_go_on(
    agent: tuple[System, Feeder, Witness],
) -> None:
    system, feeder, witness = agent
    stranger = system.bus()
    nothing = Array.of([[0.0, 0.0]], "<f4")
    seen = Percepts(stamp_ns=feeder.stamps[-1], source=SOURCE, frame=0, objects=[], road_m=nothing)

    def is_shed() -> bool:
        report = witness.health.get("workspace")
        return report is not None and report.rejected.get(topics.PERCEPTS.name, 0) > 1000

    with flooding(stranger, seen):
        wait_until(is_shed, "the flood is shed")
        witness.await_cycles(10)

    stranger.close()
    (told,) = [each for each in witness.health["workspace"].notes if SOURCE in each]
    assert f"messages of {topics.PERCEPTS.name} of {SOURCE} were shed, as a flood" in told
    feeder.pause()
    witness.await_same_graph()
