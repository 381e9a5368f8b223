"""`cogmap topic hz`, `bw` and `delay`: statistics every second until Ctrl-C, and once more then."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any, TypeVar

import click

from cogmap.cli.options import json_option
from cogmap.cli.topic.argument import streamed_argument
from cogmap.cli.topic.observing import TICK_S, Receptions, RouterWatch, observing
from cogmap.cli.topic.statistics import Bandwidth, Delay, Rate, Statistics
from cogmap.runtime.process import Stop
from cogmap.runtime.program import agent_option, connect_option
from cogmap.schemas.topics import Topic

REPORT_S = 1.0
F = TypeVar("F", bound=Callable[..., Any])


def window_option(default: int) -> Callable[[F], F]:
    """Make the option for how many messages the statistics are over."""
    return click.option(
        "-w",
        "--window",
        type=click.IntRange(min=2),
        default=default,
        show_default=True,
        help="Compute over this many last messages.",
    )


def watch(
    connect: str, agent: str, verb: str, topic: Topic, statistics: Statistics, as_json: bool
) -> None:
    """Print the statistics of `topic` every second until Ctrl-C, and once more then."""
    messages = 0
    printed_messages = 0

    def report(final: bool) -> None:
        if as_json:
            facts = {"topic": topic.name, "messages": messages}
            click.echo(json.dumps(facts | statistics.plain()))
        elif 0 < messages < statistics.min_messages:
            click.echo(f"one message of {topic.name}: two are needed")
        else:
            is_new = final or messages > printed_messages
            text = statistics.text() if is_new else ""
            click.echo(text or f"no new messages of {topic.name}")

    with observing(connect, agent, f"topic-{verb}") as bus:
        stop = Stop()
        receptions = Receptions(bus, topic)
        router = RouterWatch(bus.session, connect)
        due_s = time.monotonic() + REPORT_S
        while not stop.asked:
            reception = receptions.take(TICK_S)
            if reception is None:
                router.check()
            else:
                statistics.add(reception)
                messages += 1

            now_s = time.monotonic()
            if now_s >= due_s:
                report(final=False)
                printed_messages = messages
                due_s = max(due_s + REPORT_S, now_s)

        report(final=True)


@click.command()
@streamed_argument
@window_option(10_000)
@json_option
@connect_option
@agent_option
def hz(topic: Topic, window: int, as_json: bool, connect: str, agent: str) -> None:
    """Measure how often messages arrive."""
    watch(connect, agent, "hz", topic, Rate(window), as_json)


@click.command()
@streamed_argument
@window_option(100)
@json_option
@connect_option
@agent_option
def bw(topic: Topic, window: int, as_json: bool, connect: str, agent: str) -> None:
    """Measure how many bytes a second arrive."""
    watch(connect, agent, "bw", topic, Bandwidth(window), as_json)


@click.command()
@streamed_argument
@window_option(10_000)
@json_option
@connect_option
@agent_option
def delay(topic: Topic, window: int, as_json: bool, connect: str, agent: str) -> None:
    """Measure how old messages are, from the sensing to here, and where the time went."""
    watch(connect, agent, "delay", topic, Delay(window), as_json)
