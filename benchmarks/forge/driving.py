"""A drive that is lied to: the running system, and those beside it who listen, follow and lie."""

from __future__ import annotations

import time
from collections import Counter
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

from benchmarks.campaign.forger import Forger
from benchmarks.campaign.listener import Listener
from benchmarks.campaign.replica import FollowedGraph
from benchmarks.campaign.running import PERCEPT_LEVEL, RunningSystem
from benchmarks.forge.cases import Mode
from cogmap.bus.discovery import Role, discover
from cogmap.bus.interface import Member
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.cli.doctor import system
from cogmap.cli.doctor.command import OBSERVE_S, observe
from cogmap.cli.topic.observing import CLI
from cogmap.errors import CogmapError
from cogmap.graph.replica import Fetched, snapshot_over
from cogmap.schemas.graph import SnapshotRequest
from cogmap.schemas.topics import Topic
from cogmap.services import registry

START_S = 120.0
LAPS = "40"
"""More than a campaign takes."""

MOVING = 10
BEGUN_NS = 10_000_000_000
"""The time of a drive by which a stamp of its beginning is one of the past."""

RECENT_S = 2.0
Sentences = list[str]


class Driving:
    """A system that drives, and those who listen to it, follow its graph and lie to it."""

    def __init__(self, folder: Path, mode: Mode, seed: int, limit_s: float) -> None:
        options = [*PERCEPT_LEVEL, "--seed", str(seed), "--laps", LAPS]
        if mode is Mode.LOCKSTEP:
            options.append("--lockstep")

        self.mode = mode
        self.system = RunningSystem(folder, limit_s, options)
        self.told: Counter[Topic] = Counter()
        self._said_by_doctor: set[str] = set()
        self._closing = ExitStack()
        self._closing.callback(self.system.end)
        try:
            self._join()
        except BaseException:
            self._closing.close()
            raise

    def _join(self) -> None:
        running = self.system
        self.forger = Forger(running.endpoint, running.agent, START_S)
        self._closing.callback(self.forger.close)
        self.listener = Listener(self._bus("listener"), self.forger.has_put)
        self._doctor_bus = self._bus("doctor")
        self._doctors = self._closing.enter_context(ThreadPoolExecutor(1))
        if not self.await_motion(START_S):
            text = running.output.read_text(errors="replace")[-500:]
            raise CogmapError(f"the drive in {running.folder} did not begin: {text}")
        self.replica = FollowedGraph(running.endpoint, running.agent)

    def _bus(self, name: str) -> ZenohBus:
        bus = ZenohBus(self.system.endpoint, self.system.agent)
        self._closing.callback(bus.close)
        bus.identify(Member(CLI, f"{CLI}-{name}"))
        return bus

    def await_motion(self, timeout_s: float) -> bool:
        """Wait until the drive has begun and wheels turn. Returns whether they do."""
        began_s = time.monotonic()
        while time.monotonic() < began_s + timeout_s and not self.system.has_ended:
            self.listener.pump(0.2)
            moves = [each for each in self.listener.commands if each.moves]
            places = self.listener.places
            is_enough = len(moves) >= MOVING
            has_begun = places[-1:] and places[-1].pose.stamp_ns >= BEGUN_NS
            if has_begun and is_enough and moves[-1].time_s > time.monotonic() - RECENT_S:
                return True
        return False

    def examine(self) -> Future[Sentences]:
        """Let a doctor look at the system meanwhile. The result is what it has not said before."""
        return self._doctors.submit(self._examined)

    def _examined(self) -> Sentences:
        bus = self._doctor_bus
        observed = observe(bus, OBSERVE_S)
        found = discover(bus.session, self.system.agent)
        findings = {
            str(finding) for finding in system.examine(registry.taking_part(), observed, found)
        }
        new = findings - self._said_by_doctor
        self._said_by_doctor |= findings
        return sorted(f"doctor: {finding}" for finding in new)

    def fetched(self) -> Fetched:
        """Ask the workspace for its graph. Raises NoAnswerError."""
        return snapshot_over(self._doctor_bus, START_S)(SnapshotRequest())

    def rejoin(self) -> None:
        """Let the graph be followed by one that has just joined."""
        self.replica.close()
        self.replica = FollowedGraph(self.system.endpoint, self.system.agent)

    def publishers(self, topic: Topic) -> list[str]:
        """Return the instances that may publish `topic`."""
        found = discover(self.forger.session, self.system.agent)
        doing = found.doing(Role.PUBLISHES, topic)
        return [process.member.instance for process in doing if process.member is not None]

    def close(self) -> None:
        """End it."""
        self.replica.close()
        self._closing.close()
