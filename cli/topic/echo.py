"""`cogmap topic echo`: prints messages as they arrive."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import click
import msgspec

from cogmap.bus.interface import Arrival
from cogmap.cli.options import json_option
from cogmap.cli.topic.argument import streamed_argument
from cogmap.cli.topic.observing import TICK_S, RouterWatch, observing
from cogmap.errors import UsageError
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.intake import Intake
from cogmap.runtime.process import Stop
from cogmap.runtime.program import agent_option, connect_option
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.base import Message
from cogmap.schemas.render import field, to_jsonable, to_text
from cogmap.schemas.topics import Topic

Format = Callable[[Message], str]


@click.command()
@streamed_argument
@click.option("--once", is_flag=True, help="End after one message.")
@click.option("-n", "--times", type=click.IntRange(min=1), help="End after this many messages.")
@click.option(
    "--field",
    "fields",
    multiple=True,
    metavar="PATH",
    help="Print only this part, such as objects.0.label; may be repeated.",
)
@click.option("-f", "--full-length", is_flag=True, help="Print all values of arrays.")
@click.option(
    "--csv",
    "as_csv",
    is_flag=True,
    help="Print each message as one line of comma-separated values.",
)
@click.option("--no-arr", is_flag=True, help="Print only type and shape of arrays.")
@json_option
@connect_option
@agent_option
def echo(
    topic: Topic,
    once: bool,
    times: int | None,
    fields: tuple[str, ...],
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
    show = formatter(fields, full_length, no_arr, style)
    with observing(connect, agent, "topic-echo") as bus:
        stop = Stop()
        messages = ValidMessages(topic)
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


class ValidMessages:
    """The valid messages of `topic`, and counts of the others."""

    def __init__(self, topic: Topic) -> None:
        self.inbox = Inbox()
        self.intake = Intake()
        self.number = 0
        self._topic = topic

    def take(self, timeout_s: float) -> Message | None:
        """Take the next one; None if there is none within `timeout_s`."""
        arrival = self.inbox.take(timeout_s)
        if not isinstance(arrival, Arrival):
            return None

        message = self.intake.accept(arrival)
        self.number += message is not None
        return message

    def counts(self) -> str:
        """Count the messages that were printed, and those that were not, by reason."""
        rejected = self.intake.rejected[self._topic.name]
        lost = self.intake.gaps[self._topic.name]
        superseded = self.inbox.superseded[self._topic.name]
        return (
            f"{self.number} messages, {rejected} rejected, {lost} lost, "
            f"{superseded} superseded by newer ones"
        )


def formatter(paths: Sequence[str], full: bool, no_arrays: bool, style: str) -> Format:
    """Make a function that turns a message into text, JSON or CSV.

    With a path it turns the part there, with several the parts by their paths. It raises UsageError
    if the message has no such part.
    """

    def part_at(message: Message, path: str) -> Any:
        try:
            return field(message, path)
        except LookupError as error:
            raise UsageError(f"--field {path}: {error.args[0]}") from None

    def format_part(message: Message) -> str:
        part: Any = message
        if len(paths) == 1:
            part = part_at(message, paths[0])
        elif paths:
            part = {path: part_at(message, path) for path in paths}
        if no_arrays:
            part = without_arrays(part)

        if style == "json":
            return json.dumps(to_jsonable(part, full))
        if style == "csv":
            plain = to_jsonable(part, full) if full else without_arrays(part)
            return comma_separated(plain)
        return f"{to_text(part, full)}\n---"

    return format_part


def without_arrays(part: Any) -> Any:
    """Return `part` as dicts, lists and scalars, each array in it as its type and shape."""
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
    """Write all scalars in `part`, in order, as one line of CSV."""

    def scalars(part: Any) -> Iterator[Any]:
        if isinstance(part, dict):
            part = list(part.values())
        if not isinstance(part, list | tuple):
            yield part
            return
        for item in part:
            yield from scalars(item)

    line = io.StringIO()
    csv.writer(line, lineterminator="").writerow(scalars(part))
    return line.getvalue()
