"""`cogmap topic pub`: says a message on a topic."""

from __future__ import annotations

import time

import click

from cli.options import agent_option, connect_option
from cli.topic.argument import streamed_argument
from cli.topic.observing import CLI, observing
from cli.topic.parse import parse
from cogmap.bus.codec import Envelope, decode, encode
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.errors import MessageError, UsageError
from cogmap.runtime.process import Stop
from schemas.base import Message
from schemas.topics import Topic


@click.command()
@streamed_argument
@click.argument("message", default="{}")
@click.option(
    "-r",
    "--rate",
    type=click.FloatRange(min=0, min_open=True),
    default=1.0,
    show_default=True,
    help="Hz.",
)
@click.option("-1", "--once", is_flag=True, help="Publish once and end.")
@click.option("-t", "--times", type=click.IntRange(min=1), help="Publish so many times and end.")
@connect_option
@agent_option
def pub(
    topic: Topic, message: str, rate: float, once: bool, times: int | None, connect: str, agent: str
) -> None:
    """Publish MESSAGE, written in JSON or YAML, until Ctrl-C."""
    said = parse(topic, message)
    _check(topic, said)
    stop = Stop()
    speaker = Speaker(topic, said)
    limit = 1 if once else times
    with observing(connect, agent, "topic pub") as bus:
        bus.declare(topic)
        due_s = time.monotonic()
        while not stop.asked and speaker.number != limit:
            speaker.say(bus)
            click.echo(f"publishing #{speaker.number}: {said}")
            due_s += 1 / rate
            if speaker.number != limit:
                stop.wait(max(0.0, due_s - time.monotonic()))


def _check(topic: Topic, message: Message) -> None:
    """Raise UsageError where a subscriber would refuse `message`."""
    try:
        decode(topic, encode(message))
    except MessageError as error:
        raise UsageError(str(error)) from None


class Speaker:
    """Numbers a message anew each time that it is said, and puts the command line's name on it."""

    def __init__(self, topic: Topic, message: Message) -> None:
        self.number = 0
        self._topic = topic
        self._message = message
        self._incarnation = time.time_ns()
        message.source = CLI

    def say(self, bus: ZenohBus) -> None:
        """Publish it once more."""
        self._message.seq = self.number
        now_ns = time.time_ns()
        envelope = Envelope(CLI, self.number, self._incarnation, now_ns, now_ns)
        bus.publish(self._topic, encode(self._message), envelope)
        self.number += 1
