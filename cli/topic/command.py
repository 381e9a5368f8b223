"""`cogmap topic`: watches topics of a running system, and publishes on them."""

from __future__ import annotations

import click

from cogmap.cli.verbs import add_verbs

VERBS = {
    "list": ("cogmap.cli.topic.listing:listing", "List the topics in use."),
    "info": ("cogmap.cli.topic.listing:info", "Show type, publishers and subscribers of a topic."),
    "type": ("cogmap.cli.topic.listing:type_", "Print the type of a topic's messages."),
    "find": ("cogmap.cli.topic.listing:find", "List the topics whose messages have a type."),
    "echo": ("cogmap.cli.topic.echo:echo", "Print messages as they arrive."),
    "hz": ("cogmap.cli.topic.rates:hz", "Measure how often messages arrive."),
    "bw": ("cogmap.cli.topic.rates:bw", "Measure how many bytes a second arrive."),
    "delay": ("cogmap.cli.topic.rates:delay", "Measure how old messages are when they arrive."),
    "pub": ("cogmap.cli.topic.pub:pub", "Publish a message again and again."),
}


@click.group()
def topic() -> None:
    """Watch topics of a running system, or publish on them."""


add_verbs(topic, VERBS)
