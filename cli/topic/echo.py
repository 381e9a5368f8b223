"""`cogmap topic echo`: messages as they come."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from typing import Any

import click
import msgspec

from cli.options import agent_option, connect_option, json_option
from cli.topic.argument import streamed_argument
from cli.topic.observing import TICK_S, observing
from cogmap.bus.interface import Arrival
from cogmap.errors import UsageError
from cogmap.runtime.inbox import Inbox
from cogmap.runtime.intake import Intake
from cogmap.runtime.process import Stop
from schemas.array import Array
from schemas.base import Message
from schemas.render import field as field_at
from schemas.render import to_jsonable, to_text
from schemas.topics import Topic

Show = Callable[[Message], str]


@click.command()
@streamed_argument
@click.option("--once", is_flag=True, help="End after one message.")
@click.option("-n", "--times", type=click.IntRange(min=1), help="End after so many messages.")
@click.option("--field", metavar="PATH", help="Only this part, such as objects.0.label.")
@click.option("-f", "--full-length", is_flag=True, help="All numbers of every array.")
@click.option("--csv", "as_csv", is_flag=True, help="A line a message, values separated by commas.")
@click.option("--no-arr", is_flag=True, help="Nothing of arrays but their type and shape.")
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
    show = shower(field, full_length, no_arr, "csv" if as_csv else "json" if as_json else "text")
    stop = Stop()
    inbox = Inbox()
    intake = Intake()
    number = 0
    limit = 1 if once else times
    with observing(connect, agent, "topic echo") as bus:
        bus.subscribe(topic, inbox.put, intake.count_lost)
        while not stop.asked and number != limit:
            arrival = inbox.take(TICK_S)
            message = intake.accept(arrival) if isinstance(arrival, Arrival) else None
            if message is not None:
                click.echo(show(message))
                number += 1
    if stop.asked:
        refused = intake.rejected[topic.name]
        lost = intake.gaps[topic.name]
        skipped = inbox.superseded[topic.name]
        click.echo(
            f"{number} messages, {refused} rejected, {lost} lost, {skipped} superseded by newer ones",
            err=True,
        )


def shower(path: str | None, full: bool, no_arrays: bool, style: str) -> Show:
    """What turns a message, or the part of it at `path`, into text, JSON or CSV.

    It raises UsageError where the message has no such part.
    """

    def show(message: Message) -> str:
        try:
            part = message if path is None else field_at(message, path)
        except LookupError as error:
            raise UsageError(f"--field {path}: {error.args[0]}") from None
        part = without_arrays(part) if no_arrays else part
        if style == "json":
            return json.dumps(to_jsonable(part, full))
        if style == "csv":
            return comma_separated(to_jsonable(part, full) if full else without_arrays(part))
        return f"{to_text(part, full)}\n---"

    return show


def without_arrays(part: Any) -> Any:
    """`part` as dicts, lists and scalars, each array in it as its type and shape."""
    if isinstance(part, Array):
        return f"<array type: {part.dtype}{list(part.shape)}>"
    if isinstance(part, msgspec.Struct):
        return without_arrays({name: getattr(part, name) for name in part.__struct_fields__})
    if isinstance(part, dict):
        return {name: without_arrays(value) for name, value in part.items()}
    if isinstance(part, list | tuple):
        return [without_arrays(value) for value in part]
    return part


def comma_separated(part: Any) -> str:
    """All that is in `part`, in order, as one line of CSV."""
    line = io.StringIO()
    csv.writer(line, lineterminator="").writerow(_leaves(part))
    return line.getvalue()


def _leaves(part: Any) -> list[Any]:
    if isinstance(part, dict):
        part = list(part.values())
    if isinstance(part, list | tuple):
        return [leaf for item in part for leaf in _leaves(item)]
    return [part]
