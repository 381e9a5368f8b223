"""`cogmap street`: lists the streets of the simulated town, closes and opens them."""

from __future__ import annotations

import time
from contextlib import suppress

import click

from cogmap.bus.access.subjects import ACTS
from cogmap.bus.interface import Arrival, Bus
from cogmap.cli.options import json_option
from cogmap.cli.printing import print_json
from cogmap.cli.topic.observing import observing
from cogmap.cli.topic.publishing import Publisher
from cogmap.errors import NoAnswerError, UsageError
from cogmap.hints import did_you_mean
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.intake import Intake
from cogmap.runtime.program import agent_option, connect_option
from cogmap.schemas import topics
from cogmap.schemas.sensing import StreetClosure, TrueTown

ANSWER_S = 10.0
"""Time for the simulation to publish the town; on a busy machine it takes a few seconds."""

TRY_S = 1.0
"""Time for it to act on a message, before that is sent again: it may not have subscribed yet."""

name_argument = click.argument("name")


@click.group()
def street() -> None:
    """List the streets of the simulated town, close and open them.

    A closed street has a barrier across it, which the agent has to see: nothing else informs it.
    """


@street.command("list")
@json_option
@connect_option
@agent_option
def list_(as_json: bool, connect: str, agent: str) -> None:
    """List the streets of the town, and those that are closed."""
    with observing(connect, agent, "street") as bus:
        town = Towns(bus).next(ANSWER_S)
    closed = {street.name: street.closed for street in town.streets}
    if as_json:
        print_json(closed)
        return

    # A street that bends is listed once.
    for name, is_closed in closed.items():
        click.echo(f"{name}{': closed' if is_closed else ''}")


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


class Towns:
    """The towns that the simulation publishes. Raises NoAnswerError if none comes."""

    def __init__(self, bus: Bus) -> None:
        self._inbox = Inbox()
        self._intake = Intake()
        bus.subscribe(topics.TRUE_TOWN, self._inbox.put, self._intake.count_lost)

    def next(self, timeout_s: float) -> TrueTown:
        """Wait for the next one."""
        until_s = time.monotonic() + timeout_s
        while (left_s := until_s - time.monotonic()) > 0:
            arrival = self._inbox.take(left_s)
            town = self._intake.accept(arrival) if isinstance(arrival, Arrival) else None
            if isinstance(town, TrueTown):
                return town
        raise NoAnswerError(
            f"no simulation published its town within {timeout_s:g} s: start one with `cogmap run`"
        )


def change(closure: StreetClosure, connect: str, agent: str) -> None:
    """Publish `closure` until the town is published as it should be. Raises UsageError for a street
    that the town does not have, and NoAnswerError.
    """
    done = "closed" if closure.closed else "open"
    with observing(connect, agent, "street", ACTS) as bus:
        towns = Towns(bus)
        check_known(towns.next(ANSWER_S), closure.street)
        publisher = Publisher(bus, topics.STREET_CLOSURE)
        until_s = time.monotonic() + ANSWER_S
        while time.monotonic() < until_s:
            publisher.publish(closure)
            with suppress(NoAnswerError):
                if is_as_asked(towns.next(TRY_S), closure):
                    click.echo(f"{closure.street} is {done}")
                    return

    raise NoAnswerError(
        f"{closure.street} was not {done} within {ANSWER_S:g} s: `cogmap doctor` finds the reason"
    )


def check_known(town: TrueTown, name: str) -> None:
    """Raise UsageError if a town has no street of that name, with the one that may be meant."""
    names = [street.name for street in town.streets]
    if name not in names:
        meant = did_you_mean(name, names, "`cogmap street list` names them")
        raise UsageError(f"the town has no street {name!r}: {meant}")


def is_as_asked(town: TrueTown, closure: StreetClosure) -> bool:
    """Decide whether a town has the street, closed or open as asked."""
    return any(
        street.name == closure.street and street.closed == closure.closed for street in town.streets
    )
