"""Bytes that are no message, on every topic of a running system: counted, named now and then, and nothing else changes."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from damage import damaged
from live import AGENT, System, Witness, wait_until, working

from bus.module import Module
from bus.session import open_client
from bus.shell import Shell
from schemas import topics
from schemas.array import Array
from schemas.base import Message
from schemas.graph import Delta
from schemas.process import Clock
from schemas.sensing import Percept, Percepts, SelfMotion
from schemas.topics import Delivery, Topic
from services import table

TRAVELLING = [topic for topic in topics.ALL if topic.delivery is not Delivery.ON_REQUEST]
VIEWS = len(topics.ALL)
PERIOD_NS = 200_000_000
LOCKSTEP = ("workspace.mode=lockstep", "action.mode=lockstep", "action.route=[[50.0, 0.0]]")
MODULES = ("sensory", "epam", "workspace", "codelets-1", "codelets-2", "global_workspace", "action")


class Stranger:
    """Somebody with a Zenoh session who knows the keys and nothing else."""

    def __init__(self, system: System) -> None:
        self._session = open_client(system.endpoint)
        self.sent: dict[str, int] = {}

    def molest(self, number: int) -> None:
        """Put all that is no message on the topic of that number, or ask with it where it is to be asked."""
        topic = topics.ALL[number]
        payloads = [payload for payload in damaged(topic).values() if len(payload) <= 40 * topics.MIB]
        self.sent[topic.name] = len(payloads)
        for payload in payloads:
            self._send(topic, payload)

    def _send(self, topic: Topic, payload: bytes) -> None:
        key = topic.key(AGENT)
        if topic.delivery is Delivery.ON_REQUEST:
            (*_, refusal) = [*self._session.get(key, payload=payload, timeout=10.0), None]
            assert refusal is None or refusal.ok is None
        else:
            self._session.put(key, payload, attachment=b"no envelope")

    def close(self) -> None:
        self._session.close()


class Turns:
    """Stands in for body and perception in lockstep: the next view comes when the cycle of the last one has ended."""

    def __init__(self, before: Callable[[int], None]) -> None:
        self.views = 0
        self._before = before
        says = (topics.CLOCK, topics.SELF_MOTION, topics.PERCEPTS)
        awaits = {"workspace": 1, "codelets": 2, "recorder": 1, "witness": 1}
        self.module = Module("turns").on(topics.DELTA, self._on_delta, says).starts(self._view, awaits, says)

    def _on_delta(self, delta: Delta) -> list[Message]:
        return self._view() if delta.phase == "decay" and self.views < VIEWS else []

    def _view(self) -> list[Message]:
        self._before(self.views)
        self.views += 1
        stamp_ns = self.views * PERIOD_NS
        motion = Array.of(np.array([[2.0, 0.0, 0.2, 0.1, 0.01]]))
        house = Percept(
            label="building-01",
            activation=0.9,
            bearing_rad=0.3,
            range_m=40.0 - 0.4 * self.views,
            bearing_sd_rad=0.05,
            range_sd_m=1.0,
            width_m=9.0,
            height_m=6.0,
            whole=True,
            box_px=(10, 10, 50, 50),
        )
        road_m = Array.of(np.array([[3.0, 0.0], [4.0, 1.0]], np.float32))
        return [
            Clock(stamp_ns=stamp_ns, rate=0.0),
            SelfMotion(stamp_ns=stamp_ns, frame=self.views, since_ns=stamp_ns - PERIOD_NS, motions=motion),
            Percepts(stamp_ns=stamp_ns, frame=self.views, objects=[house], road_m=road_m),
        ]


def drive(system: System, before: Callable[[int], None]) -> Witness:
    """Every module but the body takes its turns; the witness when the last view's cycle has ended."""
    path = system.folder / "log.mcap"
    system.start("recorder", "log", "record", "-o", str(path), "--agent", AGENT, "--json")
    system.modules(*MODULES, settings=LOCKSTEP)
    witness, turns = Witness(system.bus()), Turns(before)
    with working(witness.shell), working(Shell(turns.module, system.bus())):
        wait_until(lambda: witness.replica.graph.cycle == VIEWS and witness.deltas[-1].phase == "decay", "all views")
        wait_until(lambda: set(witness.health) >= {*MODULES, "turns"}, "everybody's health")
        last_s = {name: health.uptime_s for name, health in witness.health.items()}
        wait_until(
            lambda: all(witness.health[name].uptime_s > last_s[name] + 1.5 for name in MODULES), "health once more"
        )
    return witness


def rejected_at(witness: Witness, instance: str, topic: str) -> tuple[int, int]:
    """How many an instance did not believe, and how many it had no look at since a newer one came."""
    health = witness.health[instance]
    return health.rejected.get(topic, 0), health.superseded.get(topic, 0)


def test_what_is_no_message_on_any_topic_is_counted_and_named_and_the_graph_is_the_same_without_it(
    system: System, tmp_path: Path
) -> None:
    system.router()
    quiet = drive(system, lambda view: None)
    for name in (*MODULES, "recorder"):
        system.processes[name].end(signal.SIGTERM)
    noisy_system = System(tmp_path / "noisy", system.endpoint)
    stranger, began_s = Stranger(noisy_system), time.monotonic()
    noisy = drive(noisy_system, stranger.molest)
    lasted_s = time.monotonic() - began_s
    stranger.close()

    assert noisy.replica.graph.digest() == quiet.replica.graph.digest()
    assert noisy.versions == quiet.versions
    assert not any(health.gaps or health.notes for health in noisy.health.values())
    assert all(process.is_alive for process in noisy_system.processes.values())
    for instance in MODULES:
        handlers = table.build(instance.partition("-")[0], {}, instance).handlers
        for topic in handlers.keys() - {topics.PRESENCE}:
            rejected, superseded = rejected_at(noisy, instance, topic.name)
            assert rejected + superseded == stranger.sent[topic.name], (instance, topic.name)
            assert rejected > 0
            named = [line for line in noisy_system.processes[instance].said() if f"rejected {topic.name}" in line]
            assert 1 <= len(named) <= 1 + lasted_s, named
    request = topics.SNAPSHOT_REQUEST.name
    assert rejected_at(noisy, "workspace", request) == (stranger.sent[request], 0)
    recorder = noisy_system.processes["recorder"]
    assert recorder.end(signal.SIGTERM) == 0
    summary = json.loads(recorder.said()[-1])
    assert summary["rejected"] == {topic.name: stranger.sent[topic.name] for topic in TRAVELLING}
    assert summary["never_drop_whole"]
    noisy_system.close()
