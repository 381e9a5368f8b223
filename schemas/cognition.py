"""Messages inside the mind: tasks for codelets, coalitions, broadcasts, actions."""

from __future__ import annotations

from typing import Annotated

import msgspec

from schemas.array import Array
from schemas.base import Count, Finite, Message, Name, Part, Scalar
from schemas.graph import Node, PlaceTile
from schemas.sensing import Percept, PlaceMatch, Unit


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
    matches: list[PlaceMatch] = []
    tiles: list[PlaceTile] = []


class Replay(Message, kw_only=True):
    """A loop closed by reverse replay, and what it predicts of place cells (paper §5.6).

    Positions of the path in the order in which they are replayed, the newest first: `stamps_ns`
    int64 (n,) when the agent was there, `positions_m` float64 (n, 2) where it took itself to have
    been, `shifts_m` (n, 2) by how much the place fields shift. `pairs` int32 (m, 2) are place cells
    by their index in these, `strength_changes` float64 (m,) the change of the synapse between the
    two, whose strength is exp(-`decay_per_m` x distance of their fields). `closed` and `undone`
    name the closures that hold now, and those that held and do not any more.
    """

    cycle: Count
    replays: Count
    closed: list[Name]
    undone: list[Name]
    stamps_ns: Array
    positions_m: Array
    shifts_m: Array
    pairs: Array
    strength_changes: Array
    decay_per_m: Annotated[float, msgspec.Meta(gt=0, le=100)]


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
    """How one cycle's competition for consciousness went. `trigger` is empty where nothing was
    broadcast.
    """

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
