"""An agent in one process, and somebody on its bus who publishes what is not true."""

from __future__ import annotations

import itertools
import time
from collections import Counter

import msgspec

from cogmap.bus.codec import Envelope, decode, encode
from cogmap.bus.interface import Arrival
from cogmap.bus.memory import MemoryBus
from cogmap.graph.graph import Graph
from cogmap.runtime.config import Sections
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.topics import Topic
from cogmap.services import registry
from cogmap.testing.town import COGNITION

MODULES = ("sim", *COGNITION, "memory")
REPEATED_NS = 60 * 10**9
"""Wall time after which a frame that nobody has answered is repeated."""


class Deceived:
    """Drives in lockstep, sensed by percepts. The wall's time passes only where the body is to
    repeat what it has sensed.
    """

    def __init__(self) -> None:
        configured: Sections = {
            "run": {"lockstep": True, "participants": dict.fromkeys(MODULES, 1)},
            "sim": {"seed": 1, "town": "blocks", "sensing": "percepts"},
            "planning": {"explore": True},
        }
        modules = [registry.build(name, configured) for name in MODULES]
        self._repeat = modules[0].timers.pop().handler
        self._runner = InProcessRunner(modules)
        self._liar = MemoryBus(self._runner.network)
        self._last: dict[Topic, Arrival] = {}
        self._lies: Counter[Topic] = Counter()
        self._wall_ns = itertools.count(0, REPEATED_NS)
        self._lies_now = False
        self.commands = 0
        for topic in topics.ALL:
            self._liar.subscribe(topic, self._keep, lambda name, number: None)

    def close(self) -> None:
        """End every module."""
        self._runner.close()

    @property
    def shells(self) -> dict[str, Shell]:
        """The shells by module."""
        return {shell.module.name: shell for shell in self._runner.shells}

    @property
    def said(self) -> list[Topic]:
        """The topics on which something was published, in the order of the table."""
        return [topic for topic in topics.ALL if topic in self._last]

    def last(self, topic: Topic) -> Message:
        """The last true message of a topic."""
        return decode(topic, bytes(self._last[topic].payload))

    def publish(self, untrue: Message, in_its_name: bool) -> None:
        """Publish a message that is not true, under the name and with the next number of who
        publishes on that topic, or under another's.
        """
        topic = topics.of(untrue)
        arrival = self._last[topic]
        assert arrival.envelope is not None
        source = arrival.envelope.source if in_its_name else "liar"
        seq = arrival.envelope.seq + 1 if in_its_name else self._lies[topic]
        self._lies[topic] += not in_its_name
        now_ns = time.time_ns()
        envelope = Envelope(source, seq, arrival.envelope.incarnation, now_ns, now_ns)
        numbered = msgspec.structs.replace(untrue, source=source, seq=seq)
        self._lies_now = True
        self._liar.publish(topic, encode(numbered), envelope)
        self._lies_now = False

    def drive(self, views: int) -> int:
        """Go on for so many views. Returns how often the body had to repeat one, -1 if it stands
        for good.
        """
        goal = self.commands + views
        repeats = 0
        while self.commands < goal:
            before = self.commands
            self._runner.run(lambda: self.commands >= goal)
            if self.commands > before:
                continue
            if repeats == 2 * views:
                return -1

            repeats += 1
            for wall_ns in (next(self._wall_ns), next(self._wall_ns)):
                self._wait(wall_ns)
                self._runner.run(lambda: self.commands >= goal)

        return repeats

    def graphs(self) -> dict[str, Graph]:
        """The graphs of the modules that follow the workspace's, places and all."""
        found = {}
        for name in ("codelets", "memory"):
            graph = self.shells[name].module.graph
            assert graph is not None
            found[name] = graph
        return found

    def _wait(self, wall_ns: int) -> None:
        """Let it be `wall_ns` for the body."""
        self.shells["sim"].call(lambda: self._repeat(wall_ns))

    def _keep(self, arrival: Arrival) -> None:
        if self._lies_now:
            return
        self._last[arrival.topic] = arrival
        self.commands += arrival.topic is topics.MOTOR_COMMAND
