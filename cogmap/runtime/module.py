"""A module: what a cognitive process is, apart from how its messages travel."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from cogmap.errors import CogmapError
from cogmap.graph.graph import Graph
from schemas import topics
from schemas.base import Message
from schemas.graph import Delta
from schemas.topics import Topic

Reply = Message | Iterable[Message] | None
Handler = Callable[[Any], Reply]


def _ignore(message: Message) -> None:
    """A handler for a topic that matters only to the shell."""


@dataclass(frozen=True)
class Timer:
    """A handler that is called with the time in ns every `period_ns`, for modules that start things
    by themselves.
    """

    period_ns: int
    handler: Callable[[int], Reply]


@dataclass
class Module:
    """Messages in, messages out. It has no clock, no bus, no thread and no file: the shell around
    it has.
    """

    name: str
    instance: str = ""
    handlers: dict[Topic, Handler] = field(default_factory=dict)
    emits: set[Topic] = field(default_factory=set)
    answers: dict[Topic, tuple[Topic, Callable[[Any], Message]]] = field(default_factory=dict)
    timers: list[Timer] = field(default_factory=list)
    awaits: dict[str, int] = field(default_factory=dict)
    start: Callable[[], Reply] | None = None
    journal: Topic | None = None
    restore: Callable[[Iterable[Message]], None] | None = None
    condense: Callable[[], Message] | None = None
    catches_up: frozenset[Topic] = frozenset()
    graph: Graph | None = None
    on_load: Callable[[], Reply] | None = None
    _next_seq: Counter[Topic] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self.instance = self.instance or self.name

    def on(self, topic: Topic, handler: Handler, emits: Iterable[Topic] = ()) -> Module:
        """Take in `topic`; `handler` returns what to say: nothing, a message, or several."""
        self.handlers[topic] = handler
        self.emits.update(emits)
        return self

    def following(
        self,
        graph: Graph,
        on_delta: Handler | None = None,
        emits: Iterable[Topic] = (),
        on_load: Callable[[], Reply] | None = None,
    ) -> Module:
        """Keep `graph` the same as the workspace's: a replica.

        Each delta is applied before the module receives any later message; then `on_delta`, if
        given, receives it. A delta that cannot be applied yet is not handed over. `on_load` is
        called after a snapshot has replaced the whole graph: when the module joins a running
        system, when deltas were lost, and when the workspace was restarted.
        """
        self.graph = graph
        self.on_load = on_load
        return self.on(topics.DELTA, on_delta or _ignore, emits)

    def every(
        self, period_ns: int, handler: Callable[[int], Reply], emits: Iterable[Topic] = ()
    ) -> Module:
        """Call `handler` with the time every `period_ns`, in real time."""
        self.timers.append(Timer(period_ns, handler))
        self.emits.update(emits)
        return self

    def starts(
        self, handler: Callable[[], Reply], awaits: dict[str, int], emits: Iterable[Topic] = ()
    ) -> Module:
        """Call `handler` once, as soon as `awaits` (module: how many instances) are all ready."""
        self.start = handler
        self.awaits = awaits
        self.emits.update(emits)
        return self

    def serve(self, request: Topic, reply: Topic, handler: Callable[[Any], Message]) -> Module:
        """Answer queries for `request` with a message of `reply`."""
        self.answers[request] = (reply, handler)
        return self

    def journaling(
        self,
        topic: Topic,
        restore: Callable[[Iterable[Message]], None],
        condense: Callable[[], Message],
        catches_up: Iterable[Topic] = (),
    ) -> Module:
        """Write down what it says on `topic` before it is sent, and give it back to `restore` after
        a restart.

        `condense` returns one message that stands for all that was said. On the topics that it
        `catches_up` with, it is given after a restart what was said before: of what it had, and of
        what was said while it was away.
        """
        self.journal = topic
        self.restore = restore
        self.condense = condense
        self.catches_up = frozenset(catches_up)
        return self

    def feed(self, message: Message) -> list[Message]:
        """Let it take in `message`, and return what it says, numbered."""
        if self.graph is not None and isinstance(message, Delta):
            self.graph.apply(message)
        return self.stamp(self.handlers[topics.of(message)](message))

    def loaded(self) -> list[Message]:
        """Call `on_load`, and return what it publishes, numbered."""
        return [] if self.on_load is None else self.stamp(self.on_load())

    def stamp(self, reply: Reply) -> list[Message]:
        """Number what a handler returned and put this instance's name on it."""
        messages = [] if reply is None else [reply] if isinstance(reply, Message) else list(reply)
        for message in messages:
            topic = topics.of(message)
            if topic not in self.emits:
                raise CogmapError(f"{self.name} says {topic.name}, which it does not declare")
            message.source = self.instance
            message.seq = self._next_seq[topic]
            self._next_seq[topic] += 1
        return messages
