"""In real time too the workspace is replayed to its bytes: what it refused or dropped is part of
what it received.
"""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import msgspec
import numpy as np

from cogmap.bus.codec import Envelope, decode, encode
from cogmap.bus.interface import Arrival, Member
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.recording.recorder import Recorder
from cogmap.recording.replaying.replay import replay_into
from cogmap.recording.selection import to_record
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Proposal, Task
from cogmap.schemas.graph import Decay, Delta, Operation, Phase
from cogmap.schemas.nodes import SELF_ID, Self
from cogmap.schemas.process import Clock
from cogmap.schemas.sensing import Percepts, SelfMotion
from cogmap.services import registry

MS = 1_000_000
PERIOD_NS = 200 * MS
DEADLINE_NS = 180 * MS
LONGEST_NS = 1000 * MS
SECTIONS = {"workspace": {"deadline_ms": 180.0, "lease_ms": 120.0}}


class Session:
    """A workspace in a shell, a recorder, and somebody who plays everyone else."""

    def __init__(self, path: Path) -> None:
        network = MemoryNetwork()
        about = {"config": json.dumps(SECTIONS)}
        self.recorder = Recorder(MemoryBus(network), path, to_record(), about)
        self.recorder.open()

        self.tasks: list[Task] = []
        self.deltas: list[Delta] = []
        self.bus = MemoryBus(network)
        self.bus.subscribe(topics.TASK, self._keep, lambda name, number: None)
        self.bus.subscribe(topics.DELTA, self._keep, lambda name, number: None)

        workspace = registry.build("workspace", SECTIONS)
        self.shell = Shell(workspace, MemoryBus(network), health=False)
        self.shell.open()
        self.bus.announce(Member("codelets", "w"))
        self._numbers: Counter[str] = Counter()

    def publish(self, message: Message) -> None:
        """Publish `message` as the next on its topic, and let the workspace do all it asks for."""
        topic = topics.of(message)
        seq = self._numbers[topic.name]
        self._numbers[topic.name] += 1

        source = "w" if isinstance(message, Proposal) else "everyone"
        numbered = msgspec.structs.replace(message, source=source, seq=seq)
        now_ns = 10**9 + self._numbers.total()
        envelope = Envelope(numbered.source, numbered.seq, 1, now_ns, now_ns)
        self.bus.publish(topic, encode(numbered), envelope)
        while self.shell.spin_once():
            pass

    def see(self, frame: int) -> Task:
        """A view with the motion up to it; what is asked then."""
        since_ns = frame * PERIOD_NS
        stamp_ns = since_ns + PERIOD_NS
        motions = Array.of(np.array([[1.0, 0.0, 0.2, 0.1, 0.1]]))
        road_m = Array.of(np.zeros((0, 2), np.float32))

        self.publish(SelfMotion(stamp_ns=stamp_ns, frame=frame, since_ns=since_ns, motions=motions))
        self.publish(Percepts(stamp_ns=stamp_ns, frame=frame, objects=[], road_m=road_m))
        return self.tasks[-1]

    def miss_deadline(self, frame: int) -> None:
        """Let the time pass in which the tasks of a view may be answered."""
        stamp_ns = (frame + 1) * PERIOD_NS
        self.publish(Clock(stamp_ns=stamp_ns + DEADLINE_NS + MS))

    def answer(self, task: Task) -> None:
        samples = Matrix.of(np.zeros((10, 3)))
        agent = Self(id=SELF_ID, x_m=1.0, stamp_ns=task.stamp_ns, samples=samples)
        self.propose(task, agent)

    def propose(self, task: Task, operation: Operation) -> None:
        proposal = Proposal(
            stamp_ns=task.stamp_ns,
            task_id=task.task_id,
            codelet=task.codelet,
            base_version=task.version,
            operations=[operation],
        )
        self.publish(proposal)

    def end(self) -> None:
        self.shell.close()
        self.recorder.close()

    def _keep(self, arrival: Arrival) -> None:
        message = decode(arrival.topic, arrival.payload)
        match message:
            case Task():
                self.tasks.append(message)
            case Delta():
                self.deltas.append(message)


def test_late_dropped_and_refused_answers_replay_to_the_same_deltas(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    session = Session(path)

    first = session.see(0)
    session.miss_deadline(0)
    second = session.see(1)
    session.answer(first)
    session.miss_deadline(1)
    third = session.see(2)
    session.answer(third)
    session.answer(second)
    session.miss_deadline(2)
    fourth = session.see(3)
    session.propose(fourth, Decay())
    session.miss_deadline(3)
    session.end()

    answered = [(delta.cycle, delta.phase) for delta in session.deltas if delta.tasks]
    rejected = [delta.rejected for delta in session.deltas]
    assert answered == [(2, Phase.LATE), (3, Phase.LOCALIZATION)]
    assert sum(rejected) == 2

    report = replay_into(path, ["workspace"], registry.build, processes=1)
    assert report.same, report.first
    (outcome,) = report.outcomes
    assert outcome.same >= len(session.deltas) + len(session.tasks)


def test_a_deadline_that_follows_late_answers_replays_to_the_same_deltas(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    session = Session(path)
    for view in range(8):
        frame = 10 * view
        stamp_ns = (frame + 1) * PERIOD_NS
        session.publish(Clock(stamp_ns=stamp_ns))
        localization = session.see(frame)
        session.publish(Clock(stamp_ns=stamp_ns + DEADLINE_NS + 20 * MS))
        session.answer(localization)
        session.publish(Clock(stamp_ns=stamp_ns + LONGEST_NS + MS))
    session.end()

    answered = [delta.phase for delta in session.deltas if delta.tasks]
    assert answered == [*[Phase.LATE] * 5, *[Phase.LOCALIZATION] * 3]
    report = replay_into(path, ["workspace"], registry.build, processes=1)
    assert report.same, report.first
