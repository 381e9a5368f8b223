"""`cogmap time`: lets the time of a simulation or a recording stand and pass."""

from __future__ import annotations

import time

import click

from cogmap.bus.interface import Arrival, Bus
from cogmap.cli.topic.observing import observing
from cogmap.cli.topic.publishing import Publisher
from cogmap.errors import NoAnswerError
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.intake import Intake
from cogmap.runtime.program import agent_option, connect_option
from cogmap.schemas import topics
from cogmap.schemas.process import Pause, Paused

ANSWER_S = 10.0
"""Time for an answer; on a busy machine it takes a few seconds."""

TRY_S = 1.0
"""Time for an answer after which it is asked again: nobody may have subscribed yet."""


@click.group(name="time")
def time_() -> None:
    """Let the time of the simulation stand and pass, or that of the recording that is played.

    While it stands, nothing is sensed and the robot does not move.
    """


@time_.command()
@connect_option
@agent_option
def pause(connect: str, agent: str) -> None:
    """Let time stand."""
    with observing(connect, agent, "time") as bus:
        ask(bus, Pause(is_paused=True), ANSWER_S)
    click.echo("time stands: `cogmap time resume` lets it pass")


@time_.command()
@connect_option
@agent_option
def resume(connect: str, agent: str) -> None:
    """Let time pass again."""
    with observing(connect, agent, "time") as bus:
        ask(bus, Pause(is_paused=False), ANSWER_S)
    click.echo("time passes")


@time_.command()
@click.argument("views", type=click.IntRange(1, 1_000_000), default=1)
@connect_option
@agent_option
def step(views: int, connect: str, agent: str) -> None:
    """Let time pass until so many more VIEWS have been sensed, then stand."""
    with observing(connect, agent, "time") as bus:
        # What is asked again would be done again: by then whoever answers is known to listen.
        ask(bus, Pause(is_paused=True), ANSWER_S)
        ask(bus, Pause(is_paused=True, views=views), ANSWER_S, try_s=ANSWER_S)
    click.echo(f"views to come: {views}; then time stands")


def ask(bus: Bus, pause: Pause, timeout_s: float, try_s: float = TRY_S) -> None:
    """Publish `pause`, every `try_s` again, until time is said to be as asked. Raises
    NoAnswerError if that takes longer than `timeout_s`.
    """
    inbox = Inbox()
    intake = Intake()
    bus.subscribe(topics.PAUSED, inbox.put, intake.count_lost)
    publisher = Publisher(bus, topics.PAUSE)
    until_s = time.monotonic() + timeout_s
    while time.monotonic() < until_s:
        publisher.publish(pause)
        if _is_said(inbox, intake, pause.is_paused, min(try_s, timeout_s)):
            return
    raise NoAnswerError(
        f"nobody whose time could stand answered within {timeout_s:g} s: start a simulation or a "
        "recording with `cogmap run`"
    )


def _is_said(inbox: Inbox, intake: Intake, is_paused: bool, timeout_s: float) -> bool:
    """Wait until it is said that time stands, or passes; False if nobody does."""
    until_s = time.monotonic() + timeout_s
    while (left_s := until_s - time.monotonic()) > 0:
        arrival = inbox.take(left_s)
        said = intake.accept(arrival) if isinstance(arrival, Arrival) else None
        if isinstance(said, Paused) and said.is_paused == is_paused:
            return True
    return False
