"""A small stateful module, and logs of sessions with it."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import replace

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.interface import Member
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.recording.recorder import Recorder
from cogmap.recording.replaying.outcome import Report
from cogmap.recording.replaying.replay import Build, replay_into
from cogmap.recording.selection import to_record
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.runtime.state.journal import Journal
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.process import Clock
from cogmap.schemas.sensing import MotorCommand, Odometry, RangeScan

Sections = dict[str, dict[str, Any]]
NEVER_NS = 10**15


class Mixer:
    """What it publishes depends on everything that it received, and on the order."""

    def __init__(self, start: float, every: int) -> None:
        self._state = start
        self._received = 0
        self._every = every

    def receive(self, message: Message) -> list[Message]:
        self._received += 1
        kind = type(message).__name__
        self._state = (self._state * 0.7 + message.seq + len(kind)) % 1000
        if self._received % self._every:
            return []

        now_ns = message.stamp_ns
        ranges = Array.of(np.full((4, 2), self._state, np.float32))
        scan = RangeScan(stamp_ns=now_ns, frame=0, bearing_rad=ranges, range_m=ranges)
        command = MotorCommand(stamp_ns=now_ns, left_wheel_rad_s=self._state, right_wheel_rad_s=0.0)
        return [scan, command]

    def begin(self) -> MotorCommand:
        return MotorCommand(left_wheel_rad_s=-1.0, right_wheel_rad_s=self._state % 1)

    def tick(self, now_ns: int) -> MotorCommand:
        self._state = (self._state + now_ns % 97) % 1000
        return MotorCommand(left_wheel_rad_s=self._state, right_wheel_rad_s=1.0)

    def restore(self, past: Iterable[Message]) -> None:
        for message in past:
            if isinstance(message, MotorCommand):
                self._state = (self._state + message.left_wheel_rad_s) % 1000

    def compact(self) -> MotorCommand:
        return MotorCommand(left_wheel_rad_s=self._state, right_wheel_rad_s=0.0)


def build(name: str, sections: Sections, instance: str) -> Module:
    """A mixer as a module, which journals its commands and begins with the simulator."""
    settings = sections.get(name, {})
    mixer = Mixer(settings.get("start", 1.0), settings.get("every", 3))

    module = Module(name, instance)
    module.on(topics.ODOMETRY, mixer.receive, (topics.SCAN, topics.MOTOR_COMMAND))
    module.on(topics.CLOCK, mixer.receive)
    module.on_start(mixer.begin, {"sim": 1})
    module.journaling(topics.MOTOR_COMMAND, mixer.restore, mixer.compact)
    if settings.get("timer"):
        module.every(NEVER_NS, mixer.tick)
    return module


class Session:
    """Shells around mixers on the in-memory bus, a recorder, and a bus to feed them on."""

    def __init__(self, path: Path, sections: Sections | None = None) -> None:
        self.network = MemoryNetwork()
        self.sections = sections or {}
        about = {"config": json.dumps(self.sections)}
        self.recorder = Recorder(MemoryBus(self.network), path, to_record(exclude="health"), about)
        self.recorder.open()

        self.bus = MemoryBus(self.network)
        self.bus.announce(Member("sim", "sim"))
        self.shells: dict[str, Shell] = {}
        self.now_ns = time.time_ns() + 10**9

    def enter(self, instance: str = "mixer", journal: Journal | None = None) -> Shell:
        module = build("mixer", self.sections, instance)
        shell = Shell(module, MemoryBus(self.network), journal, health=False)
        self.shells[instance] = shell
        shell.open()
        return shell

    def publish(self, message: Message, since_ns: int, incarnation: int = 1) -> None:
        """Publish `message` as the simulator's, so many ns after the session began."""
        topic = topics.of(message)
        of_sim = replace(message, source="sim")
        sent_ns = self.now_ns + since_ns
        envelope = Envelope("sim", message.seq, incarnation, sent_ns, 0)
        self.bus.publish(topic, encode(of_sim), envelope)

    def settle(self) -> None:
        for shell in self.shells.values():
            while shell.spin_once():
                pass

    def end(self) -> None:
        self.settle()
        self.recorder.close()


def odometry(seq: int) -> Odometry:
    return Odometry(stamp_ns=seq * 10**9, seq=seq, speed_m_s=1.0, turn_rate_rad_s=0.0, dt_s=0.05)


def clock(seq: int) -> Clock:
    return Clock(stamp_ns=seq * 10**9, seq=seq)


def record(
    path: Path, sections: Sections | None = None, instances: Iterable[str] = ("mixer",)
) -> None:
    """Thirty odometry messages, the clock in between; log time runs backwards within each three."""
    session = Session(path, sections)
    for instance in instances:
        session.enter(instance)

    for seq in range(30):
        three, number = divmod(seq, 3)
        session.publish(odometry(seq), 1000 * three + 300 - number)
        session.publish(clock(seq), 1000 * three + 200 - number)
        session.settle()
    session.end()


def replay(path: Path, build: Build = build, **options: Any) -> Report:
    return replay_into(path, ["mixer"], build, **options)
