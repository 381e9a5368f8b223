"""A subscriber that is stopped for five seconds: the others do not notice, and nothing is lost for
good.
"""

from __future__ import annotations

import json
import signal
import time
from itertools import pairwise

import msgspec
import numpy as np
import pytest

from cogmap.recording.storage.reader import LogReader
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from schemas import topics
from schemas.array import Array
from schemas.base import Message
from schemas.examples import samples
from schemas.sensing import StereoFrame
from schemas.topics import Topic
from tests.support.live import AGENT, Feeder, System, Witness, wait_until
from tests.support.networks import working

STOPPED_S = 5.0
LONGEST_GAP_S = 0.5
GROWTH_MB = 48.0
FRAME_PERIOD_NS = 100_000_000


def camera() -> Module:
    """Says 460 KB ten times a second: 46 MB while the subscriber is stopped, more than what is on
    the way can hold.
    """
    image = Array.of(np.zeros((240, 320, 3), np.uint8))
    sample = next(message for message in samples() if isinstance(message, StereoFrame))

    def frame(now_ns: int) -> StereoFrame:
        return msgspec.structs.replace(sample, stamp_ns=now_ns, left=image, right=image)

    return Module("camera").every(FRAME_PERIOD_NS, frame, emits=[topics.STEREO])


class Listener:
    """When messages came."""

    def __init__(self, *followed: Topic) -> None:
        self.came_s: dict[Topic, list[float]] = {topic: [] for topic in followed}
        self.module = Module("listener")
        for topic in followed:
            self.module.on(topic, self._note)

    def _note(self, message: Message) -> None:
        self.came_s[topics.of(message)].append(time.monotonic())

    def longest_gap_s(self, topic: Topic, since_s: float) -> float:
        """The longest time without a message since then."""
        return max(
            later - earlier
            for earlier, later in pairwise([s for s in self.came_s[topic] if s >= since_s])
        )


@pytest.fixture
def recorded(mind: tuple[System, Feeder, Witness]) -> System:
    """The mind with a recorder, which has begun to write."""
    system, _, _ = mind
    path = system.folder / "log.mcap"
    system.start("recorder", "log", "record", "-o", str(path), "--agent", AGENT, "--json")
    wait_until(lambda: path.exists() and path.stat().st_size > 50_000, "the recorder writes")
    return system


def test_a_stopped_subscriber_delays_nobody_and_loses_nothing(
    mind: tuple[System, Feeder, Witness], recorded: System
) -> None:
    system, feeder, witness = mind
    listener = Listener(topics.CLOCK, topics.DELTA, topics.STEREO)
    looked_at = [system.processes[name] for name in ("router", "workspace", "codelets-1")]
    with working(Shell(listener.module, system.bus())), working(Shell(camera(), system.bus())):
        wait_until(lambda: len(listener.came_s[topics.STEREO]) > 10, "frames come")
        before_mb = [process.memory_mb() for process in looked_at]
        system.processes["recorder"].send(signal.SIGSTOP)
        stopped_s = time.monotonic()
        wait_until(lambda: time.monotonic() > stopped_s + STOPPED_S, "five seconds pass")
        grown_mb = [
            process.memory_mb() - before
            for process, before in zip(looked_at, before_mb, strict=True)
        ]
        gaps_s = {topic.name: listener.longest_gap_s(topic, stopped_s) for topic in listener.came_s}
        system.processes["recorder"].send(signal.SIGCONT)
        witness.goes_on(20)
    feeder.pause()
    witness.agrees()
    assert system.processes["recorder"].end(signal.SIGTERM) == 0
    assert max(grown_mb) < GROWTH_MB, grown_mb
    assert max(gaps_s.values()) < LONGEST_GAP_S, gaps_s
    assert not witness.shell.intake.gaps
    summary = json.loads("{" + "\n".join(system.processes["recorder"].said()).partition("{")[2])
    assert summary["never_drop_whole"], summary
    deltas = [
        record.sequence for record in LogReader(system.folder / "log.mcap").records({topics.DELTA})
    ]
    assert deltas == list(range(deltas[0], witness.deltas[-1].seq + 1))
