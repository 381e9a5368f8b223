"""`cogmap topic pub`: publishes a message."""

from __future__ import annotations

import time

import click
import msgspec

from cogmap.bus.codec import Envelope, decode, encode
from cogmap.bus.interface import Bus
from cogmap.cli.options import FiniteRange
from cogmap.cli.topic.argument import streamed_argument
from cogmap.cli.topic.observing import CLI, RouterWatch, observing
from cogmap.cli.topic.parse import parse
from cogmap.errors import MessageError, UsageError
from cogmap.runtime.process import Stop
from cogmap.runtime.program import agent_option, connect_option
from cogmap.schemas.base import Message
from cogmap.schemas.topics import Topic


@click.command()
@streamed_argument
@click.argument("message", default="{}")
@click.option(
    "-r",
    "--rate",
    type=FiniteRange(min=0, min_open=True),
    default=1.0,
    show_default=True,
    help="How often a second.",
)
@click.option("-1", "--once", is_flag=True, help="Publish once and end.")
@click.option("-t", "--times", type=click.IntRange(min=1), help="Publish this many times and end.")
@connect_option
@agent_option
def pub(
    topic: Topic, message: str, rate: float, once: bool, times: int | None, connect: str, agent: str
) -> None:
    """Publish MESSAGE, written in JSON or YAML, again and again until Ctrl-C."""
    parsed = parse(topic, message)
    try:
        decode(topic, encode(parsed))  # as a subscriber does, who rejects what is out of range
    except MessageError as error:
        raise UsageError(str(error)) from None

    limit = 1 if once else times
    with observing(connect, agent, "topic-pub") as bus:
        stop = Stop()
        router = RouterWatch(bus.session, connect)
        publisher = Publisher(bus, topic, parsed)
        due_s = time.monotonic()
        while not stop.asked:
            publisher.publish()
            click.echo(f"publishing #{publisher.number}: {parsed}")
            if publisher.number == limit:
                break

            due_s += 1 / rate
            stop.wait(max(0.0, due_s - time.monotonic()))
            router.check()


class Publisher:
    """Publishes one message again and again, each time with the next number."""

    def __init__(self, bus: Bus, topic: Topic, message: Message) -> None:
        self.number = 0
        self._bus = bus
        self._topic = topic
        self._message = message
        self._incarnation = time.time_ns()
        bus.declare(topic)

    def publish(self) -> None:
        """Publish it once more."""
        message = msgspec.structs.replace(self._message, source=CLI, seq=self.number)
        now_ns = time.time_ns()
        envelope = Envelope(CLI, self.number, self._incarnation, now_ns, now_ns)
        self._bus.publish(self._topic, encode(message), envelope)
        self.number += 1
