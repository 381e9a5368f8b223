"""`cogmap street`: closes streets of the simulated town, and opens them."""

from __future__ import annotations

import time

import click

from cogmap.bus.interface import Arrival
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.cli.options import agent_option, connect_option
from cogmap.cli.topic.observing import observing
from cogmap.cli.topic.pub import Publisher
from cogmap.errors import NoAnswerError
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.intake import Intake
from cogmap.schemas import topics
from cogmap.schemas.sensing import StreetClosure, TrueTown

ANSWER_S = 10

name_argument = click.argument("name")


@click.group()
def street() -> None:
    """Close streets of the simulated town, and open them.

    A barrier then stands across the street, and the agent has to see it: nothing else informs it.
    The names are those in `truth/town`, such as "Elm Street 2".
    """


@street.command()
@name_argument
@connect_option
@agent_option
def close(name: str, connect: str, agent: str) -> None:
    """Put a barrier across the street NAME."""
    _change(StreetClosure(street=name, closed=True), connect, agent)


@street.command("open")
@name_argument
@connect_option
@agent_option
def open_(name: str, connect: str, agent: str) -> None:
    """Take the barrier away from the street NAME."""
    _change(StreetClosure(street=name, closed=False), connect, agent)


def _change(closure: StreetClosure, connect: str, agent: str) -> None:
    """Publish `closure` until the town is published as it should be. Raises NoAnswerError."""
    with observing(connect, agent, "street") as bus:
        towns = _Towns(bus)
        publisher = Publisher(bus, topics.STREET_CLOSURE, closure)
        if not _is_answered(publisher, towns, closure):
            raise NoAnswerError(
                f"no street {closure.street!r} was {_done(closure)} within {ANSWER_S} s: see that "
                f"the simulation runs, and for the names `cogmap topic echo --once truth/town`"
            )

    click.echo(f"{closure.street} is {_done(closure)}")


def _is_answered(publisher: Publisher, towns: _Towns, closure: StreetClosure) -> bool:
    """Publish once a second, as the simulation may not have subscribed yet; whether the town
    changes.
    """
    for _ in range(ANSWER_S):
        publisher.publish()
        if towns.show(closure, 1.0):
            return True

    return False


def _done(closure: StreetClosure) -> str:
    return "closed" if closure.closed else "open"


class _Towns:
    """The towns that the simulation publishes from now on."""

    def __init__(self, bus: ZenohBus) -> None:
        self._inbox = Inbox()
        self._intake = Intake()
        bus.subscribe(topics.TRUE_TOWN, self._inbox.put, self._intake.count_lost)

    def show(self, closure: StreetClosure, timeout_s: float) -> bool:
        """Whether one of them shows the street as it should be, within `timeout_s`."""
        until_s = time.monotonic() + timeout_s
        while (left_s := until_s - time.monotonic()) > 0:
            arrival = self._inbox.take(left_s)
            if not isinstance(arrival, Arrival):
                continue

            town = self._intake.accept(arrival)
            if isinstance(town, TrueTown) and is_as_asked(town, closure):
                return True

        return False


def is_as_asked(town: TrueTown, closure: StreetClosure) -> bool:
    """Whether a town has the street, closed or open as asked."""
    for each in town.streets:
        if each.name == closure.street:
            return each.closed == closure.closed

    return False
