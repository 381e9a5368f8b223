"""`cogmap time`: lets simulated time stand and pass, and the robot begin where it began."""

from __future__ import annotations

import time

import click

from cogmap.bus.access.subjects import ACTS
from cogmap.bus.interface import Arrival, Bus
from cogmap.cli.topic.observing import observing
from cogmap.cli.topic.publishing import Publisher
from cogmap.errors import NoAnswerError
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.intake import Intake
from cogmap.runtime.program import agent_option, connect_option
from cogmap.schemas import topics
from cogmap.schemas.process import Pause, Paused
from cogmap.schemas.sensing import Reset, TruePose

ANSWER_S = 10.0
"""Time for an answer; on a busy machine it takes a few seconds."""

TRY_S = 1.0
"""Time for an answer after which it is asked again: nobody may have subscribed yet."""


@click.group(name="time")
def time_() -> None:
    """Let the time of the simulation stand and pass, or that of the recording that is played.

    While it stands, nothing is sensed and the robot does not move. `reset` carries the robot of a
    simulation back to its start.
    """


@time_.command()
@connect_option
@agent_option
def pause(connect: str, agent: str) -> None:
    """Let time stand."""
    with observing(connect, agent, "time", ACTS) as bus:
        ask(bus, Pause(is_paused=True), ANSWER_S)
    click.echo("time stands: `cogmap time resume` lets it pass")


@time_.command()
@connect_option
@agent_option
def resume(connect: str, agent: str) -> None:
    """Let time pass again."""
    with observing(connect, agent, "time", ACTS) as bus:
        ask(bus, Pause(is_paused=False), ANSWER_S)
    click.echo("time passes")


@time_.command()
@click.argument("views", type=click.IntRange(1, 1_000_000), default=1)
@connect_option
@agent_option
def step(views: int, connect: str, agent: str) -> None:
    """Let time pass until so many more VIEWS have been sensed, then stand."""
    with observing(connect, agent, "time", ACTS) as bus:
        # What is asked again would be done again: by then whoever answers is known to listen.
        ask(bus, Pause(is_paused=True), ANSWER_S)
        ask(bus, Pause(is_paused=True, views=views), ANSWER_S, try_s=ANSWER_S)
    click.echo(f"views to come: {views}; then time stands")


@time_.command()
@connect_option
@agent_option
def reset(connect: str, agent: str) -> None:
    """Carry the robot of a simulation back to its start.

    Time goes on, and the agent keeps what it knows. Nothing tells it of this but its senses.
    """
    with observing(connect, agent, "time", ACTS) as bus:
        times = carry(bus, ANSWER_S)
    click.echo(f"the robot is at its start again; so often by now: {times}")


def carry(bus: Bus, timeout_s: float) -> int:
    """Let the robot be carried back to its start; return how often it was by then. Raises
    NoAnswerError if no simulation says within `timeout_s` that it is there.
    """
    inbox = Inbox()
    intake = Intake()
    bus.subscribe(topics.TRUE_POSE, inbox.put, intake.count_lost)
    # While time stands no pose comes, and none is on its way.
    known = max(0, _resets(inbox, intake, TRY_S, least=0))
    publisher = Publisher(bus, topics.RESET)
    until_s = time.monotonic() + timeout_s
    while time.monotonic() < until_s:
        publisher.publish(Reset())
        newest = _resets(inbox, intake, min(TRY_S, timeout_s), least=known + 1)
        if newest > known:
            return newest

    raise NoAnswerError(
        f"no simulation carried its robot back within {timeout_s:g} s: start one with "
        "`cogmap run`; a recording and a trajectory have no way back"
    )


def _resets(inbox: Inbox, intake: Intake, timeout_s: float, least: int) -> int:
    """Wait for a true pose after `least` resets; return how many there were by the newest one, -1
    if there came none.
    """
    newest = -1
    until_s = time.monotonic() + timeout_s
    while newest < least and (left_s := until_s - time.monotonic()) > 0:
        arrival = inbox.take(left_s)
        pose = intake.accept(arrival) if isinstance(arrival, Arrival) else None
        if isinstance(pose, TruePose):
            newest = pose.resets or 0
    return newest


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
