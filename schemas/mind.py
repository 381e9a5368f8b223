"""Messages inside the mind: tasks for codelets, coalitions, broadcasts, actions."""

from __future__ import annotations

from schemas.array import Array
from schemas.base import Count, Finite, Message, Name, Part, Scalar
from schemas.graph import Node
from schemas.sensing import Percept, Unit


class Task(Message, kw_only=True):
    """Work for one codelet, with all it needs: workers hold no state. `motions` as in SelfMotion."""

    task_id: Name
    codelet: Name
    worker: Name
    attempt: Count
    cycle: Count
    base_version: Count
    cell_m: Finite
    nodes: list[Node]
    percepts: list[Percept]
    motions: Array
    road_m: Array


class Coalition(Part, kw_only=True):
    """Content that an attention codelet brings to the global workspace."""

    codelet: Name
    activation: Unit
    content: list[Node]


class Coalitions(Message, kw_only=True):
    """What the attention codelets found in one cycle, perhaps nothing."""

    cycle: Count
    coalitions: list[Coalition]


class Competition(Message, kw_only=True):
    """How one cycle's competition for consciousness went. `trigger` is empty where nothing was broadcast."""

    cycle: Count
    contenders: dict[str, Finite]
    trigger: str = ""


class Broadcast(Message, kw_only=True):
    """The winning coalition, to every module."""

    cycle: Count
    trigger: Name
    coalition: Coalition


class Action(Message, kw_only=True):
    """The scheme that action selection chose, and its parameters for the sensory-motor memory."""

    cycle: Count
    scheme: Name
    activation: Unit
    parameters: dict[str, Scalar]
