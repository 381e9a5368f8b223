"""`cogmap topic echo`: prints messages as they arrive."""

from __future__ import annotations

import time

import click

from cogmap.bus.interface import Arrival
from cogmap.cli.messages.condition import Condition, filter_option, parsed
from cogmap.cli.messages.style import Form, Style, style_options
from cogmap.cli.options import FiniteRange
from cogmap.cli.topic.argument import streamed_argument
from cogmap.cli.topic.observing import TICK_S, RouterWatch, observing
from cogmap.errors import NoAnswerError
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.intake import Intake
from cogmap.runtime.process import Stop
from cogmap.runtime.program import agent_option, connect_option
from cogmap.schemas.base import Message
from cogmap.schemas.topics import Topic

DOCUMENT_END = "---"
_EPILOG = """\b
Examples:
  cogmap topic echo truth/pose --field pose.x_m --field pose.y_m --csv
  cogmap topic echo motor/command --filter "halted_by == obstacle"
  cogmap topic echo action/selected --once --timeout 10
"""


@click.command(epilog=_EPILOG)
@streamed_argument
@click.option("--once", is_flag=True, help="End after one message.")
@click.option("-n", "--times", type=click.IntRange(min=1), help="End after this many messages.")
@filter_option
@style_options
@click.option("--clear", is_flag=True, help="Clear the screen before each message.")
@click.option(
    "--timeout",
    "timeout_s",
    type=FiniteRange(min=0, min_open=True),
    metavar="SECONDS",
    help="End with 1 if for so long there is nothing to print.",
)
@connect_option
@agent_option
def echo(
    topic: Topic,
    once: bool,
    times: int | None,
    condition: str | None,
    style: Style,
    clear: bool,
    timeout_s: float | None,
    connect: str,
    agent: str,
) -> None:
    """Print messages until Ctrl-C."""
    wanted = parsed(condition, topic)
    with observing(connect, agent, "topic-echo") as bus:
        stop = Stop()
        messages = ValidMessages(topic, wanted)
        bus.subscribe(topic, messages.inbox.put, messages.intake.count_lost)
        router = RouterWatch(bus.session, connect)
        limit = 1 if once else times
        last_s = time.monotonic()
        while not stop.asked and messages.number != limit:
            found = messages.take(TICK_S)
            if found is None:
                router.check()
                if timeout_s is not None and time.monotonic() - last_s > timeout_s:
                    raise NoAnswerError(f"no message of {topic.name} to print in {timeout_s:g} s")
                continue

            if clear:
                click.clear()
            click.echo(style.text(*found))
            if style.form in (Form.TEXT, Form.FLOW):
                click.echo(DOCUMENT_END)
            last_s = time.monotonic()

    if stop.asked:
        click.echo(messages.counts(), err=True)


class ValidMessages:
    """The valid messages of `topic` for which `condition` holds, and counts of the others."""

    def __init__(self, topic: Topic, condition: Condition) -> None:
        self.inbox = Inbox()
        self.intake = Intake()
        self.number = 0
        self._topic = topic
        self._condition = condition

    def take(self, timeout_s: float) -> tuple[Message, bytes | memoryview] | None:
        """Take the next one, with its bytes; None if there is none within `timeout_s`, or the next
        one does not count.
        """
        arrival = self.inbox.take(timeout_s)
        if not isinstance(arrival, Arrival):
            return None

        message = self.intake.accept(arrival)
        if message is None or not self._condition.holds(message):
            return None
        self.number += 1
        return message, arrival.payload

    def counts(self) -> str:
        """Count the messages that were printed, and those that were not, by reason."""
        name = self._topic.name
        left_out = self.intake.received[name] - self.number
        counted = [
            f"{self.number} messages",
            f"{self.intake.rejected[name]} rejected",
            f"{self.intake.gaps[name]} lost",
            f"{self.inbox.superseded[name]} superseded by newer ones",
        ]
        if left_out:
            counted.append(f"{left_out} left out by --filter")
        return ", ".join(counted)
