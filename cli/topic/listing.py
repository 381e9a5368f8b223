"""`cogmap topic list`, `info`, `type` and `find`: which topics there are and who is on them."""

from __future__ import annotations

import json
from typing import Any

import click

from cli.options import agent_option, connect_option, json_option
from cli.topic.argument import topic_argument
from cli.topic.observing import look
from cogmap.bus.discovery import Process, Role, System
from schemas import topics
from schemas.topics import Delivery, Topic

_ROLES = {
    Role.PUBLISHES: ("Published topics:", "publisher"),
    Role.SUBSCRIBES: ("Subscribed topics:", "subscriber"),
    Role.ANSWERS: ("Answered topics:", "answerer"),
}


@click.command("list")
@click.option("-t", "--show-types", is_flag=True, help="Show each topic's type.")
@click.option("-c", "--count-topics", is_flag=True, help="Only say how many there are.")
@click.option("-v", "--verbose", is_flag=True, help="Say how many publish and how many subscribe.")
@json_option
@connect_option
@agent_option
def listing(
    show_types: bool, count_topics: bool, verbose: bool, as_json: bool, connect: str, agent: str
) -> None:
    """The topics in use."""
    system = look(connect, agent)
    if as_json:
        click.echo(json.dumps([_described(system, topic) for topic in system.topics()]))
    elif count_topics:
        click.echo(len(system.topics()))
    elif verbose:
        click.echo("\n\n".join(_verbose(system, role) for role in Role))
    else:
        for topic in system.topics():
            click.echo(_typed(topic) if show_types else topic.name)


@click.command()
@topic_argument
@click.option("-v", "--verbose", is_flag=True, help="Name each process.")
@json_option
@connect_option
@agent_option
def info(topic: Topic, verbose: bool, as_json: bool, connect: str, agent: str) -> None:
    """A topic's type, and who publishes and subscribes it."""
    system = look(connect, agent)
    if as_json:
        click.echo(json.dumps(_described(system, topic)))
        return
    click.echo(f"Type: {topic.type.__name__}")
    click.echo(
        f"Delivery: {topic.delivery.value}" + (f", {topic.rate_hz:g} Hz" if topic.rate_hz else "")
    )
    for title, role in _columns(topic):
        found = system.doing(role, topic)
        click.echo(f"{title} count: {len(found)}")
        if verbose:
            click.echo("".join(_endpoint(process, role) for process in found), nl=False)


@click.command("type")
@topic_argument
def type_(topic: Topic) -> None:
    """The type of a topic's messages."""
    click.echo(topic.type.__name__)


@click.command()
@click.argument("type_name", metavar="TYPE")
def find(type_name: str) -> None:
    """The topics that carry a type."""
    for topic in topics.ALL:
        if topic.type.__name__.lower() == type_name.lower():
            click.echo(topic.name)


def _typed(topic: Topic) -> str:
    return f"{topic.name} [{topic.type.__name__}]"


def _verbose(system: System, role: Role) -> str:
    title, noun = _ROLES[role]
    counts = [(topic, len(system.doing(role, topic))) for topic in system.topics()]
    lines = [
        f" * {_typed(topic)} {number} {noun}{'s' * (number > 1)}"
        for topic, number in counts
        if number
    ]
    return "\n".join([title, *lines])


def _columns(topic: Topic) -> list[tuple[str, Role]]:
    if topic.delivery is Delivery.ON_REQUEST:
        return [("Answerer", Role.ANSWERS)]
    return [("Publisher", Role.PUBLISHES), ("Subscription", Role.SUBSCRIBES)]


def _endpoint(process: Process, role: Role) -> str:
    module = process.member.module if process.member else "unknown"
    return (
        f"\nProcess name: {process.name}\nModule: {module}\nEndpoint type: {role.value.upper()}\n"
        f"Zenoh id: {process.zid}\n\n"
    )


def _described(system: System, topic: Topic) -> dict[str, Any]:
    return {
        "topic": topic.name,
        "type": topic.type.__name__,
        "delivery": topic.delivery.value,
        "rate_hz": topic.rate_hz,
        **{
            role.name.lower(): [process.name for process in system.doing(role, topic)]
            for role in Role
        },
    }
