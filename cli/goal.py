"""`cogmap goal`: gives goals to a running system, and prints its plan."""

from __future__ import annotations

import math
import os
import sys
import threading
from collections.abc import Iterable, Sequence
from pathlib import Path

import click
import msgspec

from cogmap.cli.launch.goals import name_of, nearest_label, routeless
from cogmap.cli.options import json_option, wait_option
from cogmap.errors import NoAnswerError, UsageError
from cogmap.files.packed import read_text
from cogmap.graph.graph import Graph
from cogmap.runtime.client import Client
from cogmap.runtime.module import Module
from cogmap.runtime.program import agent_option, connect_option
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import Delta, DropNode, Operation
from cogmap.schemas.nodes import NEVER_NS, PLAN_ID, Goal, Plan, PlanState, goal_id

FARTHEST_M = 1e6


class Person:
    """Offers goals once it has the graph, and waits for the plan that has them all.

    A goal that is not on the map, but like a name that is, was misspelt: it is withdrawn.
    """

    def __init__(self, goals: Sequence[Goal], clears: bool) -> None:
        self.graph = Graph()
        self.has_joined = threading.Event()
        self.has_plan = threading.Event()
        self.plan: Plan | None = None
        self.reached: list[str] = []
        self._goals = goals
        self._clears = clears
        self._offered_version: int | None = None

        name = f"goal-{os.getpid()}"
        self.module = Module("goal", name).following(
            self.graph,
            self._on_delta,
            emits=[topics.OFFER],
            on_load=self._offer,
        )

    def _on_delta(self, delta: Delta) -> list[Message]:
        """Offer once; look for the plan in what follows."""
        published = self._offer()
        if published or self.has_plan.is_set():
            return published

        plan = self._plan_of(delta)
        if plan is None:
            return published

        self.plan = plan
        self.has_plan.set()
        misspelt = misspellings(plan, self.graph)
        withdrawn = [DropNode(id=goal.id) for goal in self._goals if goal.id in misspelt]
        if not withdrawn:
            return []
        return [Offer(cycle=self.graph.cycle, operations=[*withdrawn])]

    def _offer(self) -> list[Message]:
        if self._offered_version is not None:
            return []

        self._offered_version = self.graph.version
        self.has_joined.set()
        operations: list[Operation] = []
        if self._clears:
            given = {goal.id for goal in self._goals}
            operations += [
                DropNode(id=goal.id) for goal in self.graph.of_kind(Goal) if goal.id not in given
            ]

        return [Offer(cycle=self.graph.cycle, operations=[*operations, *self._goals])]

    def _plan_of(self, delta: Delta) -> Plan | None:
        """Return the plan, committed since the offer, once each given goal is in it or reached.

        If the agent passes a goal before it is planned, no plan ever has it.
        """
        plan = self.graph.get(Plan, PLAN_ID)
        if plan is None or not any(isinstance(item, Plan | Goal) for item in delta.operations):
            return None

        planned = {*plan.goals, *plan.unreachable}
        reached = []
        for goal in self._goals:
            if goal.id in planned:
                continue

            kept = self.graph.get(Goal, goal.id)
            if kept is None or kept.reached_ns == NEVER_NS:
                return None

            reached.append(goal.id)

        self.reached = reached
        return plan


def misspellings(plan: Plan, graph: Graph) -> dict[str, str]:
    """Find the goals of a plan that are not on the map, by id, each with the name like it."""
    found = {}
    for goal, state in plan.unreachable.items():
        meant = nearest_label(goal, state, graph)
        if meant:
            found[goal] = meant
    return found


# Without this, a position's minus sign begins an option.
@click.command(context_settings={"ignore_unknown_options": True})
@click.argument("places", nargs=-1, metavar="[NAME | X Y]...")
@click.option(
    "--file",
    "path",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Read more goals from FILE, one per line: a name, or x and y.",
)
@click.option(
    "--clear", is_flag=True, help="Forget the goals that the agent has; without new ones it stops."
)
@wait_option
@json_option
@connect_option
@agent_option
def goal(
    places: tuple[str, ...],
    path: Path | None,
    clear: bool,
    timeout_s: float,
    as_json: bool,
    connect: str,
    agent: str,
) -> None:
    """Send the agent of a running system somewhere.

    A goal is the name of an object on its map, or a position X Y in metres on the map: the origin
    is where the agent started, X is ahead of it there, and Y to the left. The agent plans the order
    of several goals itself. Prints the plan; ends with 1 if no route leads to a goal. A name that
    is not on the map, but like one that is, is withdrawn.

    \b
    cogmap goal bakery
    cogmap goal 12.5 -3
    cogmap goal bakery school 12.5 -3
    cogmap goal --file goals.txt
    """
    goals = parsed(places)
    if path is not None:
        goals += read_goals(path)
    if not goals and not clear:
        raise UsageError("no goal is given: name an object, or a position as X Y")

    person = Person(goals, clear)
    with Client(person.module, connect, agent):
        if not person.has_joined.wait(timeout_s):
            raise NoAnswerError(
                "no workspace answered: start the system with `cogmap run`, "
                "or name another agent with --agent"
            )
        if not person.has_plan.wait(timeout_s):
            raise NoAnswerError(
                f"no plan came within {timeout_s:g} s: see `cogmap topic echo workspace/delta`"
            )

    plan = person.plan
    assert plan is not None
    text_of = plan_json if as_json else plan_text
    shown = text_of(plan, person.graph, person.reached)
    click.echo(shown)
    if plan.unreachable:
        sys.exit(1)


def parsed(words: Iterable[str]) -> list[Goal]:
    """Parse goals: two numbers in a row are a position, any other word is a name.

    Raises UsageError for a single or an absurd number, and for an unknown option.
    """
    goals = []
    left = list(words)
    while left:
        word = left.pop(0)
        x_m = _number(word)
        if x_m is None:
            if word.startswith("-"):
                raise UsageError(f"there is no option {word}: see `cogmap goal --help`")

            goals.append(Goal(id=goal_id(word), base_level=1.0, object=word))
            continue

        y_m = _number(left.pop(0)) if left else None
        if y_m is None:
            raise UsageError(f"{word} is a number alone: a position is X and Y, in metres")
        goals.append(Goal(id=goal_id(f"{x_m:g},{y_m:g}"), base_level=1.0, x_m=x_m, y_m=y_m))

    return goals


def _number(word: str) -> float | None:
    """Return the metres that a word gives; None if it is no number. Raises UsageError."""
    try:
        value = float(word)
    except ValueError:
        return None

    if not math.isfinite(value) or abs(value) > FARTHEST_M:
        raise UsageError(f"{word} is no position: give metres between -{FARTHEST_M:g} and 1e6")
    return value


def read_goals(path: Path) -> list[Goal]:
    """Read the goals of a file, one a line: a name, which may have several words, or x and y.

    Raises UsageError for a wrong line, which it names, and if there is none.
    """
    goals = []
    try:
        lines = read_text(path).splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"{path} cannot be read ({error}): give goals, one a line") from None
    for number, line in enumerate(lines, start=1):
        words = line.split()
        if not words:
            continue

        try:
            is_position = _number(words[0]) is not None
            goals += parsed(words if is_position else [" ".join(words)])
        except UsageError as error:
            raise UsageError(f"{path}, line {number}: {error}") from None

    if not goals:
        raise UsageError(f"{path} has no goals: write one a line, a name or x and y")
    return goals


def plan_json(plan: Plan, graph: Graph, reached: Iterable[str] = ()) -> bytes:
    """Encode the plan as JSON, with the goals reached before they were planned, and what may have
    been meant by goals that are not on the map.
    """
    nearest = {name_of(goal): meant for goal, meant in misspellings(plan, graph).items()}
    summary = {
        "state": plan.state,
        "goals": [name_of(goal) for goal in plan.goals],
        "length_m": plan.length_m,
        "reached": [name_of(goal) for goal in reached],
        "unreachable": {name_of(goal): state for goal, state in plan.unreachable.items()},
        "nearest": nearest,
    }
    return msgspec.json.encode(summary)


def plan_text(plan: Plan, graph: Graph, reached: Iterable[str] = ()) -> str:
    """Write the plan as a person reads it, and the goals reached before they were planned."""
    lines = [f"{name_of(goal)}: reached" for goal in reached]
    for number, name in enumerate(plan.goals, start=1):
        distance = f", {plan.length_m:.0f} m" if number == 1 else ""
        lines.append(f"{number}. {name_of(name)}{distance}")

    for name, state in plan.unreachable.items():
        lines.append(f"{name_of(name)}: {routeless(name, state, graph)}")

    if not lines:
        lines.append(PlanState.NO_GOAL.value if plan.explores else plan.state.value)
    return "\n".join(lines)
