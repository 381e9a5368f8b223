"""`cogmap node`: the processes of a running system, and what each of them does."""

from __future__ import annotations

import time
from typing import Any

import click
import msgspec

from cogmap.bus.discovery import Process, Role, System, discover
from cogmap.bus.interface import Arrival
from cogmap.cli.graph import VERBS, uses_of
from cogmap.cli.options import json_option
from cogmap.cli.printing import print_json
from cogmap.cli.topic.observing import inspect_system, observing
from cogmap.errors import UsageError
from cogmap.hints import did_you_mean
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.intake import Intake
from cogmap.runtime.program import agent_option, connect_option
from cogmap.schemas import topics
from cogmap.schemas.process import Health
from cogmap.schemas.topics import Topic

HEALTH_S = 2.5
"""A process says every second how it fares; a busy machine gets some more time."""

_EPILOG = """\b
Examples:
  cogmap node list
  cogmap node info workspace
"""


@click.group(epilog=_EPILOG)
def node() -> None:
    """List the processes of a running system, and show what one of them does."""


@node.command("list")
@click.option("-c", "--count-nodes", is_flag=True, help="Print only how many there are.")
@json_option
@connect_option
@agent_option
def list_(count_nodes: bool, as_json: bool, connect: str, agent: str) -> None:
    """List the processes by name: modules, workers, and what observes them."""
    processes = inspect_system(connect, agent).processes
    if as_json:
        print_json([{"name": each.name, "module": module_of(each)} for each in processes])
    elif count_nodes:
        click.echo(len(processes))
    else:
        for each in processes:
            click.echo(each.name)


@node.command()
@click.argument("name")
@json_option
@connect_option
@agent_option
def info(name: str, as_json: bool, connect: str, agent: str) -> None:
    """Show what the process NAME publishes, subscribes to and answers, and how it fares."""
    with observing(connect, agent, "node-info") as bus:
        inbox = Inbox()
        bus.subscribe(topics.HEALTH, inbox.put, lambda topic, number: None)
        system = discover(bus.session, agent)
        process = process_named(name, system)
        uses = uses_of(system)[process]
        has_health = topics.HEALTH in uses[Role.PUBLISHES]
        health = health_of(process, inbox, HEALTH_S) if has_health else None

    if as_json:
        print_json(facts(process, uses, health))
    else:
        click.echo(text(process, uses, health))


def process_named(name: str, system: System) -> Process:
    """Find the process of that name. Raises UsageError naming the nearest."""
    for process in system.processes:
        if process.name == name:
            return process

    hint = did_you_mean(name, [each.name for each in system.processes], "see `cogmap node list`")
    raise UsageError(f"no process {name!r} runs: {hint}")


def health_of(process: Process, inbox: Inbox, timeout_s: float) -> Health | None:
    """Wait until a process says how it fares; None if it does not in time."""
    intake = Intake()
    until_s = time.monotonic() + timeout_s
    while (left_s := until_s - time.monotonic()) > 0:
        arrival = inbox.take(left_s)
        health = intake.accept(arrival) if isinstance(arrival, Arrival) else None
        if isinstance(health, Health) and health.instance == process.name:
            return health
    return None


def module_of(process: Process) -> str | None:
    """Return the name of the module that a process runs; None if it has not said."""
    return process.member.module if process.member is not None else None


def facts(process: Process, uses: dict[Role, list[Topic]], health: Health | None) -> dict[str, Any]:
    """Describe a process as programs read it."""
    found: dict[str, Any] = {"name": process.name, "module": module_of(process)}
    for role, verb in VERBS.items():
        found[verb] = {topic.name: topic.type.__name__ for topic in uses[role]}
    found["health"] = msgspec.to_builtins(health)
    return found


def text(process: Process, uses: dict[Role, list[Topic]], health: Health | None) -> str:
    """Describe a process as people read it."""
    lines = [f"{process.name} ({module_of(process) or 'unknown'})"]
    for role, verb in VERBS.items():
        if uses[role]:
            lines.append(f"  {verb}:")
            lines += [f"    {topic.name}: {topic.type.__name__}" for topic in uses[role]]

    if health is not None:
        state = "ready" if health.ready else "not ready yet"
        lines += [
            f"  {state}, for {health.uptime_s:.0f} s; busy {health.busy:.0%}, "
            f"{health.memory_mb:.0f} MB, {health.queued} messages wait",
            f"  received {sum(health.received.values())} messages, emitted "
            f"{sum(health.emitted.values())}, rejected {sum(health.rejected.values())}, lost "
            f"{sum(health.gaps.values())}",
        ]
        lines += [f"  {note}" for note in health.notes]
    return "\n".join(lines)
