"""How long a message takes from a publisher to a subscriber, with keys and without."""

from __future__ import annotations

import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from statistics import median

from benchmarks.report import Metrics
from cogmap.bus.access import site
from cogmap.bus.access.certificates import now_utc
from cogmap.bus.access.keys import Keys
from cogmap.bus.codec import Envelope
from cogmap.bus.interface import Arrival, Member
from cogmap.bus.session import free_port, listens
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.cli.launch.command_line import cogmap_command, environment
from cogmap.errors import CogmapError
from cogmap.runtime.environment import KEYS
from cogmap.schemas.topics import DELTA, MOTOR_COMMAND, Topic

AGENT = "agent"
COMMAND_BYTES = 300
DELTA_BYTES = 32 * 1024
WARM_UP = 100
TIMEOUT_S = 10.0
START_S = 30.0
POLL_S = 0.05


class Link:
    """The module `source` and a subscriber of `topic` at one router."""

    def __init__(
        self,
        endpoint: str,
        topic: Topic,
        source: str,
        keys: tuple[Keys, Keys] | None,
        closing: ExitStack,
    ) -> None:
        ours, theirs = keys or (None, None)
        self._topic = topic
        self._source = source
        self._number = 0
        self._has_come = threading.Event()
        self._arrived_ns = 0
        subscriber = ZenohBus(endpoint, AGENT, keys=theirs)
        closing.callback(subscriber.close)
        subscriber.subscribe(topic, self._receive, lambda name, number: None)
        self._publisher = ZenohBus(endpoint, AGENT, keys=ours)
        closing.callback(self._publisher.close)
        self._publisher.identify(Member(source, source))
        self._publisher.declare(topic)

    def _receive(self, arrival: Arrival) -> None:
        self._arrived_ns = time.perf_counter_ns()
        self._has_come.set()

    def send(self, payload: bytes) -> float:
        """Return how many microseconds a message takes. Raises CogmapError if it is lost."""
        envelope = Envelope(self._source, self._number, 1, time.time_ns(), time.time_ns())
        self._number += 1
        self._has_come.clear()
        sent_ns = time.perf_counter_ns()
        self._publisher.publish(self._topic, payload, envelope)
        if not self._has_come.wait(TIMEOUT_S):
            raise CogmapError(f"a message of {self._topic.name} did not arrive")
        return (self._arrived_ns - sent_ns) / 1e3


def measure(folder: Path, messages: int) -> Metrics:
    """Return the median times of commands and of deltas, in turn by TLS with rules and by TCP."""
    place = folder / "latency"
    site.make(place, now_utc())
    with ExitStack() as closing:
        plain = closing.enter_context(_router(""))
        secured = closing.enter_context(_router(str(place)))
        found: Metrics = {}
        for name, topic, size, holders in (
            ("latency", MOTOR_COMMAND, COMMAND_BYTES, ("motor", "sim")),
            ("delta_latency", DELTA, DELTA_BYTES, ("workspace", "motor")),
        ):
            ours, theirs = (Keys(place / holder, holder) for holder in holders)
            source, _ = holders
            links = (
                Link(plain, topic, source, None, closing),
                Link(secured, topic, source, (ours, theirs), closing),
            )
            found |= _compared(name, links, bytes(size), messages)
    return found


def _compared(name: str, links: tuple[Link, Link], payload: bytes, messages: int) -> Metrics:
    """Send by both in turn, so that what else the machine does slows both."""
    times_us: tuple[list[float], list[float]] = ([], [])
    for number in range(messages + WARM_UP):
        for link, taken_us in zip(links, times_us, strict=True):
            took_us = link.send(payload)
            if number >= WARM_UP:
                taken_us.append(took_us)

    plain_us, secured_us = (median(taken_us) for taken_us in times_us)
    return {
        f"{name}_over_plain": secured_us / plain_us,
        f"{name}_plain_us": plain_us,
        f"{name}_us": secured_us,
    }


@contextmanager
def _router(keys: str) -> Iterator[str]:
    """Run a router as a process, as `cogmap run` does; yield its endpoint once it listens."""
    port = free_port()
    endpoint = f"tcp/127.0.0.1:{port}"
    process = subprocess.Popen(
        cogmap_command("router", "--tied", "--connect", endpoint),
        stdin=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=environment() | {KEYS: keys},
    )
    until_s = time.monotonic() + START_S
    try:
        while not listens(port) and time.monotonic() < until_s:
            time.sleep(POLL_S)
        yield endpoint
    finally:
        process.terminate()
        process.wait()
