"""A subscriber that is stopped for five seconds: the others do not notice, and nothing is lost for
good.
"""

from __future__ import annotations

import json
import signal
import time
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt
import pytest

from cogmap.recording.storage.reader import LogReader
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.examples import example_messages
from cogmap.schemas.sensing import StereoFrame
from cogmap.schemas.topics import Topic
from tests.support.system.live import Feeder, Witness
from tests.support.system.networks import working
from tests.support.system.processes import AGENT, Process, System, wait_until

STOPPED_S = 5.0
MAX_GAP_S = 0.5
MAX_GROWTH_MB = 48.0
FRAME_PERIOD_NS = 100_000_000
WATCHED = ("router", "workspace", "codelets-1")


def camera() -> Module:
    """Publishes 460 KB ten times a second: 46 MB while the subscriber is stopped, more than the
    queues in between can hold.
    """
    image = Array.of(np.zeros((240, 320, 3), np.uint8))
    example = next(message for message in example_messages() if isinstance(message, StereoFrame))

    def frame(now_ns: int) -> StereoFrame:
        return msgspec.structs.replace(example, stamp_ns=now_ns, left=image, right=image)

    return Module("camera").every(FRAME_PERIOD_NS, frame, emits=[topics.STEREO])


class Listener:
    """When messages were received, by topic."""

    def __init__(self, *followed: Topic) -> None:
        self.received_s: dict[Topic, list[float]] = {topic: [] for topic in followed}
        self.module = Module("listener")
        for topic in followed:
            self.module.on(topic, self._note)

    def max_gap_s(self, topic: Topic, since_s: float) -> float:
        """The longest time without a message since then."""
        received_s = np.array(self.received_s[topic])
        later_s = received_s[received_s >= since_s]
        gaps_s = np.diff(later_s)
        return float(gaps_s.max())

    def _note(self, message: Message) -> None:
        topic = topics.of(message)
        received_s = self.received_s[topic]
        received_s.append(time.monotonic())


@dataclass(frozen=True)
class Observed:
    """What others did while a process was stopped: how they grew, and when they were silent."""

    grown_mb: npt.NDArray[np.float64]
    gaps_s: list[float]


def observe_stopped(stopped: Process, watched: list[Process], listener: Listener) -> Observed:
    """Stop a process for STOPPED_S, and then let it continue."""
    before_mb = [process.memory_mb for process in watched]
    stopped.send(signal.SIGSTOP)
    began_s = time.monotonic()
    wait_until(lambda: time.monotonic() > began_s + STOPPED_S, f"{STOPPED_S} seconds pass")

    after_mb = [process.memory_mb for process in watched]
    gaps_s = [listener.max_gap_s(topic, began_s) for topic in listener.received_s]
    stopped.send(signal.SIGCONT)
    return Observed(np.subtract(after_mb, before_mb), gaps_s)


def summary_of(recorder: Process) -> dict[str, Any]:
    """What a recorder printed as JSON when it ended."""
    output = "\n".join(recorder.lines())
    begin = output.index("{")
    summary: dict[str, Any] = json.loads(output[begin:])
    return summary


@pytest.fixture
def recorded(agent: tuple[System, Feeder, Witness]) -> System:
    """The agent with a recorder, which has begun to write."""
    system, _, _ = agent
    path = system.folder / "log.mcap"
    options = ("-o", str(path), "--agent", AGENT, "--json")
    system.start("recorder", "log", "record", *options)
    wait_until(lambda: path.exists() and path.stat().st_size > 50_000, "the recorder writes")
    return system


def test_a_stopped_subscriber_delays_nobody_and_loses_nothing(
    agent: tuple[System, Feeder, Witness], recorded: System
) -> None:
    system, feeder, witness = agent
    recorder = system.processes["recorder"]
    watched = [system.processes[name] for name in WATCHED]
    listener = Listener(topics.CLOCK, topics.DELTA, topics.STEREO)

    with working(Shell(listener.module, system.bus())), working(Shell(camera(), system.bus())):
        wait_until(lambda: len(listener.received_s[topics.STEREO]) > 10, "frames arrive")
        observed = observe_stopped(recorder, watched, listener)
        witness.await_cycles(20)

    feeder.pause()
    witness.await_same_graph()
    assert recorder.end(signal.SIGTERM) == 0

    assert observed.grown_mb.max() < MAX_GROWTH_MB, observed
    assert max(observed.gaps_s) < MAX_GAP_S, observed
    assert not witness.shell.intake.gaps

    summary = summary_of(recorder)
    assert summary["never_drop_whole"], summary
    log = LogReader(system.folder / "log.mcap")
    deltas = [record.sequence for record in log.records({topics.DELTA})]
    end = witness.deltas[-1].seq + 1
    assert deltas == list(range(deltas[0], end))
