"""`cogmap topic list`, `info`, `type` and `find`: the topics in use, and who uses them."""

from __future__ import annotations

import json
from typing import Any

import click

from cogmap.bus.discovery import Role, System
from cogmap.cli.options import json_option
from cogmap.cli.topic.argument import topic_argument
from cogmap.cli.topic.observing import inspect_system
from cogmap.runtime.program import agent_option, connect_option
from cogmap.schemas import topics
from cogmap.schemas.topics import Delivery, Topic

ROLES = {
    Role.PUBLISHES: ("Published topics:", "publisher"),
    Role.SUBSCRIBES: ("Subscribed topics:", "subscriber"),
    Role.ANSWERS: ("Answered topics:", "answerer"),
}


@click.command("list")
@click.option("-t", "--show-types", is_flag=True, help="Show each topic's type.")
@click.option("-c", "--count-topics", is_flag=True, help="Print only how many there are.")
@click.option("-v", "--verbose", is_flag=True, help="Count publishers and subscribers.")
@json_option
@connect_option
@agent_option
def listing(
    show_types: bool, count_topics: bool, verbose: bool, as_json: bool, connect: str, agent: str
) -> None:
    """List the topics in use."""
    system = inspect_system(connect, agent)
    used = system.topics()

    if as_json:
        click.echo(json.dumps([facts(system, topic) for topic in used]))
    elif count_topics:
        click.echo(len(used))
    elif verbose:
        click.echo("\n\n".join(counts(system, role) for role in Role))
    else:
        for topic in used:
            click.echo(f"{topic.name} [{topic.type.__name__}]" if show_types else topic.name)


@click.command()
@topic_argument
@click.option("-v", "--verbose", is_flag=True, help="Name each process.")
@json_option
@connect_option
@agent_option
def info(topic: Topic, verbose: bool, as_json: bool, connect: str, agent: str) -> None:
    """Show a topic's type, its publishers and its subscribers."""
    system = inspect_system(connect, agent)
    if as_json:
        click.echo(json.dumps(facts(system, topic)))
        return

    rate = f", {topic.rate_hz:g} Hz" if topic.rate_hz else ""
    click.echo(f"Type: {topic.type.__name__}")
    click.echo(f"Delivery: {topic.delivery.value}{rate}")

    roles = [("Publisher", Role.PUBLISHES), ("Subscription", Role.SUBSCRIBES)]
    if topic.delivery is Delivery.ON_REQUEST:
        roles = [("Answerer", Role.ANSWERS)]
    for title, role in roles:
        found = system.doing(role, topic)
        click.echo(f"{title} count: {len(found)}")
        for process in found if verbose else ():
            module = process.member.module if process.member else "unknown"
            click.echo(
                f"\nProcess name: {process.name}\nModule: {module}\n"
                f"Endpoint type: {role.value.upper()}\nZenoh id: {process.zid}\n"
            )


@click.command("type")
@topic_argument
def type_(topic: Topic) -> None:
    """Print the type of a topic's messages."""
    click.echo(topic.type.__name__)


@click.command()
@click.argument("type_name", metavar="TYPE")
@click.option("-c", "--count-topics", is_flag=True, help="Print only how many there are.")
def find(type_name: str, count_topics: bool) -> None:
    """List the topics whose messages are of TYPE."""
    found = [topic for topic in topics.ALL if topic.type.__name__.lower() == type_name.lower()]
    if count_topics:
        click.echo(len(found))
        return
    for topic in found:
        click.echo(topic.name)


def counts(system: System, role: Role) -> str:
    """List the topics for which processes have a role, and how many have it."""
    title, noun = ROLES[role]
    lines = [title]
    for topic in system.topics():
        number = len(system.doing(role, topic))
        if number:
            plural = "s" if number > 1 else ""
            lines.append(f" * {topic.name} [{topic.type.__name__}] {number} {noun}{plural}")
    return "\n".join(lines)


def facts(system: System, topic: Topic) -> dict[str, Any]:
    """Describe a topic and who uses it, as programs read it."""
    found: dict[str, Any] = {
        "topic": topic.name,
        "type": topic.type.__name__,
        "delivery": topic.delivery.value,
        "rate_hz": topic.rate_hz,
    }
    for role in Role:
        found[role.name.lower()] = [process.name for process in system.doing(role, topic)]
    return found
