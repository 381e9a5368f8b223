"""A module: what a cognitive process does, apart from how its messages travel."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

from msgspec.structs import replace

from cogmap.errors import CogmapError
from cogmap.graph.graph import Graph
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta
from cogmap.schemas.topics import Topic

Reply = Message | Iterable[Message] | None
Handler = Callable[[Any], Reply]


@dataclass(frozen=True)
class Timer:
    """A handler that is called with the time in ns every `period_ns`."""

    period_ns: int
    handler: Callable[[int], Reply]


@dataclass
class Module:
    """Messages in, messages out.

    It has no clock, no bus, no thread and no file: the shell around it has. `name` is what it is,
    `instance` which one of them. A handler returns what to publish: None, a message, or several; of
    an iterator each message is published before the next is asked for. A message without sense
    makes it raise MessageError, before it has changed anything. `notes` returns what its health
    reports in words: what is wrong with what it receives. Where it `is_lockstep`, others wait for
    its answer to each message.
    """

    name: str
    instance: str = ""
    handlers: dict[Topic, Handler] = field(default_factory=dict)
    emits: set[Topic] = field(default_factory=set)
    served: dict[Topic, tuple[Topic, Callable[[Any], Message]]] = field(default_factory=dict)
    timers: list[Timer] = field(default_factory=list)
    requires: dict[str, int] = field(default_factory=dict)
    start: Callable[[], Reply] | None = None
    journal: Topic | None = None
    restore: Callable[[Iterable[Message]], None] | None = None
    compact: Callable[[], Message] | None = None
    backfill: frozenset[Topic] = frozenset()
    remembers: bool = False
    graph: Graph | None = None
    on_load: Callable[[], Reply] | None = None
    notes: Callable[[], list[str]] | None = None
    heartbeats: frozenset[str] = frozenset()
    is_lockstep: bool = False
    _next_seq: Counter[Topic] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self.instance = self.instance or self.name

    def on(self, topic: Topic, handler: Handler, emits: Iterable[Topic] = ()) -> Module:
        """Receive `topic`; `handler` may return messages of `emits`."""
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

    def on_start(
        self, handler: Callable[[], Reply], requires: dict[str, int], emits: Iterable[Topic] = ()
    ) -> Module:
        """Call `handler` once, when `requires` (module: how many instances) are all ready."""
        self.start = handler
        self.requires = requires
        self.emits.update(emits)
        return self

    def observing(
        self, handler: Handler, heartbeats: Iterable[str] = (), emits: Iterable[Topic] = ()
    ) -> Module:
        """Learn who comes and goes by messages on presence, which it publishes for the log.

        Those of the modules `heartbeats` count as present only while they report their health.
        """
        self.heartbeats = frozenset(heartbeats)
        return self.on(topics.PRESENCE, handler, [topics.PRESENCE, *emits])

    def serve(self, request: Topic, reply: Topic, handler: Callable[[Any], Message]) -> Module:
        """Answer queries for `request` with a message of `reply`."""
        self.served[request] = (reply, handler)
        return self

    def journaling(
        self,
        topic: Topic,
        restore: Callable[[Iterable[Message]], None],
        compact: Callable[[], Message],
        backfill: Iterable[Topic] = (),
    ) -> Module:
        """Write what it publishes on `topic` to a journal first; `restore` gets it after a restart.

        `compact` returns one message that stands for all of them. On the topics in `backfill` it
        receives, after a restart, also what was published before: what it has received already,
        and what was published while it was away.
        """
        self.journal = topic
        self.restore = restore
        self.compact = compact
        self.backfill = frozenset(backfill)
        return self

    def remembering(self, restore: Handler) -> Module:
        """Keep what it publishes on memory/stored in a database that outlives the run, if there is
        one: on the disk before it is published. `restore` receives all of that at the start.
        """
        self.remembers = True
        return self.on(topics.RESTORED, restore, [topics.STORED])

    def feed(self, message: Message) -> list[Message]:
        """Hand `message` to its handler, and return what that publishes, numbered."""
        return list(self.answers(message))

    def answers(self, message: Message) -> Iterator[Message]:
        """Do as `feed` does, but yield each message as soon as it is known."""
        if self.graph is not None and isinstance(message, Delta):
            self.graph.apply(message)

        reply = self.handlers[topics.of(message)](message)
        parts = reply if isinstance(reply, Iterator) else [reply]
        for part in parts:
            yield from self.stamp(part)

    def loaded(self) -> list[Message]:
        """Call `on_load`, and return what that publishes, numbered."""
        return [] if self.on_load is None else self.stamp(self.on_load())

    def stamp(self, reply: Reply) -> list[Message]:
        """Copy what a handler returned, with this instance's name and the next numbers.

        Raises CogmapError for a message of a topic that the module does not declare.
        """
        numbered = []
        for message in _as_list(reply):
            topic = topics.of(message)
            if topic not in self.emits:
                raise CogmapError(
                    f"{self.name} publishes {topic.name}, which it does not declare: "
                    f"name it in `emits`"
                )
            seq = self._next_seq[topic]
            self._next_seq[topic] += 1
            numbered.append(replace(message, source=self.instance, seq=seq))
        return numbered


def _as_list(reply: Reply) -> list[Message]:
    if reply is None:
        return []
    if isinstance(reply, Message):
        return [reply]
    return list(reply)


def _ignore(message: Message) -> None:
    """Do nothing: only the shell uses the topic."""
