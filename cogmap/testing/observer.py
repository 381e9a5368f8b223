"""A module that keeps what others publish."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

from cogmap.graph.graph import Graph
from cogmap.runtime.module import Module
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta
from cogmap.schemas.topics import DELTA, Topic

M = TypeVar("M")


class Observer:
    """Keeps the messages of topics, and follows the graph.

        observer = Observer(topics.MOTOR_COMMAND)
        with InProcessRunner([sim, motor, observer.module]) as runner:
            runner.run(lambda: len(observer.messages) >= 20)

    `messages` are those received, in order; `graph` is the workspace's as of now. Pass
    `topics.DELTA` to keep the deltas as well.
    """

    def __init__(self, *topics: Topic, name: str = "observer") -> None:
        self.messages: list[Message] = []
        self.graph = Graph()
        keeps_deltas = DELTA in topics

        def on_delta(delta: Delta) -> None:
            if keeps_deltas:
                self.messages.append(delta)

        self.module = Module(name).following(self.graph, on_delta)
        for topic in topics:
            if topic is not DELTA:
                self.module.on(topic, self.messages.append)

    def of(self, kind: type[M]) -> list[M]:
        """Return the messages of one type, in order."""
        return of_type(kind, self.messages)

    def last(self, kind: type[M]) -> M | None:
        """Return the newest message of a type; None if there was none yet."""
        return next((each for each in reversed(self.messages) if isinstance(each, kind)), None)


def of_type(kind: type[M], messages: Iterable[object]) -> list[M]:
    """Return the messages, nodes or operations of one type, in order."""
    return [message for message in messages if isinstance(message, kind)]
