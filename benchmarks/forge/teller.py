"""Tells the lies of one case to a driving system."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable
from pathlib import Path

from msgspec.structs import replace

from benchmarks.forge.cases import ANSWERED, TOLD_AS_ONESELF, Case, Kind
from benchmarks.forge.driving import Driving
from benchmarks.forge.lies import FAR, STRANGER, in_time, lie
from cogmap.bus.codec import Envelope, decode
from cogmap.bus.interface import Member
from cogmap.cli.launch.command_line import cogmap_command, environment
from cogmap.cli.launch.plan import CONFIG_NAME, REPLICATED
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Task
from cogmap.schemas.examples import example
from cogmap.schemas.graph import SnapshotRequest
from cogmap.schemas.topics import Topic

LIE_S = 1.0
LIE_HZ = 20
FLOOD_S = 2.0
FLOOD_HZ = 5000
BURST = 50
ASKED = 300
STARTED_S = 20.0
END_S = 10.0
TICK_S = 0.02
READY = "is ready"
PRESENT_S = 4.0
"""How long a ghost's token is there, and a second instance once it has started."""

FOLLOWS = {topics.MOTOR_COMMAND: topics.TRUE_POSE, topics.PROPOSAL: topics.TASK}
"""A lie about the one comes after a true message of the other: before the true answer to it."""


class Teller:
    """Lies to `driving`. `lies` is how many, `said` what a second instance printed, and `remark`
    how it ended.
    """

    def __init__(self, driving: Driving, case: Case) -> None:
        self.lies = 0
        self.said: list[str] = []
        self.remark = ""
        self._driving = driving
        self._case = case
        self._listener = driving.listener

    def tell(self) -> None:
        """Tell the lies of the case."""
        topic = self._case.topic
        match self._case.kind:
            case _ if topic is topics.SNAPSHOT:
                self._answer(topic)
            case _ if topic in ANSWERED:
                assert topic is not None
                self._ask(topic)
            case Kind.GHOST:
                self._be_a_ghost()
            case Kind.SECOND_INSTANCE:
                self._be_second()
            case Kind.FLOOD:
                self._flood()
            case _:
                self._lie()

    def _true(self, topic: Topic) -> tuple[Message, int, int]:
        """Return the newest message of a topic, the incarnation of its source and the number of its
        next; an example where there was none.
        """
        received = self._listener.newest.get(topic)
        if received is not None:
            message = decode(topic, received.payload)
            return message, received.envelope.incarnation, message.seq + 1

        sources = self._driving.publishers(topic)
        source = sources[0] if sources else "nobody"
        incarnation = self._listener.incarnations.get(source, time.time_ns())
        now_ns = self._listener.places[-1].pose.stamp_ns
        message = replace(example(topic), source=source, stamp_ns=now_ns)
        return message, incarnation, 0

    def _lie(self) -> None:
        """Lie after each true message of the topic, LIE_HZ at most; without any, as often."""
        topic = self._case.topic
        assert topic is not None
        waits_for = FOLLOWS.get(topic, topic)
        own = time.time_ns()
        next_s = 0.0
        told = 0

        def tell() -> None:
            nonlocal next_s, told
            if time.monotonic() >= next_s:
                next_s = time.monotonic() + 1 / LIE_HZ
                self._tell_once(topic, own, told)
                told += 1

        def on_topic(received: Topic) -> None:
            if received is waits_for:
                tell()

        began_s = time.monotonic()
        self._listener.on_topic = on_topic
        while (passed_s := time.monotonic() - began_s) < LIE_S:
            self._listener.pump(TICK_S)
            if passed_s > LIE_S / 2 and (not told or topic not in self._listener.newest):
                tell()
        self._listener.on_topic = _nothing
        self.lies = told

    def _answer(self, topic: Topic) -> None:
        """Answer those who ask for the graph, while somebody joins."""
        driving = self._driving
        true = driving.fetched()
        message = lie(self._case.kind, true.snapshot, 0, 0)
        now_ns = time.time_ns()
        envelope = Envelope(true.source, 0, true.incarnation or now_ns, now_ns, now_ns)
        if self._case.kind in TOLD_AS_ONESELF:
            envelope = Envelope(STRANGER, 0, now_ns, now_ns, now_ns)
        with driving.forger.answering(topics.SNAPSHOT_REQUEST, message, envelope) as answered:
            driving.rejoin()
            self._pump_until(lambda: False, LIE_S)
            self.lies = answered()

    def _ask(self, topic: Topic) -> None:
        """Ask for the graph as no module would."""
        if self._case.kind is Kind.FAR_VERSION:
            request: Message = SnapshotRequest(at_least=FAR[Kind.FAR_VERSION])
            number = 1
        else:
            request = topic.type()
            number = ASKED
        for _ in range(number):
            self._driving.forger.ask(topic, request)
            self._listener.pump(0.0)
        self.lies = number

    def _tell_once(self, topic: Topic, own: int, told: int) -> None:
        """Put one lie. It has the next number of who publishes, or a number of the liar's own."""
        driving, kind = self._driving, self._case.kind
        true, incarnation, number = self._true(topic)
        true = in_time(true, self._listener.places[-1].pose.stamp_ns, self._task())
        if kind in TOLD_AS_ONESELF:
            incarnation = own
        is_numbered = kind in (*TOLD_AS_ONESELF, Kind.FAR_NUMBER)
        if topic not in self._listener.newest and not is_numbered:
            number = driving.told[topic]
            driving.told[topic] += 1
        message = lie(kind, true, number, told if is_numbered else 0)
        driving.forger.put(topic, message, incarnation)

    def _task(self) -> Task | None:
        received = self._listener.newest.get(topics.TASK)
        if received is None:
            return None
        task = decode(topics.TASK, received.payload)
        return task if isinstance(task, Task) else None

    def _flood(self) -> None:
        topic = self._case.topic
        assert topic is not None
        true, _, _ = self._true(topic)
        own = time.time_ns()
        began_s = time.monotonic()
        told = 0
        while (passed_s := time.monotonic() - began_s) < FLOOD_S:
            if told > FLOOD_HZ * passed_s:
                self._listener.pump(0.001)
                continue
            for _ in range(BURST):
                self._driving.forger.put(topic, lie(Kind.FLOOD, true, 0, told), own)
                told += 1
        self.lies = told

    def _be_a_ghost(self) -> None:
        module = self._case.subject
        self._driving.forger.announce(Member(module, f"{module}-ghost"))
        self._pump_until(lambda: False, PRESENT_S)
        self._driving.forger.withdraw()
        self.lies = 1

    def _be_second(self) -> None:
        """Start another process of a module's instance, as by mistake, and end it."""
        running = self._driving.system
        module = self._case.subject
        instance = f"{module}-1" if module == REPLICATED else module
        joins = ("--connect", running.endpoint, "--agent", running.agent)
        settings = ("--config", str(running.folder / CONFIG_NAME))
        command = cogmap_command("module", module, "--instance", instance, *joins, *settings)

        self._listener.trusted = dict(self._listener.incarnations)
        log = running.folder / f"second-{module}.txt"
        with log.open("wb") as output:
            second = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=output, stderr=output, env=environment()
            )
        try:
            self._pump_until(lambda: second.poll() is not None or _is_ready(log), STARTED_S)
            self._pump_until(lambda: second.poll() is not None, PRESENT_S)
            if second.poll() is not None:
                self.remark = f"it ended with {second.returncode}"
        finally:
            _end(second)

        self._listener.pump(TICK_S)
        self._listener.trusted = {}
        self.lies = 1
        lines = log.read_text(errors="replace").splitlines()
        self.said = [f"second {module}: {line}" for line in lines if READY not in line]

    def _pump_until(self, condition: Callable[[], bool], timeout_s: float) -> None:
        until_s = time.monotonic() + timeout_s
        while time.monotonic() < until_s and not condition():
            self._listener.pump(TICK_S)


def _is_ready(log: Path) -> bool:
    return READY in log.read_text(errors="replace")


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(END_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _nothing(topic: Topic) -> None:
    """Do nothing."""
