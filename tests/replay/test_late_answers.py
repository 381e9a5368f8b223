"""In real time too the workspace is replayed to its bytes: what it refused or dropped is part of
what it took in.
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
from schemas import topics
from schemas.array import Array, Matrix
from schemas.base import Message
from schemas.codelets import Proposal, Task
from schemas.graph import Decay, Delta, Operation, Phase
from schemas.nodes import SELF_ID, Self
from schemas.process import Clock
from schemas.sensing import Percepts, SelfMotion
from services import registry

MS = 1_000_000
SECTIONS = {"workspace": {"mode": "real_time", "deadline_ms": 180.0, "lease_ms": 120.0}}


class Session:
    """A workspace in a shell, a recorder, and somebody who plays everyone else."""

    def __init__(self, path: Path) -> None:
        network = MemoryNetwork()
        self.recorder = Recorder(
            MemoryBus(network), path, to_record(), {"config": json.dumps(SECTIONS)}
        )
        self.recorder.open()
        self.bus = MemoryBus(network)
        self.tasks: list[Task] = []
        self.deltas: list[Delta] = []
        self.bus.subscribe(topics.TASK, self._keep, lambda name, number: None)
        self.bus.subscribe(topics.DELTA, self._keep, lambda name, number: None)
        self.shell = Shell(registry.build("workspace", SECTIONS), MemoryBus(network), health=False)
        self.shell.open()
        self.bus.announce(Member("codelets", "w"))
        self._numbers: Counter[str] = Counter()

    def _keep(self, arrival: Arrival) -> None:
        message = decode(arrival.topic, arrival.payload)
        if isinstance(message, Task):
            self.tasks.append(message)
        elif isinstance(message, Delta):
            self.deltas.append(message)

    def say(self, message: Message) -> None:
        topic = topics.of(message)
        seq = self._numbers[topic.name]
        message = msgspec.structs.replace(message, source="everyone", seq=seq)
        self._numbers[topic.name] += 1
        now_ns = 10**9 + sum(self._numbers.values())
        self.bus.publish(
            topic, encode(message), Envelope(message.source, message.seq, 1, now_ns, now_ns)
        )
        while self.shell.spin_once():
            pass

    def see(self, frame: int) -> Task:
        """A view with the motion up to it; what is asked then."""
        stamp_ns = (frame + 1) * 200 * MS
        since_ns = frame * 200 * MS
        motions = Array.of(np.array([[1.0, 0.0, 0.2, 0.1, 0.1]]))
        self.say(SelfMotion(stamp_ns=stamp_ns, frame=frame, since_ns=since_ns, motions=motions))
        road_m = Array.of(np.zeros((0, 2), np.float32))
        self.say(Percepts(stamp_ns=stamp_ns, frame=frame, objects=[], road_m=road_m))
        return self.tasks[-1]

    def answer(self, task: Task) -> None:
        samples = Matrix.of(np.zeros((10, 3)))
        me = Self(id=SELF_ID, x_m=1.0, stamp_ns=task.stamp_ns, samples=samples)
        self.propose(task, me)

    def propose(self, task: Task, operation: Operation) -> None:
        self.say(
            Proposal(
                stamp_ns=task.stamp_ns,
                task_id=task.task_id,
                codelet=task.codelet,
                base_version=task.version,
                operations=[operation],
            )
        )

    def end(self) -> None:
        self.shell.close()
        self.recorder.close()


def test_late_dropped_and_refused_answers_replay_to_the_same_deltas(
    tmp_path: Path,
) -> None:
    session = Session(tmp_path / "log.mcap")
    late = session.see(0)
    session.say(Clock(stamp_ns=200 * MS + 181 * MS))
    second = session.see(1)
    session.answer(late)
    session.say(Clock(stamp_ns=400 * MS + 181 * MS))
    third = session.see(2)
    session.answer(third)
    session.answer(second)
    session.say(Clock(stamp_ns=600 * MS + 181 * MS))
    session.propose(session.see(3), Decay())
    session.say(Clock(stamp_ns=800 * MS + 181 * MS))
    session.end()
    assert [(delta.cycle, delta.phase) for delta in session.deltas if delta.tasks] == [
        (2, Phase.LATE),
        (3, Phase.LOCALIZATION),
    ]
    assert sum(delta.rejected for delta in session.deltas) == 2
    report = replay_into(tmp_path / "log.mcap", ["workspace"], registry.build, processes=1)
    assert report.same, report.first
    assert report.outcomes[0].same >= len(session.deltas) + len(session.tasks)
