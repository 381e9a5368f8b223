"""Follows a running system, for viewers of other projects."""

from __future__ import annotations

import time
from collections.abc import Callable

import click

from cogmap.bus.interface import Arrival, Bus
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.cli.topic.observing import TICK_S, RouterWatch
from cogmap.errors import LogError
from cogmap.graph.replica import Replica, snapshot_over
from cogmap.recording.exporting.moments import OF_MIND, Drive, Moment
from cogmap.recording.log import Entry
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.intake import Intake
from cogmap.runtime.delivery.plausibility import Plausibility
from cogmap.runtime.process import Stop, give_way
from cogmap.schemas.base import Message
from cogmap.schemas.topics import Topic

VIEW = "view"


class Following:
    """What there is to show of the system on `bus`: the messages of `senses`, and what the agent
    believes, says and knows.
    """

    def __init__(self, bus: Bus, senses: tuple[Topic, ...]) -> None:
        self._inbox = Inbox()
        self._intake = Intake(Plausibility())
        self._begin_ns = time.time_ns()
        replica = Replica(snapshot_over(bus))
        self._drive = Drive(replica.graph, replica.follow)
        for topic in (*senses, *OF_MIND):
            bus.subscribe(topic, self._inbox.put, self._intake.count_lost)
        replica.join()

    def show_next(self, timeout_s: float, show: Callable[[Moment], None]) -> bool:
        """Show what there is to show of the next message. Returns whether one came in time.

        One that cannot be shown, such as a view whose image is none, is rejected.
        """
        arrival = self._inbox.take(timeout_s)
        if not isinstance(arrival, Arrival):
            return False

        message = self._intake.accept(arrival)
        if message is None:
            return True
        try:
            for moment in self._drive.shown(self._entry(arrival, message)):
                show(moment)
        except LogError as error:
            self._intake.reject(arrival.topic.name, str(error))
        return True

    def counts(self) -> str:
        """Count the messages that were shown, and those that were not, by reason."""
        return (
            f"{self._intake.received.total()} messages, {self._intake.rejected.total()} rejected, "
            f"{self._intake.gaps.total()} lost, {self._inbox.superseded.total()} superseded by "
            "newer ones"
        )

    def _entry(self, arrival: Arrival, message: Message) -> Entry:
        return Entry(
            topic=arrival.topic.name,
            message=message,
            time_s=(arrival.received_ns - self._begin_ns) / 1e9,
            log_time_ns=arrival.received_ns,
            envelope=arrival.envelope,
        )


def follow(
    bus: ZenohBus, endpoint: str, senses: tuple[Topic, ...], show: Callable[[Moment], None]
) -> None:
    """Show what happens on `bus` until Ctrl-C, and print how much there was.

    Raises NoRouterError if the router at `endpoint` is gone for long.
    """
    give_way()
    stop = Stop()
    following = Following(bus, senses)
    router = RouterWatch(bus.session, endpoint)
    while not stop.asked:
        router.check()
        following.show_next(TICK_S, show)
    click.echo(following.counts(), err=True)
