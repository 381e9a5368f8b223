"""`cogmap street`: closes streets of the simulated town, and opens them."""

from __future__ import annotations

import time

import click

from cogmap.bus.interface import Arrival
from cogmap.cli.options import agent_option, connect_option
from cogmap.cli.topic.observing import observing
from cogmap.cli.topic.pub import Publisher
from cogmap.errors import NoAnswerError
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.intake import Intake
from cogmap.schemas import topics
from cogmap.schemas.sensing import StreetClosure, TrueTown

ANSWER_S = 10
"""Time for the simulation to publish the town; on a busy machine it takes a few seconds."""

name_argument = click.argument("name")


@click.group()
def street() -> None:
    """Close streets of the simulated town, and open them.

    A closed street has a barrier across it, which the agent has to see: nothing else informs it.
    `cogmap topic echo --once truth/town` shows the names, such as "Elm Street 2".
    """


@street.command()
@name_argument
@connect_option
@agent_option
def close(name: str, connect: str, agent: str) -> None:
    """Close the street NAME by a barrier."""
    change(StreetClosure(street=name, closed=True), connect, agent)


@street.command("open")
@name_argument
@connect_option
@agent_option
def open_(name: str, connect: str, agent: str) -> None:
    """Open the street NAME: remove the barrier."""
    change(StreetClosure(street=name, closed=False), connect, agent)


def change(closure: StreetClosure, connect: str, agent: str) -> None:
    """Publish `closure` until the town is published as it should be. Raises NoAnswerError."""
    done = "closed" if closure.closed else "open"
    inbox = Inbox()
    intake = Intake()
    with observing(connect, agent, "street") as bus:
        bus.subscribe(topics.TRUE_TOWN, inbox.put, intake.count_lost)
        publisher = Publisher(bus, topics.STREET_CLOSURE, closure)
        for _ in range(ANSWER_S):  # the simulation may not have subscribed yet
            publisher.publish()
            if _is_shown(closure, inbox, intake):
                click.echo(f"{closure.street} is {done}")
                return

    raise NoAnswerError(
        f"no street {closure.street!r} was {done} within {ANSWER_S} s: see that the simulation "
        "runs, and for the names `cogmap topic echo --once truth/town`"
    )


def _is_shown(closure: StreetClosure, inbox: Inbox, intake: Intake) -> bool:
    """Decide whether a town that is published within a second shows the street as asked."""
    until_s = time.monotonic() + 1.0
    while (left_s := until_s - time.monotonic()) > 0:
        arrival = inbox.take(left_s)
        town = intake.accept(arrival) if isinstance(arrival, Arrival) else None
        if isinstance(town, TrueTown) and is_as_asked(town, closure):
            return True
    return False


def is_as_asked(town: TrueTown, closure: StreetClosure) -> bool:
    """Decide whether a town has the street, closed or open as asked."""
    return any(
        street.name == closure.street and street.closed == closure.closed for street in town.streets
    )
