"""`cogmap graph`: which process of a running system publishes, subscribes and answers what."""

from __future__ import annotations

import json
from typing import Any

import click

from cogmap.bus.discovery import Process, Role, System
from cogmap.cli.options import json_option
from cogmap.cli.topic.observing import inspect_system
from cogmap.errors import UsageError
from cogmap.runtime.program import agent_option, connect_option
from cogmap.schemas.topics import Topic

VERBS = {Role.PUBLISHES: "publishes", Role.SUBSCRIBES: "subscribes", Role.ANSWERS: "answers"}


@click.command()
@click.option("--dot", is_flag=True, help="Print a graph for Graphviz: `dot -Tsvg` draws it.")
@json_option
@connect_option
@agent_option
def graph(dot: bool, as_json: bool, connect: str, agent: str) -> None:
    """Show which process publishes, subscribes to and answers which topics."""
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
    """Find the topics that each process uses: processes by name, topics in the table's order."""
    uses: dict[Process, dict[Role, list[Topic]]] = {}
    for process in system.processes:
        uses[process] = {role: [] for role in Role}

    for topic in system.topics():
        for role in Role:
            for process in system.doing(role, topic):
                uses[process][role].append(topic)
    return uses


def to_tree(system: System) -> str:
    """Draw the system as a tree that people read."""
    if not system.processes:
        return f"no process of {system.agent!r} is on the bus"

    lines: list[str] = []
    for process, roles in uses_of(system).items():
        module = process.member.module if process.member is not None else process.name
        lines.append(process.name if module == process.name else f"{process.name} ({module})")

        used = [role for role, found in roles.items() if found]
        for role in used:
            fork, margin = ("└─", " ") if role is used[-1] else ("├─", "│")
            lines.append(f"{fork} {VERBS[role]}")
            *others, last = roles[role]
            lines += [f"{margin}  ├─ {topic.name}" for topic in others]
            lines.append(f"{margin}  └─ {last.name}")

    lines += [f"not a topic of this version: {name}" for name in system.unknown_topics()]
    return "\n".join(lines)


def to_json(system: System) -> str:
    """Encode the system as a list of processes that programs read."""
    processes = []
    for process, roles in uses_of(system).items():
        facts: dict[str, Any] = {
            "process": process.name,
            "module": process.member.module if process.member else None,
            "zid": process.zid,
        }
        for role, found in roles.items():
            facts[VERBS[role]] = [topic.name for topic in found]
        processes.append(facts)
    return json.dumps(processes)


def to_dot(system: System) -> str:
    """Write the system in Graphviz's language: processes are ellipses, topics are boxes."""
    lines = ["digraph cogmap {", "  rankdir=LR;"]
    lines += [f'  "{topic.name}" [shape=box];' for topic in system.topics()]
    for process, roles in uses_of(system).items():
        name = process.name
        lines += [f'  "{name}" -> "{topic.name}";' for topic in roles[Role.PUBLISHES]]
        lines += [f'  "{topic.name}" -> "{name}";' for topic in roles[Role.SUBSCRIBES]]
        for topic in roles[Role.ANSWERS]:
            lines.append(f'  "{name}" -> "{topic.name}" [dir=both, style=dashed];')
    return "\n".join([*lines, "}"])
