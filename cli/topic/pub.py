"""`cogmap topic pub`: publishes messages."""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Iterable

import click

from cogmap.bus.access.subjects import ACTS
from cogmap.bus.discovery import Role, discover
from cogmap.bus.interface import Member
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.cli.options import FiniteRange
from cogmap.cli.topic.argument import streamed_argument
from cogmap.cli.topic.documents import documents
from cogmap.cli.topic.observing import CLI, RouterWatch, observing
from cogmap.cli.topic.parse import parse, pattern
from cogmap.cli.topic.publishing import Publisher, Stamps, check_unpublished
from cogmap.errors import UsageError
from cogmap.runtime.process import Stop
from cogmap.runtime.program import agent_option, connect_option
from cogmap.schemas.base import Message
from cogmap.schemas.topics import Topic
from cogmap.services import registry

VERB = "topic-pub"
LOOK_S = 0.2
"""How often subscribers are looked for."""

_EPILOG = """\b
Examples:
  cogmap topic pub motor/program                     a pattern, to be filled in
  cogmap topic pub -1 workspace/offer "$(cat offer.yaml)"
  cogmap topic pub workspace/offer --stdin < offers.yaml
  cogmap run --without motor                         and in another terminal, in its place:
  cogmap topic pub motor/command -r 5 --as motor '{left_wheel_rad_s: 1, right_wheel_rad_s: 2}'
"""


@click.command(epilog=_EPILOG)
@streamed_argument
@click.argument("message", required=False)
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
@click.option(
    "-p",
    "--print",
    "print_every",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    metavar="N",
    help="Print only every Nth message.",
)
@click.option(
    "-w",
    "--wait-matching-subscriptions",
    "subscribers",
    type=click.IntRange(min=0),
    metavar="N",
    help="Wait for this many subscribers.  [default: 1 with -1 or -t, else 0]",
)
@click.option(
    "--stdin",
    "from_stdin",
    is_flag=True,
    help="Publish each message on standard input: JSON lines, or YAML with --- between them.",
)
@click.option(
    "--keep-alive",
    "keep_alive_s",
    type=FiniteRange(0, 3600),
    default=0.0,
    show_default=True,
    metavar="SECONDS",
    help="Stay so long after the last message, for whoever missed it.",
)
@click.option(
    "--as",
    "module",
    type=click.Choice(registry.MODULES),
    metavar="MODULE",
    help="Stand in for this module, which `cogmap run --without MODULE` waits for.",
)
@connect_option
@agent_option
def pub(
    topic: Topic,
    message: str | None,
    rate: float,
    once: bool,
    times: int | None,
    print_every: int,
    subscribers: int | None,
    from_stdin: bool,
    keep_alive_s: float,
    module: str | None,
    connect: str,
    agent: str,
) -> None:
    """Publish MESSAGE, written in JSON or YAML, again and again until Ctrl-C.

    Without MESSAGE a pattern is printed, to be filled in. A message without a stamp gets the time
    of the system's clock. A topic that a process publishes already is refused: its messages would
    take the place of yours.
    """
    if message is None and not from_stdin:
        click.echo(pattern(topic))
        click.echo("nothing is published: give a message such as this one", err=True)
        return
    if message is not None and from_stdin:
        raise UsageError("a message and --stdin: leave one out")

    limit = 1 if once else times
    to_publish = _messages(topic, message, limit)
    awaited = subscribers
    if awaited is None:
        awaited = 0 if limit is None else 1

    member = Member(module or CLI, f"{CLI}-{VERB}")
    subjects = ACTS if module is None else (module,)
    with observing(connect, agent, member, subjects) as bus:
        system = discover(bus.session, agent)
        check_unpublished(system, topic)
        stop = Stop()
        router = RouterWatch(bus.session, connect)
        stamps = Stamps(bus, system)
        publisher = Publisher(bus, topic)
        if module is not None:
            bus.announce(member)

        _await_subscribers(bus, agent, topic, awaited, stop, router)
        due_s = time.monotonic()
        for each in to_publish:
            if stop.wait(max(0.0, due_s - time.monotonic())):
                break
            router.check()
            stamped = stamps.stamped(each)
            publisher.publish(stamped)
            if publisher.number % print_every == 0:
                click.echo(f"publishing #{publisher.number}: {stamped}")
            due_s += 1 / rate
        stop.wait(keep_alive_s)


def _messages(topic: Topic, text: str | None, limit: int | None) -> Iterable[Message]:
    """Parse what to publish, at most `limit` messages: `text` so often, without a limit for ever;
    each document on standard input if it is None. Raises UsageError.
    """
    if text is not None:
        message = parse(topic, text)
        return itertools.islice(itertools.repeat(message), limit)

    found = []
    for number, document in enumerate(documents(sys.stdin), start=1):
        try:
            found.append(parse(topic, document))
        except UsageError as error:
            raise UsageError(f"message {number} on standard input: {error}") from None
    return found[:limit]


def _await_subscribers(
    bus: ZenohBus, agent: str, topic: Topic, number: int, stop: Stop, router: RouterWatch
) -> None:
    """Wait until `topic` has so many subscribers, or until asked to end."""
    is_told = False
    while number and not stop.asked:
        found = len(discover(bus.session, agent).doing(Role.SUBSCRIBES, topic))
        if found >= number:
            return

        if not is_told:
            click.echo(
                f"waiting for {number} subscribers of {topic.name}: {found} so far", err=True
            )
            is_told = True
        router.check()
        stop.wait(LOOK_S)
