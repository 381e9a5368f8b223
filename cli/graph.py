"""`cogmap graph`: which process publishes, takes in and answers what on a running system."""

from __future__ import annotations

import json

import click

from cli.options import agent_option, connect_option, json_option
from cli.topic.observing import inspect_system
from cogmap.bus.discovery import Process, Role, System
from cogmap.errors import UsageError
from schemas.topics import Topic

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
    click.echo(to_dot(system) if dot else to_json(system) if as_json else to_tree(system))


def uses_of(system: System) -> dict[Process, dict[Role, list[Topic]]]:
    """For each process, in the order of names, the topics it is on, in the order of the table."""
    uses: dict[Process, dict[Role, list[Topic]]] = {
        process: {role: [] for role in Role} for process in system.processes
    }
    for topic in system.topics():
        for role in Role:
            for process in system.doing(role, topic):
                uses[process][role].append(topic)
    return uses


def to_tree(system: System) -> str:
    """The system as a tree that people read."""
    if not system.processes:
        return f"no process of {system.agent!r} is on the bus"
    lines = [line for process, roles in uses_of(system).items() for line in _branch(process, roles)]
    return "\n".join(lines + [f"a key that is no topic's: {key}" for key in system.foreign_keys()])


def _branch(process: Process, roles: dict[Role, list[Topic]]) -> list[str]:
    title = process.name
    if process.member is not None and process.member.module != process.name:
        title += f" ({process.member.module})"
    used = [(role, found) for role, found in roles.items() if found]
    lines = [title]
    for number, (role, found) in enumerate(used, 1):
        last = number == len(used)
        lines.append(f"{'└' if last else '├'}─ {_VERBS[role]}")
        twigs = [f"{'└' if topic is found[-1] else '├'}─ {topic.name}" for topic in found]
        lines += [f"{' ' if last else '│'}  {twig}" for twig in twigs]
    return lines


def to_json(system: System) -> str:
    """The system as a list of processes that programs read."""
    return json.dumps(
        [
            {
                "process": process.name,
                "module": process.member.module if process.member else None,
                "zid": process.zid,
                **{_VERBS[role]: [topic.name for topic in found] for role, found in roles.items()},
            }
            for process, roles in uses_of(system).items()
        ]
    )


def to_dot(system: System) -> str:
    """The system in Graphviz's language: processes are ellipses, topics are boxes."""
    lines = ["digraph cogmap {", "  rankdir=LR;"]
    lines += [f'  "{topic.name}" [shape=box];' for topic in system.topics()]
    for process, roles in uses_of(system).items():
        lines += [f'  "{process.name}" -> "{topic.name}";' for topic in roles[Role.PUBLISHES]]
        lines += [f'  "{topic.name}" -> "{process.name}";' for topic in roles[Role.SUBSCRIBES]]
        lines += [
            f'  "{topic.name}" -> "{process.name}" [dir=both, style=dashed];'
            for topic in roles[Role.ANSWERS]
        ]
    return "\n".join([*lines, "}"])
