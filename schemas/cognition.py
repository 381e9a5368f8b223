"""Messages of the cognitive cycle: replays, coalitions, competitions, broadcasts, actions."""

from __future__ import annotations

import enum
from typing import Annotated

import msgspec

from schemas.array import Array
from schemas.base import Count, Message, Name, Part, Scalar, Unit
from schemas.graph import Link
from schemas.nodes import AnyNode


class Replay(Message, kw_only=True, frozen=True, tag="replay"):
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


class Direction(enum.StrEnum):
    """FORWARD: from the agent to the goal, before it leaves. REVERSE: from the goal back along the
    route that was planned last, once it is there.
    """

    FORWARD = "forward"
    REVERSE = "reverse"


class RouteReplay(Message, kw_only=True, frozen=True, tag="route_replay"):
    """A route replayed by place cells before a run or after it (paper §5.5, §5.6).

    `cells` int32 (n, 2) are the place nodes of map `map` in the order in which they are active;
    `goal` is the id of the goal, empty where the agent explores.
    """

    cycle: Count
    direction: Direction
    goal: str = ""
    map: Name
    cells: Array


Event = Replay | RouteReplay
"""What a codelet publishes once its operations are committed."""


class Coalition(Part, kw_only=True, frozen=True):
    """Content that an attention codelet brings to the global workspace.

    `id` is unique in a run; the workspace gives it when it commits the codelet's answer. `maps` are
    ids of cognitive maps.
    """

    id: str = ""
    codelet: Name
    activation: Unit
    nodes: list[AnyNode]
    links: list[Link] = []
    maps: list[Name] = []


class Coalitions(Message, kw_only=True, frozen=True):
    """What the attention codelets found in one cycle, perhaps nothing."""

    cycle: Count
    coalitions: list[Coalition]


class Trigger(enum.StrEnum):
    """The condition that led to a broadcast (LIDA's four triggers); NONE where none was met."""

    NONE = ""
    ONE_COALITION = "one coalition over threshold"
    AGGREGATE = "aggregate activation over threshold"
    NO_BROADCAST = "no broadcast for long"
    NO_NEW_COALITION = "no new coalition for long"


class Fate(enum.StrEnum):
    """What one cycle's competition made of a coalition."""

    WON = "won"
    WAITING = "waiting"
    DISPLACED = "displaced"
    DECAYED = "decayed"


class Contender(Part, kw_only=True, frozen=True):
    """A coalition in one cycle's competition: `id` names it from its first cycle to its last.

    `activation` is what is left after decay. A WAITING coalition competes again in the next cycle;
    a DISPLACED one gave its place to a newer one of its codelet; a DECAYED one has none left.
    """

    id: Name
    codelet: Name
    activation: Unit
    fate: Fate


class Competition(Message, kw_only=True, frozen=True):
    """One cycle's competition for consciousness: every coalition that took part, and its fate."""

    cycle: Count
    contenders: list[Contender]
    trigger: Trigger = Trigger.NONE


class Broadcast(Message, kw_only=True, frozen=True):
    """The winning coalition, to every module."""

    cycle: Count
    trigger: Name
    coalition: Coalition


class Rejection(enum.StrEnum):
    """Why action selection did not choose a behaviour; NONE for the one that it chose."""

    NONE = ""
    CONTEXT_MISSING = "part of its context is missing"
    NOT_INSTANTIATED = "activation below the instantiation threshold"
    LESS_ACTIVE = "less active than the one chosen"


class Behaviour(Part, kw_only=True, frozen=True):
    """A scheme that action selection considered."""

    scheme: Name
    activation: Unit
    rejection: Rejection = Rejection.NONE


class Action(Message, kw_only=True, frozen=True):
    """The scheme that action selection chose, and its parameters for the sensory-motor memory.

    `behaviours` are all schemes that were considered, the chosen one included.
    """

    cycle: Count
    scheme: Name
    activation: Unit
    parameters: dict[str, Scalar]
    behaviours: list[Behaviour] = []
