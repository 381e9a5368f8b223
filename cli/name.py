"""`cogmap name`: gives an object of the agent's map a name, and lists what is on the map."""

from __future__ import annotations

import os
import threading

import click
import msgspec

from cogmap.cli.options import json_option, wait_option
from cogmap.errors import NoAnswerError, UsageError
from cogmap.graph.graph import Graph
from cogmap.runtime.client import Client
from cogmap.runtime.module import Module
from cogmap.runtime.program import agent_option, connect_option
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import Delta
from cogmap.schemas.nodes import Object, object_id


class Namer:
    """Offers a name for an object once it has the graph, and waits until the map has it."""

    def __init__(self) -> None:
        self.graph = Graph()
        self.has_joined = threading.Event()
        self.is_named = threading.Event()
        self._asked: Object | None = None

        name = f"name-{os.getpid()}"
        self.module = Module("name", name).following(
            self.graph, self._on_delta, emits=[topics.OFFER], on_load=self._on_load
        )

    def ask(self, node: Object, given_name: str) -> None:
        """Ask for a name with the next delta."""
        self._asked = msgspec.structs.replace(node, given_name=given_name)

    def _on_load(self) -> list[Message]:
        self.has_joined.set()
        return []

    def _on_delta(self, delta: Delta) -> list[Message]:
        asked = self._asked
        if asked is None or self.is_named.is_set():
            return []

        node = self.graph.get(Object, asked.id)
        if node is not None and node.given_name == asked.given_name:
            self.is_named.set()
            return []
        return [Offer(cycle=self.graph.cycle, operations=[asked])]


@click.command()
@click.argument("which", required=False, metavar="[OBJECT]")
@click.argument("given", required=False, metavar="[NAME]")
@wait_option
@json_option
@connect_option
@agent_option
def name(
    which: str | None,
    given: str | None,
    timeout_s: float,
    as_json: bool,
    connect: str,
    agent: str,
) -> None:
    """Call an object of the agent's map NAME, which `cogmap goal` then finds.

    OBJECT is its label, or the name that it has if no other has it. Without both, the objects on
    the map are listed: label, name, and where each stands.

    \b
    cogmap name
    cogmap name 41a "our school"
    cogmap goal "our school"
    """
    if which is not None and given is None:
        raise UsageError(f"no name is given for {which}: cogmap name {which} NAME")

    namer = Namer()
    with Client(namer.module, connect, agent):
        if not namer.has_joined.wait(timeout_s):
            raise NoAnswerError(
                "no workspace answered: start the system with `cogmap run`, "
                "or name another agent with --agent"
            )
        if which is None or given is None:
            click.echo(listed(namer.graph, as_json))
            return

        node = found(which, namer.graph)
        namer.ask(node, given)
        if not namer.is_named.wait(timeout_s):
            raise NoAnswerError(
                f"the map did not take the name within {timeout_s:g} s: see `cogmap doctor`"
            )

    click.echo(msgspec.json.encode(_facts(node, given)) if as_json else f"{node.label} is {given}")


def found(which: str, graph: Graph) -> Object:
    """Find the object of that label or name. Raises UsageError if there is none, or several."""
    labelled = graph.get(Object, object_id(which.removeprefix(object_id(""))))
    if labelled is not None:
        return labelled

    called = [node for node in graph.of_kind(Object) if node.name == which]
    if len(called) == 1:
        return called[0]
    if called:
        labels = ", ".join(node.label for node in called)
        raise UsageError(
            f"{len(called)} objects are called {which}: name one by its label, {labels}"
        )
    raise UsageError(f"nothing on the map is {which}: `cogmap name` lists what is")


def listed(graph: Graph, as_json: bool) -> str:
    """List the objects on the map, by label."""
    objects = list(graph.of_kind(Object))
    if as_json:
        return msgspec.json.encode([_facts(node, node.name) for node in objects]).decode()
    if not objects:
        return "nothing is on the map yet"

    rows = [(node.label, node.name or "-", f"{node.x_m:.1f} {node.y_m:.1f}") for node in objects]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )


def _facts(node: Object, called: str) -> dict[str, object]:
    return {"label": node.label, "name": called, "x_m": node.x_m, "y_m": node.y_m}
