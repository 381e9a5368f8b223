"""A worker that joins a running system with a large map over Zenoh; a replica's memory."""

from __future__ import annotations

import gc
import threading
import time
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

import numpy as np
import psutil

from benchmarks.map_size.cycles import sections
from cogmap.bus.codec import decode, encode
from cogmap.bus.session import free_endpoint, open_router
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.errors import CogmapError
from cogmap.graph.graph import Graph
from cogmap.runtime.module import Handler, Module, Reply
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.graph import Snapshot
from cogmap.schemas.sensing import Percepts, SelfMotion
from cogmap.services import registry

AGENT = "benchmark"
TIMEOUT_S = 120.0
PERIOD_S = 0.01


class Joined(NamedTuple):
    """Seconds from opening the bus to the first proposal, and by how much the worker's process grew
    in that time, buffers of the transport included, in MB.
    """

    join_s: float
    worker_memory_mb: float


def replica_memory_mb(learned: Snapshot) -> float:
    """Measure how a process grows that decodes a snapshot, loads it, and releases the message."""
    context = get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_hold, args=(theirs,))
    process.start()
    theirs.close()
    try:
        ours.send_bytes(encode(learned))
        memory_mb: float = ours.recv()
        return memory_mb
    finally:
        process.join()


def _hold(connection: Connection) -> None:
    """Run the process of the replica."""
    payload = connection.recv_bytes()
    before = _resident_bytes() - len(payload)

    snapshot = decode(topics.SNAPSHOT, payload)
    assert isinstance(snapshot, Snapshot)
    graph = Graph()
    graph.load(snapshot)
    del payload, snapshot

    gc.collect()
    grown = _resident_bytes() - before
    connection.send(grown / 1e6)


def _resident_bytes() -> int:
    """Return the memory of this process."""
    memory = psutil.Process().memory_info()
    return int(memory.rss)


def join(learned: Snapshot) -> Joined:
    """Measure a worker of its own process. Raises CogmapError if it answers nothing in time."""
    endpoint = free_endpoint()
    router = open_router(endpoint)
    configured = sections()
    workspace = registry.build("workspace", configured | {"run": {"lockstep": True}})
    if workspace.restore is not None:
        workspace.restore([learned])

    # A view of nothing, and the motion up to it.
    stamp_ns = 1_000_000_000
    motions = Array.of(np.array([[1.0, 0.0, 1.0, 0.1, 0.01]]))
    motion = SelfMotion(stamp_ns=stamp_ns, frame=0, since_ns=0, motions=motions)
    no_road_m = Array.of(np.zeros((0, 2), np.float32))
    percepts = Percepts(stamp_ns=stamp_ns, frame=0, objects=[], road_m=no_road_m)

    module = Module("senses")
    module.emits.update((topics.SELF_MOTION, topics.PERCEPTS))
    shell = Shell(workspace, ZenohBus(endpoint, AGENT), health=False)
    senses = Shell(module, ZenohBus(endpoint, AGENT), health=False)
    shell.open()
    senses.open()
    senses.publish(module.stamp([motion, percepts]))

    ended = threading.Event()

    def serve() -> None:
        while not ended.is_set():
            shell.spin_once(PERIOD_S)

    thread = threading.Thread(target=serve)
    thread.start()
    context = get_context("spawn")
    ours, theirs = context.Pipe()
    worker = context.Process(target=_work, args=(endpoint, theirs))
    worker.start()
    theirs.close()
    try:
        if not ours.poll(TIMEOUT_S):
            raise CogmapError(f"the worker that joined answered nothing in {TIMEOUT_S:g} s")
        return Joined(*ours.recv())
    finally:
        worker.terminate()
        worker.join()
        ended.set()
        thread.join()
        senses.close()
        shell.close()
        router.close()  # type: ignore[no-untyped-call]


def _work(endpoint: str, connection: Connection) -> None:
    """Run the process of the worker, which ends once a handler has answered something."""
    module = registry.build("codelets", sections(), "codelets-late")
    answered = threading.Event()

    def watched(handler: Handler) -> Handler:
        def handle(message: Any) -> Reply:
            reply = handler(message)
            if reply:
                answered.set()
            return reply

        return handle

    for topic, handler in module.handlers.items():
        module.handlers[topic] = watched(handler)

    gc.collect()
    before = _resident_bytes()

    began_s = time.monotonic()
    shell = Shell(module, ZenohBus(endpoint, AGENT), health=False)
    shell.open()
    while not answered.is_set():
        shell.spin_once(PERIOD_S)

    join_s = time.monotonic() - began_s
    gc.collect()
    grown = _resident_bytes() - before
    connection.send((join_s, grown / 1e6))
    shell.close()
