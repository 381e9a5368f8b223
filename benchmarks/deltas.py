"""Committed deltas that reach three replicas, against raw puts of the same bytes through the same
router.
"""

from __future__ import annotations

import multiprocessing
import multiprocessing.synchronize
import threading
import time
import timeit
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.sharedctypes import Synchronized
from statistics import median

import numpy as np
import zenoh

from cogmap.bus.codec import decode, encode
from cogmap.bus.session import open_client, open_router
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.errors import CogmapError
from cogmap.graph.graph import Graph
from cogmap.graph.replica import Replica, snapshot_over
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from schemas import topics
from schemas.array import Array
from schemas.graph import Delta, Links, Node, Operation
from schemas.process import Clock
from services.workspace.commit import Ledger

REPLICAS = 3
AGENT = "benchmark"
PATIENCE_S = 60.0
COST_ROUNDS = 400
RAW_KEY = "benchmark/raw"
NODES = 50
LINKS = 200
SAMPLES = 730
_spawn = multiprocessing.get_context("spawn")


@dataclass
class Race:
    """What the processes of one run share: all are ready, then the publisher goes, then each has
    everything.
    """

    endpoint: str
    number: int
    ready: multiprocessing.synchronize.Semaphore
    go: multiprocessing.synchronize.Event
    done: multiprocessing.synchronize.Semaphore
    end: multiprocessing.synchronize.Event
    cpu_s: Synchronized[float]

    @classmethod
    def at(cls, endpoint: str, number: int) -> Race:
        """A race of `number` messages through the router at `endpoint`."""
        ready = _spawn.Semaphore(0)
        done = _spawn.Semaphore(0)
        cpu_s = _spawn.Value("d", 0.0)
        return cls(endpoint, number, ready, _spawn.Event(), done, _spawn.Event(), cpu_s)

    @contextmanager
    def at_work(self) -> Iterator[None]:
        """Tell that this process is ready; what it does within counts."""
        began_s = time.process_time()
        self.ready.release()
        yield
        with self.cpu_s.get_lock():
            self.cpu_s.value += time.process_time() - began_s


@dataclass
class Pace:
    """How a run went: messages per second until the last process had the last, CPU time of all
    processes for each.
    """

    rate_hz: float
    cpu_us: float


def typical_operations() -> list[Operation]:
    """50 nodes, 200 links and one cloud of samples: 31 KB in the operations that the workspace
    commits.
    """
    rng = np.random.default_rng(31)
    nodes: list[Operation] = [
        Node(
            id=f"object:building_{number}",
            kind="object",
            activation=0.75,
            base_level=0.25,
            attributes={
                "label": f"building_{number}",
                "x_m": number * 1.5,
                "y_m": number * 0.5,
                "sightings": number,
            },
            samples=Array.of(rng.normal(size=(SAMPLES, 3))) if number == 0 else None,
        )
        for number in range(NODES)
    ]
    weights = {
        f"object:building_{number}": {
            f"place:{at}:{-at}": 0.5 for at in range(number, LINKS, NODES)
        }
        for number in range(NODES)
    }
    return [*nodes, Links(weights=weights)]


def _commit(race: Race) -> None:
    """The workspace's part: commit, encode, publish."""
    ledger = Ledger(1.0)
    operations = typical_operations()
    publisher = Module("workspace").on(
        topics.CLOCK,
        lambda clock: ledger.commit(clock.stamp_ns, 1, "objects", operations),
        emits=[topics.DELTA],
    )
    publisher.requires = {"replica": REPLICAS}
    shell = Shell(publisher, ZenohBus(race.endpoint, AGENT), health=False)
    shell.open()
    while shell.missing:
        shell.spin_once(1.0)
    with race.at_work():
        race.go.wait()
        for number in range(race.number):
            shell.publish(publisher.feed(Clock(stamp_ns=number)))
        race.end.wait()
    shell.close()


def _replicate(race: Race) -> None:
    """A replica's part: receive, validate, apply."""
    bus = ZenohBus(race.endpoint, AGENT)
    replica = Replica(snapshot_over(bus))
    follower = Module("replica", f"replica-{time.time_ns()}").on(
        topics.DELTA, lambda delta: _follow(replica, delta)
    )
    shell = Shell(follower, bus, health=False)
    shell.open()
    with race.at_work():
        while replica.graph.version < race.number:
            shell.spin_once(1.0)
        race.done.release()
    shell.close()


def _follow(replica: Replica, delta: Delta) -> None:
    replica.follow(delta)


def _put(race: Race) -> None:
    """The peer: the same bytes put on a plain publisher."""
    payload = encode(Ledger(1.0).commit(0, 1, "objects", typical_operations()))
    session = open_client(race.endpoint)
    publisher = session.declare_publisher(RAW_KEY, congestion_control=zenoh.CongestionControl.BLOCK)
    followers = session.liveliness().declare_subscriber(f"{RAW_KEY}/*", history=True)
    for _ in range(REPLICAS):
        followers.recv()
    with race.at_work():
        race.go.wait()
        for _ in range(race.number):
            publisher.put(payload)
        race.end.wait()
    session.close()  # type: ignore[no-untyped-call]


def _receive(race: Race) -> None:
    """The peer: the bytes received, nothing made of them."""
    session = open_client(race.endpoint)
    received = [0]
    everything = threading.Event()

    def count(sample: zenoh.Sample) -> None:
        bytes(sample.payload)
        received[0] += 1
        if received[0] == race.number:
            everything.set()

    subscriber = session.declare_subscriber(RAW_KEY, count)
    token = session.liveliness().declare_token(f"{RAW_KEY}/{session.zid()}")
    with race.at_work():
        everything.wait()
        race.done.release()
    token.undeclare()  # type: ignore[no-untyped-call]
    subscriber.undeclare()  # type: ignore[no-untyped-call]
    session.close()  # type: ignore[no-untyped-call]


def _wait(semaphore: multiprocessing.synchronize.Semaphore) -> None:
    if not semaphore.acquire(timeout=PATIENCE_S):
        raise CogmapError(
            f"no word from a process of the benchmark within {PATIENCE_S:g} s: see what it printed"
        )


def _pace(
    endpoint: str, number: int, publish: Callable[[Race], None], follow: Callable[[Race], None]
) -> Pace:
    """Let one process publish `number` messages to three that follow, through the router in this
    one.
    """
    race = Race.at(endpoint, number)
    processes = [_spawn.Process(target=follow, args=(race,), daemon=True) for _ in range(REPLICAS)]
    processes.append(_spawn.Process(target=publish, args=(race,), daemon=True))
    for process in processes:
        process.start()
    for _ in processes:
        _wait(race.ready)
    began_s = time.monotonic()
    router_s = time.process_time()
    race.go.set()
    for _ in range(REPLICAS):
        _wait(race.done)
    took_s = time.monotonic() - began_s
    router_s = time.process_time() - router_s
    race.end.set()
    for process in processes:
        process.join()
    return Pace(number / took_s, (race.cpu_s.value + router_s) / number * 1e6)


def measure(
    endpoint: str, number: int, pairs: int, tell: Callable[[str], None]
) -> dict[str, float]:
    """The paces of both, in turn, through one router; the ratio is the median over the pairs."""
    router = open_router(endpoint)
    ours = []
    raw = []
    for pair in range(pairs):
        tell(f"deltas and raw puts, pair {pair + 1} of {pairs}")
        raw.append(_pace(endpoint, number, _put, _receive))
        ours.append(_pace(endpoint, number, _commit, _replicate))
    router.close()  # type: ignore[no-untyped-call]
    return {
        "delta_rate_ratio": median(
            our.rate_hz / peer.rate_hz for our, peer in zip(ours, raw, strict=True)
        ),
        "delta_rate_hz": median(our.rate_hz for our in ours),
        "raw_put_rate_hz": median(peer.rate_hz for peer in raw),
        "delta_cpu_us": median(our.cpu_us for our in ours),
        "raw_put_cpu_us": median(peer.cpu_us for peer in raw),
        **_costs(),
    }


def _costs() -> dict[str, float]:
    """What the parts of a delta's way cost where nothing else runs, and its size."""
    ledger = Ledger(1.0)
    replica = Graph()
    operations = typical_operations()
    payload = encode(ledger.commit(0, 1, "objects", operations))
    delta = decode(topics.DELTA, payload)
    assert isinstance(delta, Delta)
    return {
        "delta_commit_us": _cost_us(lambda: ledger.commit(0, 1, "objects", operations)),
        "delta_encode_us": _cost_us(lambda: encode(delta)),
        "delta_decode_us": _cost_us(lambda: decode(topics.DELTA, payload)),
        "delta_apply_us": _cost_us(lambda: replica.change(delta.operations)),
        "delta_bytes": float(len(payload)),
    }


def _cost_us(work: Callable[[], object]) -> float:
    return (
        min(timeit.repeat(work, repeat=5, number=COST_ROUNDS, timer=time.process_time))
        / COST_ROUNDS
        * 1e6
    )
