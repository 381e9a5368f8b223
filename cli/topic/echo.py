"""`cogmap topic echo`: prints messages as they arrive."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from typing import Any

import click
import msgspec

from cogmap.bus.interface import Arrival
from cogmap.cli.options import agent_option, connect_option, json_option
from cogmap.cli.topic.argument import streamed_argument
from cogmap.cli.topic.observing import TICK_S, RouterWatch, observing
from cogmap.errors import UsageError
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.intake import Intake
from cogmap.runtime.process import Stop
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.base import Message
from cogmap.schemas.render import field as field_at
from cogmap.schemas.render import to_jsonable, to_text
from cogmap.schemas.topics import Topic

Format = Callable[[Message], str]


@click.command()
@streamed_argument
@click.option("--once", is_flag=True, help="End after one message.")
@click.option("-n", "--times", type=click.IntRange(min=1), help="End after this many messages.")
@click.option("--field", metavar="PATH", help="Only this part, such as objects.0.label.")
@click.option("-f", "--full-length", is_flag=True, help="All values of every array.")
@click.option("--csv", "as_csv", is_flag=True, help="One line a message, separated by commas.")
@click.option("--no-arr", is_flag=True, help="Of arrays, only their type and shape.")
@json_option
@connect_option
@agent_option
def echo(
    topic: Topic,
    once: bool,
    times: int | None,
    field: str | None,
    full_length: bool,
    as_csv: bool,
    no_arr: bool,
    as_json: bool,
    connect: str,
    agent: str,
) -> None:
    """Print messages until Ctrl-C."""
    if as_csv and as_json:
        raise UsageError("--csv and --json exclude each other: choose one")

    style = "csv" if as_csv else "json" if as_json else "text"
    show = formatter(field, full_length, no_arr, style)
    stop = Stop()
    with observing(connect, agent, "topic-echo") as bus:
        messages = _Messages(topic)
        bus.subscribe(topic, messages.inbox.put, messages.intake.count_lost)
        router = RouterWatch(bus.session, connect)
        limit = 1 if once else times
        while not stop.asked and messages.number != limit:
            message = messages.take(TICK_S)
            if message is None:
                router.check()
            else:
                click.echo(show(message))

    if stop.asked:
        click.echo(messages.counts(), err=True)


class _Messages:
    """The valid messages of `topic`, and counts of the others."""

    def __init__(self, topic: Topic) -> None:
        self.inbox = Inbox()
        self.intake = Intake()
        self.number = 0
        self._topic = topic

    def take(self, timeout_s: float) -> Message | None:
        """The next one; None where there is none within `timeout_s`."""
        arrival = self.inbox.take(timeout_s)
        if not isinstance(arrival, Arrival):
            return None

        message = self.intake.accept(arrival)
        self.number += message is not None
        return message

    def counts(self) -> str:
        """How many were printed, and how many were not and why."""
        rejected = self.intake.rejected[self._topic.name]
        lost = self.intake.gaps[self._topic.name]
        superseded = self.inbox.superseded[self._topic.name]
        return (
            f"{self.number} messages, {rejected} rejected, {lost} lost, "
            f"{superseded} superseded by newer ones"
        )


def formatter(path: str | None, full: bool, no_arrays: bool, style: str) -> Format:
    """A function that turns a message, or the part of it at `path`, into text, JSON or CSV.

    It raises UsageError where the message has no such part.
    """

    def format_part(message: Message) -> str:
        part = _part_of(message, path)
        if no_arrays:
            part = without_arrays(part)

        if style == "json":
            return json.dumps(to_jsonable(part, full))
        if style == "csv":
            plain = to_jsonable(part, full) if full else without_arrays(part)
            return comma_separated(plain)
        return f"{to_text(part, full)}\n---"

    return format_part


def _part_of(message: Message, path: str | None) -> Any:
    if path is None:
        return message
    try:
        return field_at(message, path)
    except LookupError as error:
        raise UsageError(f"--field {path}: {error.args[0]}") from None


def without_arrays(part: Any) -> Any:
    """`part` as dicts, lists and scalars, each array in it as its type and shape."""
    if isinstance(part, Array | Matrix):
        return f"<array type: {part.dtype}{list(part.shape)}>"
    if isinstance(part, msgspec.Struct):
        fields = {name: getattr(part, name) for name in part.__struct_fields__}
        return without_arrays(fields)

    if isinstance(part, dict):
        return {name: without_arrays(value) for name, value in part.items()}
    if isinstance(part, list | tuple):
        return [without_arrays(value) for value in part]
    return part


def comma_separated(part: Any) -> str:
    """All scalars in `part`, in order, as one line of CSV."""
    line = io.StringIO()
    csv.writer(line, lineterminator="").writerow(_leaves(part))
    return line.getvalue()


def _leaves(part: Any) -> list[Any]:
    if isinstance(part, dict):
        part = list(part.values())
    if not isinstance(part, list | tuple):
        return [part]

    leaves = []
    for item in part:
        leaves += _leaves(item)
    return leaves
