"""Committed deltas that reach three replicas, against raw puts of the same bytes through the same router."""

from __future__ import annotations

import multiprocessing
import multiprocessing.synchronize
import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median

import numpy as np
import zenoh

from bus.codec import encode
from bus.errors import CogmapError
from bus.module import Module
from bus.replica import Replica, snapshot_over
from bus.session import open_client, open_router
from bus.shell import Shell
from bus.zenoh_bus import ZenohBus
from schemas import topics
from schemas.array import Array
from schemas.graph import Delta, Links, Node, Operation
from schemas.process import Clock
from services.workspace.commit import Ledger

REPLICAS = 3
AGENT = "benchmark"
PATIENCE_S = 60.0
RAW_KEY = "benchmark/raw"
NODES, LINKS, SAMPLES = 50, 200, 730
_spawn = multiprocessing.get_context("spawn")


@dataclass
class Race:
    """What the processes of one run share: all are ready, then the publisher goes, then each has everything."""

    endpoint: str
    number: int
    ready: multiprocessing.synchronize.Semaphore
    go: multiprocessing.synchronize.Event
    done: multiprocessing.synchronize.Semaphore
    end: multiprocessing.synchronize.Event

    @classmethod
    def at(cls, endpoint: str, number: int) -> Race:
        """A race of `number` messages through the router at `endpoint`."""
        return cls(endpoint, number, _spawn.Semaphore(0), _spawn.Event(), _spawn.Semaphore(0), _spawn.Event())


def typical_operations() -> list[Operation]:
    """50 nodes, 200 links and one cloud of samples: 31 KB in the operations that the workspace commits."""
    rng = np.random.default_rng(31)
    nodes: list[Operation] = [
        Node(
            id=f"object:building_{number}",
            kind="object",
            activation=0.75,
            base_level=0.25,
            attributes={"label": f"building_{number}", "x_m": number * 1.5, "y_m": number * 0.5, "sightings": number},
            samples=Array.of(rng.normal(size=(SAMPLES, 3))) if number == 0 else None,
        )
        for number in range(NODES)
    ]
    weights = {
        f"object:building_{number}": {f"place:{at}:{-at}": 0.5 for at in range(number, LINKS, NODES)}
        for number in range(NODES)
    }
    return [*nodes, Links(weights=weights)]


def _commit(race: Race) -> None:
    """The workspace's part: commit, encode, publish."""
    ledger, operations = Ledger(1.0), typical_operations()
    publisher = Module("workspace").on(
        topics.CLOCK, lambda clock: ledger.commit(clock.stamp_ns, 1, "objects", operations), emits=[topics.DELTA]
    )
    shell = Shell(publisher, ZenohBus(race.endpoint, AGENT), health=False)
    shell.open()
    race.ready.release()
    race.go.wait()
    for number in range(race.number):
        shell.say(publisher.feed(Clock(stamp_ns=number)))
    race.end.wait()
    shell.close()


def _replicate(race: Race) -> None:
    """A replica's part: receive, validate, apply."""
    bus = ZenohBus(race.endpoint, AGENT)
    replica = Replica(snapshot_over(bus))
    follower = Module("replica", f"replica-{time.time_ns()}").on(topics.DELTA, lambda delta: _follow(replica, delta))
    shell = Shell(follower, bus, health=False)
    shell.open()
    race.ready.release()
    while replica.graph.version < race.number:
        shell.pump(1.0)
    race.done.release()
    shell.close()


def _follow(replica: Replica, delta: Delta) -> None:
    replica.follow(delta)


def _put(race: Race) -> None:
    """The peer: the same bytes put on a plain publisher."""
    payload = encode(Ledger(1.0).commit(0, 1, "objects", typical_operations()))
    session = open_client(race.endpoint)
    publisher = session.declare_publisher(RAW_KEY, congestion_control=zenoh.CongestionControl.BLOCK)
    race.ready.release()
    race.go.wait()
    for _ in range(race.number):
        publisher.put(payload)
    race.end.wait()
    session.close()  # type: ignore[no-untyped-call]


def _receive(race: Race) -> None:
    """The peer: the bytes received, nothing made of them."""
    session, received, everything = open_client(race.endpoint), [0], _spawn.Event()

    def count(sample: zenoh.Sample) -> None:
        bytes(sample.payload)
        received[0] += 1
        if received[0] == race.number:
            everything.set()

    subscriber = session.declare_subscriber(RAW_KEY, count)
    race.ready.release()
    everything.wait()
    race.done.release()
    subscriber.undeclare()  # type: ignore[no-untyped-call]
    session.close()  # type: ignore[no-untyped-call]


def _wait(semaphore: multiprocessing.synchronize.Semaphore) -> None:
    if not semaphore.acquire(timeout=PATIENCE_S):
        raise CogmapError(f"no word from a process of the benchmark within {PATIENCE_S:g} s: see what it printed")


def _rate(endpoint: str, number: int, publish: Callable[[Race], None], follow: Callable[[Race], None]) -> float:
    """Messages per second until the last replica has the last."""
    race = Race.at(endpoint, number)
    processes = [_spawn.Process(target=follow, args=(race,), daemon=True) for _ in range(REPLICAS)]
    processes.append(_spawn.Process(target=publish, args=(race,), daemon=True))
    for process in processes:
        process.start()
    for _ in processes:
        _wait(race.ready)
    began_s = time.monotonic()
    race.go.set()
    for _ in range(REPLICAS):
        _wait(race.done)
    took_s = time.monotonic() - began_s
    race.end.set()
    for process in processes:
        process.join()
    return number / took_s


def measure(endpoint: str, number: int, pairs: int, tell: Callable[[str], None]) -> dict[str, float]:
    """Rates of both, in turn, through one router; the ratio is the median over the pairs."""
    router = open_router(endpoint)
    ours, raw = [], []
    for pair in range(pairs):
        tell(f"deltas and raw puts, pair {pair + 1} of {pairs}")
        raw.append(_rate(endpoint, number, _put, _receive))
        ours.append(_rate(endpoint, number, _commit, _replicate))
    router.close()  # type: ignore[no-untyped-call]
    return {
        "delta_rate_ratio": median(our / peer for our, peer in zip(ours, raw, strict=True)),
        "delta_rate_hz": median(ours),
        "raw_put_rate_hz": median(raw),
        "delta_bytes": float(len(encode(Ledger(1.0).commit(0, 1, "objects", typical_operations())))),
    }
