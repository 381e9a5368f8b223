"""Committed deltas that reach three replicas, and raw puts of the same bytes by the same router."""

from __future__ import annotations

import threading
import time
import timeit
from collections.abc import Callable
from statistics import median

import numpy as np
import zenoh

from benchmarks.bus.race import REPLICAS, Race, pace
from benchmarks.report import Metrics
from cogmap.bus.codec import decode, encode
from cogmap.bus.session import open_client, open_router
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.graph.graph import Graph
from cogmap.graph.replica import Replica, snapshot_over
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.array import Matrix
from cogmap.schemas.graph import Delta, Links, Operation, Phase
from cogmap.schemas.nodes import SELF_ID, AnyNode, Object, Self, object_id
from cogmap.schemas.process import Clock
from cogmap.services.workspace.public import Ledger

AGENT = "benchmark"
COST_ROUNDS = 400
COST_REPEATS = 5
RAW_KEY = "benchmark/raw"
NODES = 50
LINKS = 200
SAMPLES = 358
SEED = 31
LINK_KIND = "near"


def typical_operations() -> list[Operation]:
    """Return operations of the workspace: 50 nodes, 200 links and a cloud of samples, 32 KB."""
    samples = np.random.default_rng(SEED).normal(size=(SAMPLES, 3))
    nodes: list[AnyNode] = [Self(id=SELF_ID, samples=Matrix.of(samples))]
    for number in range(1, NODES):
        label = f"building_{number}"
        node = Object(
            id=object_id(label),
            activation=0.75,
            base_level=0.25,
            label=label,
            x_m=number * 1.5,
            y_m=number * 0.5,
            sightings=number,
        )
        nodes.append(node)

    weights = {}
    for number, each in enumerate(nodes):
        weights[each.id] = {f"place:{at}:{-at}": 0.5 for at in range(number, LINKS, NODES)}

    return [*nodes, Links(kind=LINK_KIND, weights=weights)]


def measure(endpoint: str, number: int, pairs: int, announce: Callable[[str], None]) -> Metrics:
    """Return the rates of both, in turn, through one router at `endpoint`, as medians."""
    router = open_router(endpoint)
    runs = []
    for pair in range(1, pairs + 1):
        announce(f"deltas and raw puts, pair {pair} of {pairs}")
        peer = pace(endpoint, number, _put, _receive)
        ours = pace(endpoint, number, _commit, _replicate)
        runs.append((ours, peer))

    router.close()  # type: ignore[no-untyped-call]
    return costs() | {
        "delta_rate_ratio": median(ours.rate_hz / peer.rate_hz for ours, peer in runs),
        "delta_rate_hz": median(ours.rate_hz for ours, _ in runs),
        "raw_put_rate_hz": median(peer.rate_hz for _, peer in runs),
        "delta_cpu_us": median(ours.cpu_us for ours, _ in runs),
        "raw_put_cpu_us": median(peer.cpu_us for _, peer in runs),
    }


def costs() -> Metrics:
    """Return the CPU time of each step that a delta takes, if nothing else runs, and its size."""
    ledger = Ledger({})
    replica = Graph()
    operations = typical_operations()
    committed = ledger.commit(0, 1, Phase.OBJECTS, operations)
    payload = encode(committed)
    delta = decode(topics.DELTA, payload)
    assert isinstance(delta, Delta)

    return {
        "delta_commit_us": _cost_us(lambda: ledger.commit(0, 1, Phase.OBJECTS, operations)),
        "delta_encode_us": _cost_us(lambda: encode(delta)),
        "delta_decode_us": _cost_us(lambda: decode(topics.DELTA, payload)),
        "delta_apply_us": _cost_us(lambda: replica.change(delta.operations)),
        "delta_bytes": float(len(payload)),
    }


def _cost_us(work: Callable[[], object]) -> float:
    repeats_s = timeit.repeat(
        work, repeat=COST_REPEATS, number=COST_ROUNDS, timer=time.process_time
    )
    return 1e6 * min(repeats_s) / COST_ROUNDS


def _commit(race: Race) -> None:
    """Run the workspace's part: commit, encode, publish."""
    ledger = Ledger({})
    operations = typical_operations()

    def on_clock(clock: Clock) -> Delta:
        return ledger.commit(clock.stamp_ns, 1, Phase.OBJECTS, operations)

    publisher = Module("workspace").on(topics.CLOCK, on_clock, emits=[topics.DELTA])
    publisher.requires = {"replica": REPLICAS}
    shell = Shell(publisher, ZenohBus(race.endpoint, AGENT), health=False)
    shell.open()

    while shell.missing:
        shell.spin_once(1.0)

    with race.timed():
        race.go.wait()
        for number in range(race.number):
            delta = publisher.feed(Clock(stamp_ns=number))
            shell.publish(delta)
        race.end.wait()

    shell.close()


def _replicate(race: Race) -> None:
    """Run a replica's part: receive, validate, apply."""
    bus = ZenohBus(race.endpoint, AGENT)
    replica = Replica(snapshot_over(bus))

    def follow(delta: Delta) -> None:
        replica.follow(delta)

    follower = Module("replica", f"replica-{time.time_ns()}").on(topics.DELTA, follow)
    shell = Shell(follower, bus, health=False)
    shell.open()

    with race.timed():
        while replica.graph.version < race.number:
            shell.spin_once(1.0)
        race.done.release()

    shell.close()


def _put(race: Race) -> None:
    """Run the peer: put the same bytes on a plain publisher."""
    delta = Ledger({}).commit(0, 1, Phase.OBJECTS, typical_operations())
    payload = encode(delta)
    session = open_client(race.endpoint)
    publisher = session.declare_publisher(RAW_KEY, congestion_control=zenoh.CongestionControl.BLOCK)
    receivers = session.liveliness().declare_subscriber(f"{RAW_KEY}/*", history=True)

    for _ in range(REPLICAS):
        receivers.recv()

    with race.timed():
        race.go.wait()
        for _ in range(race.number):
            publisher.put(payload)
        race.end.wait()

    session.close()  # type: ignore[no-untyped-call]


def _receive(race: Race) -> None:
    """Run the peer's receiver: receive the bytes, and make nothing of them."""
    session = open_client(race.endpoint)
    received = [0]
    complete = threading.Event()

    def count(sample: zenoh.Sample) -> None:
        bytes(sample.payload)
        received[0] += 1

        if received[0] == race.number:
            complete.set()

    subscriber = session.declare_subscriber(RAW_KEY, count)
    token = session.liveliness().declare_token(f"{RAW_KEY}/{session.zid()}")

    with race.timed():
        complete.wait()
        race.done.release()

    token.undeclare()  # type: ignore[no-untyped-call]
    subscriber.undeclare()  # type: ignore[no-untyped-call]
    session.close()  # type: ignore[no-untyped-call]
