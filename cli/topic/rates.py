"""`cogmap topic hz`, `bw` and `delay`: a line a second until Ctrl-C, which ends with the figures so
far.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any, TypeVar

import click

from cli.options import agent_option, connect_option, json_option
from cli.topic.argument import streamed_argument
from cli.topic.metrics import BandwidthFigures, DelayFigures, Figures, RateFigures
from cli.topic.observing import TICK_S, Sights, observing
from cogmap.runtime.process import Stop
from schemas.topics import Topic

REPORT_S = 1.0
F = TypeVar("F", bound=Callable[..., Any])


def window_option(default: int) -> Callable[[F], F]:
    """How many messages the figures are about."""
    return click.option(
        "-w",
        "--window",
        type=click.IntRange(min=2),
        default=default,
        show_default=True,
        help="Over so many messages.",
    )


def watch(
    connect: str, agent: str, what: str, topic: Topic, figures: Figures, as_json: bool
) -> None:
    """Print the figures of `topic` every second until asked to stop, and once more then."""
    stop = Stop()
    with observing(connect, agent, f"topic {what}") as bus:
        sights = Sights(bus, topic)
        report_at_s = time.monotonic() + REPORT_S
        number = reported = 0
        while not stop.asked:
            if (sight := sights.take(TICK_S)) is not None:
                figures.add(sight)
                number += 1
            if time.monotonic() >= report_at_s:
                report_at_s = max(report_at_s + REPORT_S, time.monotonic())
                _print(figures, topic, number, as_json, number > reported)
                reported = number
        _print(figures, topic, number, as_json, True)


def _print(figures: Figures, topic: Topic, number: int, as_json: bool, fresh: bool) -> None:
    if as_json:
        click.echo(json.dumps({"topic": topic.name, "messages": number, **figures.plain()}))
    else:
        click.echo(
            figures.text() if fresh and figures.text() else f"no new messages of {topic.name}"
        )


@click.command()
@streamed_argument
@window_option(10_000)
@json_option
@connect_option
@agent_option
def hz(topic: Topic, window: int, as_json: bool, connect: str, agent: str) -> None:
    """How often messages come."""
    watch(connect, agent, "hz", topic, RateFigures(window), as_json)


@click.command()
@streamed_argument
@window_option(100)
@json_option
@connect_option
@agent_option
def bw(topic: Topic, window: int, as_json: bool, connect: str, agent: str) -> None:
    """How many bytes come in a second."""
    watch(connect, agent, "bw", topic, BandwidthFigures(window), as_json)


@click.command()
@streamed_argument
@window_option(10_000)
@json_option
@connect_option
@agent_option
def delay(topic: Topic, window: int, as_json: bool, connect: str, agent: str) -> None:
    """How old messages are when they come, counted from the sensing, and where the time went."""
    watch(connect, agent, "delay", topic, DelayFigures(window), as_json)
