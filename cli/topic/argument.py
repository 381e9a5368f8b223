"""The TOPIC argument of a command."""

from __future__ import annotations

import click

from cogmap.errors import UsageError
from cogmap.recording import selection
from cogmap.schemas import topics
from cogmap.schemas.topics import Delivery, Topic


def streamed_topic(name: str) -> Topic:
    """Find the topic `name`, which must be one that is published. Raises UsageError."""
    topic = selection.one(name)
    if topic.delivery is Delivery.ON_REQUEST:
        raise UsageError(
            f"{topic.name} is answered on request and never published: there is nothing to watch"
        )
    return topic


def complete_topic(context: click.Context, parameter: click.Parameter, begun: str) -> list[str]:
    """Return the names of topics that begin so, for a shell."""
    return [name for name in topics.BY_NAME if name.startswith(begun)]


topic_argument = click.argument(
    "topic",
    metavar="TOPIC",
    callback=lambda context, parameter, name: selection.one(name),
    shell_complete=complete_topic,
)
streamed_argument = click.argument(
    "topic",
    metavar="TOPIC",
    callback=lambda context, parameter, name: streamed_topic(name),
    shell_complete=complete_topic,
)
topics_argument = click.argument("topics", nargs=-1, shell_complete=complete_topic)
