"""`cogmap topic hz`, `bw` and `delay`: metrics every second until Ctrl-C, and once more then."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any, TypeVar

import click

from cogmap.cli.options import agent_option, connect_option, json_option
from cogmap.cli.topic.argument import streamed_argument
from cogmap.cli.topic.metrics import BandwidthMetrics, DelayMetrics, Metrics, RateMetrics
from cogmap.cli.topic.observing import TICK_S, Reception, Receptions, RouterWatch, observing
from cogmap.runtime.process import Stop
from cogmap.schemas.topics import Topic

REPORT_S = 1.0
F = TypeVar("F", bound=Callable[..., Any])


def window_option(default: int) -> Callable[[F], F]:
    """How many messages the metrics are over."""
    return click.option(
        "-w",
        "--window",
        type=click.IntRange(min=2),
        default=default,
        show_default=True,
        help="Over this many messages.",
    )


def watch(
    connect: str, agent: str, what: str, topic: Topic, metrics: Metrics, as_json: bool
) -> None:
    """Print the metrics of `topic` every second until asked to stop, and once more then."""
    stop = Stop()
    report = _Report(topic, metrics, as_json)
    with observing(connect, agent, f"topic-{what}") as bus:
        receptions = Receptions(bus, topic)
        router = RouterWatch(bus.session, connect)
        due_s = time.monotonic() + REPORT_S
        while not stop.asked:
            reception = receptions.take(TICK_S)
            if reception is None:
                router.check()
            else:
                report.add(reception)

            now_s = time.monotonic()
            if now_s >= due_s:
                report.print()
                due_s = max(due_s + REPORT_S, now_s)

        report.print(final=True)


class _Report:
    """Prints metrics, or that no message has arrived since it last printed."""

    def __init__(self, topic: Topic, metrics: Metrics, as_json: bool) -> None:
        self._topic = topic
        self._metrics = metrics
        self._as_json = as_json
        self._messages = 0
        self._printed_messages = 0

    def add(self, reception: Reception) -> None:
        """Count one message."""
        self._metrics.add(reception)
        self._messages += 1

    def print(self, final: bool = False) -> None:
        """Print the metrics so far; the final ones also where nothing is new."""
        if self._as_json:
            click.echo(self._json())
        else:
            click.echo(self._text(final))
        self._printed_messages = self._messages

    def _json(self) -> str:
        facts = {"topic": self._topic.name, "messages": self._messages}
        return json.dumps(facts | self._metrics.plain())

    def _text(self, final: bool) -> str:
        is_new = self._messages > self._printed_messages
        text = self._metrics.text() if is_new or final else ""
        return text or f"no new messages of {self._topic.name}"


@click.command()
@streamed_argument
@window_option(10_000)
@json_option
@connect_option
@agent_option
def hz(topic: Topic, window: int, as_json: bool, connect: str, agent: str) -> None:
    """Measure how often messages arrive."""
    watch(connect, agent, "hz", topic, RateMetrics(window), as_json)


@click.command()
@streamed_argument
@window_option(100)
@json_option
@connect_option
@agent_option
def bw(topic: Topic, window: int, as_json: bool, connect: str, agent: str) -> None:
    """Measure how many bytes arrive in a second."""
    watch(connect, agent, "bw", topic, BandwidthMetrics(window), as_json)


@click.command()
@streamed_argument
@window_option(10_000)
@json_option
@connect_option
@agent_option
def delay(topic: Topic, window: int, as_json: bool, connect: str, agent: str) -> None:
    """Measure how old messages are, from the sensing to here, and where the time went."""
    watch(connect, agent, "delay", topic, DelayMetrics(window), as_json)
