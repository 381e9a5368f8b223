"""`cogmap topic`: watches topics of a running system, and publishes on them."""

from __future__ import annotations

import click

from cogmap.cli.topic.echo import echo
from cogmap.cli.topic.listing import find, info, listing, type_
from cogmap.cli.topic.pub import pub
from cogmap.cli.topic.rates import bw, delay, hz


@click.group()
def topic() -> None:
    """Watch topics of a running system, or publish on them."""


for command in (listing, info, type_, find, echo, hz, bw, delay, pub):
    topic.add_command(command)
