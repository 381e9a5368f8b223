"""Describes nodes, percepts and commands in words."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable

from cogmap.schemas.cognition import Coalition
from cogmap.schemas.graph import Delta
from cogmap.schemas.nodes import (
    Episode,
    Goal,
    GraphNode,
    Map,
    Object,
    Plan,
    PlanState,
    Self,
    goal_id,
    is_coarse_map,
    kind_of,
    map_number,
)
from cogmap.schemas.nodes import Percept as PerceptNode
from cogmap.schemas.sensing import MotorCommand, Percept, SpeedLimit

NAMED = 6
STRAIGHT = 0.02
AHEAD_RAD = math.radians(0.5)


def spoken(name: str) -> str:
    """Write a label, a kind or the name of a scheme as people do."""
    return name.replace("_", " ")


def of_look(name: str) -> str:
    """Write what perception calls something; what it has no name for is unknown."""
    return spoken(name) if name else "unknown"


def of_node(node: GraphNode) -> str:
    """Describe a node: the agent's pose, an object's label, a goal's name, where a plan leads."""
    match node:
        case Self():
            degrees = round(math.degrees(math.remainder(node.heading_rad, math.tau)))
            words = f"the agent at {_position(node.x_m, node.y_m)}, heading {degrees}°"
        case Object() | PerceptNode():
            words = spoken(node.name) if node.name else f"object {node.label}"
        case Goal():
            words = of_goal(node)
        case Plan():
            words = of_plan(node)
        case Map():
            words = _map(node.id)
        case Episode():
            labels = ", ".join(spoken(each.label) for each in node.content[:NAMED])
            place = _position(node.x_m, node.y_m)
            words = f"the episode at {place} in run {node.run}: {labels}"
        case _:
            words = spoken(f"{kind_of(node)} {node.id}")
    return words


def content(coalition: Coalition) -> str:
    """Say what a coalition is about: its nodes, in their order."""
    words = [of_node(node) for node in coalition.nodes]
    return ", ".join(words) or "nothing"


def brief(coalition: Coalition) -> str:
    """Say in a few words what a coalition is about: its first nodes."""
    words = []
    for node in coalition.nodes[:NAMED]:
        match node:
            case Self():
                words.append("the agent")
            case Plan():
                words.append("the plan")
            case _:
                words.append(of_node(node))

    others = len(coalition.nodes) - NAMED
    if others > 0:
        words.append(f"and {others} more")
    return ", ".join(words) or "nothing"


def of_percept(percept: Percept) -> str:
    """Say where an object is seen, as far as that is known."""
    parts = []
    if percept.has_range:
        parts.append(f"{percept.range_m:.1f} m")
    if percept.has_bearing:
        parts.append(bearing(percept.bearing_rad))
    return ", ".join(parts)


def of_feelings(percept: Percept) -> str:
    """Say what is felt about an object, and how strongly."""
    return ", ".join(f"{name} {share:.2f}" for name, share in percept.feelings.items())


def bearing(bearing_rad: float) -> str:
    """Describe a direction as seen from the agent, whose left is positive."""
    if abs(bearing_rad) < AHEAD_RAD:
        return "ahead"
    side = "left" if bearing_rad > 0 else "right"
    return f"{math.degrees(abs(bearing_rad)):.0f}° {side}"


def of_command(command: MotorCommand) -> str:
    """Say how a command moves the robot, and what limits it."""
    moved = motion(command.left_wheel_rad_s, command.right_wheel_rad_s)
    limits = []
    if command.halted_by is not SpeedLimit.NONE:
        limits.append(f"halted by {command.halted_by.value}")
    if command.slowed_by is not SpeedLimit.NONE:
        limits.append(f"slowed by {command.slowed_by.value}")
    return ", ".join([moved, *limits])


def codelets(delta: Delta) -> str:
    """List the codelets whose answers a delta commits, each with the number of its answers."""
    named = []
    for task in delta.tasks:  # its id is the cycle, the codelet, and perhaps its subject
        codelet = task.partition("/")[2].partition("/")[0]
        named.append(codelet or task)
    return counted(named)


def counted(names: Iterable[str]) -> str:
    """List names, each once, with how often it occurs if that is more than once."""
    words = []
    for name, number in Counter(names).items():
        times = f" ({number})" if number > 1 else ""
        words.append(f"{spoken(name)}{times}")
    return ", ".join(words)


def of_goal(goal: Goal) -> str:
    """Describe a goal by its object, or by its name and position."""
    if goal.object:
        return f"the goal {spoken(goal.object)}"

    place = _position(goal.x_m, goal.y_m)
    if goal.id == goal_id(f"{goal.x_m:g},{goal.y_m:g}"):
        return f"the goal at {place}"
    name = goal.id.removeprefix(goal_id(""))
    return f"the goal {spoken(name)} at {place}"


def of_plan(plan: Plan) -> str:
    """Describe a plan: where it leads and how far, or why there is none."""
    if plan.state is not PlanState.READY:
        return f"the plan: {plan.state.value}"

    length = f"{plan.length_m:.0f} m"
    doubt = ", over road that was blocked" if plan.doubtful else ""
    if plan.explores or not plan.goals:
        return f"the plan to explore, {length}{doubt}"

    name = spoken(plan.goals[0].removeprefix(goal_id("")))
    detour = ""
    if plan.detour_for:
        layer = max(plan.detour_for, key=plan.detour_for.__getitem__)
        detour = f"; the route before is dearer now: {layer.value}"
    return f"the plan to go to {name}, {length}{doubt}{detour}"


def _map(identifier: str) -> str:
    number = map_number(identifier)
    if number is not None:
        return "the root map" if number == 0 else f"map {number}"
    if is_coarse_map(identifier):
        return f"coarse map {identifier.rpartition(':')[2]}"
    return identifier


def _position(x_m: float, y_m: float) -> str:
    """Write a position with one decimal, and never as minus zero."""
    return f"({round(x_m, 1) + 0.0:.1f}, {round(y_m, 1) + 0.0:.1f}) m"


def motion(left_rad_s: float, right_rad_s: float) -> str:
    """Say how the robot moves with these speeds of its wheels."""
    fastest = max(abs(left_rad_s), abs(right_rad_s))
    if fastest == 0.0:
        return "stand still"

    side = "left" if right_rad_s > left_rad_s else "right"
    if left_rad_s * right_rad_s < 0:
        return f"turn {side} on the spot"
    way = "ahead" if left_rad_s + right_rad_s > 0 else "back"
    if abs(right_rad_s - left_rad_s) <= STRAIGHT * fastest:
        return f"drive straight {way}"
    return f"drive {way}, bending {side}"
