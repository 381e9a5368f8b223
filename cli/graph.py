"""`cogmap graph`: which process of a running system publishes, subscribes and answers what."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import click

from cogmap.bus.discovery import Process, Role, System
from cogmap.cli.options import agent_option, connect_option, json_option
from cogmap.cli.topic.observing import inspect_system
from cogmap.errors import UsageError
from cogmap.schemas.topics import Topic

_VERBS = {Role.PUBLISHES: "publishes", Role.SUBSCRIBES: "subscribes", Role.ANSWERS: "answers"}


@click.command()
@click.option("--dot", is_flag=True, help="Print Graphviz's language, to be drawn by `dot -Tsvg`.")
@json_option
@connect_option
@agent_option
def graph(dot: bool, as_json: bool, connect: str, agent: str) -> None:
    """Show which process publishes and subscribes what."""
    if dot and as_json:
        raise UsageError("--dot and --json exclude each other: choose one")

    system = inspect_system(connect, agent)
    if dot:
        click.echo(to_dot(system))
    elif as_json:
        click.echo(to_json(system))
    else:
        click.echo(to_tree(system))


def uses_of(system: System) -> dict[Process, dict[Role, list[Topic]]]:
    """The topics that each process uses: processes by name, topics in the order of the table."""
    uses: dict[Process, dict[Role, list[Topic]]] = {}
    for process in system.processes:
        uses[process] = {role: [] for role in Role}

    for topic in system.topics():
        for role in Role:
            for process in system.doing(role, topic):
                uses[process][role].append(topic)
    return uses


def to_tree(system: System) -> str:
    """The system as a tree that people read."""
    if not system.processes:
        return f"no process of {system.agent!r} is on the bus"

    lines: list[str] = []
    for process, roles in uses_of(system).items():
        lines += _branch(process, roles)
    for name in system.unknown_topics():
        lines.append(f"not a topic of this version: {name}")
    return "\n".join(lines)


def _branch(process: Process, roles: dict[Role, list[Topic]]) -> list[str]:
    title = process.name
    if process.member is not None and process.member.module != process.name:
        title += f" ({process.member.module})"

    lines = [title]
    used = [role for role, found in roles.items() if found]
    for role in used:
        is_last = role is used[-1]
        lines.append(f"{_fork(is_last)} {_VERBS[role]}")
        lines += _twigs(roles[role], " " if is_last else "│")
    return lines


def _twigs(found: list[Topic], margin: str) -> list[str]:
    return [f"{margin}  {_fork(topic is found[-1])} {topic.name}" for topic in found]


def _fork(is_last: bool) -> str:
    return "└─" if is_last else "├─"


def to_json(system: System) -> str:
    """The system as a list of processes that programs read."""
    processes = []
    for process, roles in uses_of(system).items():
        facts: dict[str, Any] = {
            "process": process.name,
            "module": process.member.module if process.member else None,
            "zid": process.zid,
        }
        for role, found in roles.items():
            facts[_VERBS[role]] = [topic.name for topic in found]
        processes.append(facts)
    return json.dumps(processes)


def to_dot(system: System) -> str:
    """The system in Graphviz's language: processes are ellipses, topics are boxes."""
    lines = ["digraph cogmap {", "  rankdir=LR;"]
    lines += [f'  "{topic.name}" [shape=box];' for topic in system.topics()]
    for process, roles in uses_of(system).items():
        lines += _dot_arrows(process.name, roles)
    return "\n".join([*lines, "}"])


def _dot_arrows(name: str, roles: dict[Role, list[Topic]]) -> Iterator[str]:
    for topic in roles[Role.PUBLISHES]:
        yield f'  "{name}" -> "{topic.name}";'
    for topic in roles[Role.SUBSCRIBES]:
        yield f'  "{topic.name}" -> "{name}";'
    for topic in roles[Role.ANSWERS]:
        yield f'  "{name}" -> "{topic.name}" [dir=both, style=dashed];'
