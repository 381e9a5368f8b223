"""`cogmap topic hz`, `bw` and `delay`: statistics every second until Ctrl-C, and once more then."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from textwrap import indent
from typing import Any, TypeVar

import click

from cogmap.bus.interface import Arrival
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.cli.messages.condition import filter_option, parsed
from cogmap.cli.options import json_option
from cogmap.cli.topic.argument import complete_topic, streamed_topic
from cogmap.cli.topic.observing import TICK_S, Reception, Receptions, RouterWatch, observing
from cogmap.cli.topic.statistics import Bandwidth, Delay, Rate, Statistics
from cogmap.errors import UsageError
from cogmap.runtime.delivery.intake import Intake
from cogmap.runtime.process import Stop
from cogmap.runtime.program import agent_option, connect_option
from cogmap.schemas import topics
from cogmap.schemas.topics import Delivery, Topic

INDENT = "  "
REPORT_S = 1.0
F = TypeVar("F", bound=Callable[..., Any])


def watch_options(window: int) -> Callable[[F], F]:
    """Make the options of what to watch, over `window` messages by default."""
    options = (
        click.argument("names", nargs=-1, metavar="[TOPIC]...", shell_complete=complete_topic),
        click.option("-a", "--all", "everything", is_flag=True, help="Watch every topic."),
        click.option(
            "-w",
            "--window",
            type=click.IntRange(min=2),
            default=window,
            show_default=True,
            help="Compute over this many last messages.",
        ),
        json_option,
        connect_option,
        agent_option,
    )

    def decorated(command: F) -> F:
        for option in reversed(options):
            command = option(command)
        return command

    return decorated


class Watched:
    """A topic, its statistics so far, and how many messages they are of."""

    def __init__(self, topic: Topic, statistics: Statistics) -> None:
        self.topic = topic
        self._statistics = statistics
        self._messages = 0
        self._shown = 0

    def add(self, reception: Reception) -> None:
        """Count one message."""
        self._statistics.add(reception)
        self._messages += 1

    def text(self, *, final: bool) -> str:
        """Write the statistics; empty if no message is new since they were written last, unless it
        is the `final` time.
        """
        is_new = final or self._messages > self._shown
        self._shown = self._messages
        if 0 < self._messages < self._statistics.min_messages:
            return f"one message of {self.topic.name}: two are needed"
        return self._statistics.text() if is_new else ""

    def json(self) -> str:
        """Write the statistics as programs read them."""
        facts = {"topic": self.topic.name, "messages": self._messages}
        return json.dumps(facts | self._statistics.plain())


def chosen(names: Sequence[str], everything: bool) -> list[Topic]:
    """Return the topics to watch. Raises UsageError."""
    if everything and names:
        raise UsageError("--all watches every topic: leave it out, or the topics")
    if not everything and not names:
        raise UsageError("no topic is given: name some, or give --all")

    if everything:
        return [topic for topic in topics.ALL if topic.delivery is not Delivery.ON_REQUEST]
    return [streamed_topic(name) for name in dict.fromkeys(names)]


def report(watched: Sequence[Watched], *, final: bool) -> str:
    """Write the statistics of topics; of several, only those with new messages, each by name."""
    if len(watched) == 1:
        (one,) = watched
        return one.text(final=final) or f"no new messages of {one.topic.name}"

    texts = {each.topic.name: each.text(final=final) for each in watched}
    blocks = [f"{name}\n{indent(text, INDENT)}" for name, text in texts.items() if text]
    return "\n".join(blocks) or "no new messages"


def watch(
    bus: ZenohBus,
    connect: str,
    watched: Sequence[Watched],
    *,
    as_json: bool = False,
    counts: Callable[[Arrival], bool] = lambda arrival: True,
) -> None:
    """Print the statistics of topics every second until Ctrl-C, and once more then."""

    def show(*, final: bool) -> None:
        if as_json:
            for each in watched:
                click.echo(each.json())
        else:
            click.echo(report(watched, final=final))

    stop = Stop()
    by_topic = {each.topic: each for each in watched}
    receptions = Receptions(bus, by_topic, counts)
    router = RouterWatch(bus.session, connect)
    due_s = time.monotonic() + REPORT_S
    while not stop.asked:
        reception = receptions.take(TICK_S)
        if reception is None:
            router.check()
        else:
            by_topic[reception.topic].add(reception)

        now_s = time.monotonic()
        if now_s >= due_s:
            show(final=False)
            due_s = max(due_s + REPORT_S, now_s)

    show(final=True)


def counting(condition: str | None, watched: Sequence[Topic]) -> Callable[[Arrival], bool]:
    """Make a function that decides whether an arrival counts. Raises UsageError."""
    if condition is None:
        return lambda arrival: True
    if len(watched) != 1:
        raise UsageError("--filter is for the messages of one topic: name it alone")

    wanted = parsed(condition, watched[0])
    intake = Intake()

    def counts(arrival: Arrival) -> bool:
        message = intake.accept(arrival)
        return message is not None and wanted.holds(message)

    return counts


@click.command()
@watch_options(window=10_000)
@filter_option
def hz(
    names: tuple[str, ...],
    everything: bool,
    window: int,
    as_json: bool,
    condition: str | None,
    connect: str,
    agent: str,
) -> None:
    """Measure how often messages arrive."""
    found = chosen(names, everything)
    counts = counting(condition, found)
    watched = [Watched(topic, Rate(window)) for topic in found]
    with observing(connect, agent, "topic-hz") as bus:
        watch(bus, connect, watched, as_json=as_json, counts=counts)


@click.command()
@watch_options(window=100)
def bw(
    names: tuple[str, ...], everything: bool, window: int, as_json: bool, connect: str, agent: str
) -> None:
    """Measure how many bytes a second arrive."""
    watched = [Watched(topic, Bandwidth(window)) for topic in chosen(names, everything)]
    with observing(connect, agent, "topic-bw") as bus:
        watch(bus, connect, watched, as_json=as_json)


@click.command()
@watch_options(window=10_000)
def delay(
    names: tuple[str, ...], everything: bool, window: int, as_json: bool, connect: str, agent: str
) -> None:
    """Measure how old messages are, from the sensing to here, and where the time went."""
    watched = [Watched(topic, Delay(window)) for topic in chosen(names, everything)]
    with observing(connect, agent, "topic-delay") as bus:
        watch(bus, connect, watched, as_json=as_json)
