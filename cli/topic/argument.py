"""The TOPIC argument of a command."""

from __future__ import annotations

import click

from cogmap.errors import UsageError
from cogmap.hints import did_you_mean
from cogmap.schemas import topics
from cogmap.schemas.topics import Delivery, Topic


def topic_named(name: str) -> Topic:
    """Find the topic `name`, which may begin with a slash. Raises UsageError naming the nearest."""
    found = topics.BY_NAME.get(name.strip("/"))
    if found is not None:
        return found

    hint = did_you_mean(name, topics.BY_NAME, "see `cogmap topic list`")
    raise UsageError(f"no topic {name!r}: {hint}")


def streamed_topic(name: str) -> Topic:
    """Find the topic `name`, which must be one that is published. Raises UsageError."""
    topic = topic_named(name)
    if topic.delivery is Delivery.ON_REQUEST:
        raise UsageError(
            f"{topic.name} is answered on request and never published: there is nothing to watch"
        )
    return topic


topic_argument = click.argument(
    "topic", metavar="TOPIC", callback=lambda context, parameter, name: topic_named(name)
)
streamed_argument = click.argument(
    "topic", metavar="TOPIC", callback=lambda context, parameter, name: streamed_topic(name)
)
