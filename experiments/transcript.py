"""All that a run publishes about the model, as bytes: what two runs are compared by."""

from __future__ import annotations

from collections.abc import Iterable

from cogmap.bus.codec import encode
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.topics import Delivery, Scope, Topic

NAME = "listener"
# What the model publishes and nobody may miss.
MODEL = tuple(
    topic
    for topic in topics.ALL
    if topic.scope is Scope.MODEL and topic.delivery is Delivery.NEVER_DROP
)


class Transcript:
    """Keeps the bytes of the messages on some topics, in the order in which they came on each."""

    def __init__(self, topics: Iterable[Topic]) -> None:
        self._topics = tuple(topics)
        self.messages: dict[str, list[bytes]] = {topic.name: [] for topic in self._topics}

    def module(self) -> Module:
        """Build the module `listener`."""
        module = Module(NAME)
        for topic in self._topics:

            def keep(message: Message, kept: list[bytes] = self.messages[topic.name]) -> None:
                kept.append(encode(message))

            module.on(topic, keep)
        return module

    def has_as_many_as(self, other: Transcript) -> bool:
        """Decide whether it has at least as many messages of each topic."""
        return all(len(self.messages[name]) >= len(there) for name, there in other.messages.items())

    def differs_from(self, other: Transcript) -> list[str]:
        """Return the topics on which the bytes differ."""
        theirs = other.messages
        return [name for name in theirs if self.messages[name] != theirs[name]]
