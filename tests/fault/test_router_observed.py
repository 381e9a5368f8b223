"""The router goes on while processes join and leave and observers ask who is there."""

from __future__ import annotations

import signal
from concurrent.futures import ThreadPoolExecutor

from cogmap.bus.discovery import discover
from cogmap.bus.session import open_client
from cogmap.schemas import topics
from tests.support.system.processes import AGENT, System

JOINING = 3
ROUNDS = 40


def join_and_leave(system: System) -> None:
    """Declare what a module does, and take it back, again and again."""
    for _ in range(ROUNDS):
        bus = system.bus()
        for topic in (topics.ODOMETRY, topics.VIEW, topics.SCAN):
            bus.declare(topic)
            bus.subscribe(topic, lambda arrival: None, lambda name, number: None)
        bus.close()


def test_the_router_goes_on_while_processes_join_and_others_ask_for_them(system: System) -> None:
    router = system.router()
    stays = system.bus()
    stays.declare(topics.CLOCK)
    observer = open_client(system.endpoint)

    with ThreadPoolExecutor(JOINING) as pool:
        joining = [pool.submit(join_and_leave, system) for _ in range(JOINING)]
        while not all(future.done() for future in joining):
            assert topics.CLOCK in discover(observer, AGENT).topics()

    for future in joining:
        future.result()
    observer.close()  # type: ignore[no-untyped-call]
    stays.close()
    assert router.end(signal.SIGTERM) == 0
