"""Messages of the cognitive cycle: replays, coalitions, competitions, broadcasts, behaviours,
actions.
"""

from __future__ import annotations

import enum
from typing import Annotated

import msgspec

from cogmap.schemas.array import Array
from cogmap.schemas.base import Count, Finite, Message, Name, Part, Scalar, Unit
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.graph import Link
from cogmap.schemas.nodes import AnyNode


class Replay(Message, kw_only=True, frozen=True, tag="replay"):
    """The path corrected by reverse replay, and what that predicts of place cells (paper §5.6).

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
    `goal` is the id of the goal, empty if the agent explores.
    """

    cycle: Count
    direction: Direction
    goal: str = ""
    map: Name
    cells: Array


Event = Replay | RouteReplay
"""What a codelet publishes once its operations are committed."""


class Relation(Part, kw_only=True, frozen=True):
    """Where an object stands as seen from the agent: egocentric, left positive.

    `look` is the name of what it looks like, empty if perception has none for it.
    """

    look: str = ""
    range_m: Annotated[float, msgspec.Meta(gt=0, le=1e4)]
    bearing_rad: Finite


class Coalition(Part, kw_only=True, frozen=True):
    """Content that an attention codelet brings to the global workspace.

    `id` is unique in a run; the workspace gives it when it commits the codelet's answer. `maps` are
    ids of cognitive maps. `relations` are those of its objects, by their ids, to the agent, as they
    were perceived in the view that it is about. `feeling` is what the agent feels about it: nodes
    with a salience below 0 are missing, or not as expected, where that is SURPRISE.
    """

    id: str = ""
    codelet: Name
    activation: Unit
    nodes: list[AnyNode]
    links: list[Link] = []
    maps: list[Name] = []
    relations: dict[Name, Relation] = {}
    feeling: Feeling = Feeling.NONE


class Coalitions(Message, kw_only=True, frozen=True):
    """What the attention codelets found in one cycle, perhaps nothing."""

    cycle: Count
    coalitions: list[Coalition]


class Trigger(enum.StrEnum):
    """The condition that led to a broadcast (LIDA's four triggers); NONE if none was met."""

    NONE = ""
    ONE_COALITION = "one coalition over threshold"
    AGGREGATE = "aggregate activation over threshold"
    NO_BROADCAST = "no broadcast for long"
    NO_NEW_COALITION = "no new coalition for long"


class Silence(enum.StrEnum):
    """Why a competition led to no broadcast; NONE if it led to one.

    NO_COALITION: none competed. REFRACTORY: the last broadcast was too short a time ago.
    NO_TRIGGER: no trigger's condition was met.
    """

    NONE = ""
    NO_COALITION = "no coalition competes"
    REFRACTORY = "too soon after the last broadcast"
    NO_TRIGGER = "no trigger fires"


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
    """One cycle's competition for consciousness: every coalition that took part, and its fate.

    `trigger` is what led to a broadcast, `silence` why there was none.
    """

    cycle: Count
    contenders: list[Contender]
    trigger: Trigger = Trigger.NONE
    silence: Silence = Silence.NONE


class Broadcast(Message, kw_only=True, frozen=True):
    """The winning coalition, to every module."""

    cycle: Count
    trigger: Name
    coalition: Coalition


class ActionName(enum.StrEnum):
    """The actions for which the sensory-motor memory has a motor program.

    FOLLOW_PLAN: drive the route of the plan. TURN: turn on the spot by the parameter `turn_rad`,
    left positive. DOCK: drive straight and slowly to the parameters `x_m` and `y_m`, on the map of
    the agent. SEEK: have the goal to be at the object `object` until the need `need` is satisfied,
    and drive the route of the plan. GUIDE: drive through the places `ahead_1_m` and `left_1_m`,
    `ahead_2_m` and so on, as seen from where the agent was at the stamp `seen_ns`. HALT: stand.
    """

    FOLLOW_PLAN = "follow_plan"
    TURN = "turn"
    DOCK = "dock"
    SEEK = "seek"
    GUIDE = "guide"
    HALT = "halt"


PARAMETERS: dict[str, dict[str, type]] = {
    ActionName.FOLLOW_PLAN: {},
    ActionName.TURN: {"turn_rad": float},
    ActionName.DOCK: {"x_m": float, "y_m": float},
    ActionName.SEEK: {"need": str, "object": str},
    ActionName.GUIDE: {
        "seen_ns": int,
        "ahead_1_m": float,
        "left_1_m": float,
        "ahead_2_m": float,
        "left_2_m": float,
    },
    ActionName.HALT: {},
}
"""The parameters that the motor program of each action needs, and their types. GUIDE takes more
places, numbered on.
"""


class Rejection(enum.StrEnum):
    """Why a behaviour was not chosen; NONE for one that was, or that may be."""

    NONE = ""
    CONTEXT_MISSING = "part of its context is missing"
    NOT_INSTANTIATED = "activation below the instantiation threshold"
    LESS_ACTIVE = "less active than the one chosen"
    BELOW_THRESHOLD = "activation below the selection threshold"


class Behaviour(Part, kw_only=True, frozen=True):
    """A scheme, as one broadcast activated it: a behaviour where nothing speaks against it.

    `bindings` are the ids of the nodes that the variables of its patterns stand for; `parameters`
    are those of `action`. The patterns of `context` have the activation of the node that each is
    matched by, 0 if none is; those of `adding` have their salience. `reliability` is the share
    of its `executions` that were `successes`. `gathered` is the part of its activation that came
    from the behaviour net.
    """

    scheme: Name
    activation: Unit
    rejection: Rejection = Rejection.NONE
    action: str = ""
    bindings: dict[Name, Name] = {}
    parameters: dict[Name, Scalar] = {}
    context: dict[str, Unit] = {}
    adding: dict[str, Finite] = {}
    deleting: list[str] = []
    reliability: Unit = 0.0
    executions: Count = 0
    successes: Count = 0
    gathered: Finite = 0.0


class GuidanceScheme(Part, kw_only=True, frozen=True):
    """A scheme that associates landmarks, as they stand relative to the agent, with what it did
    there (guidance, Madl et al. 2016): it drove through the places of `path_m`, metres ahead and to
    the left of where it was.

    It was executed and judged `executions` times, of which the agent came to the last place
    `successes` times.
    """

    name: Name
    landmarks: Annotated[list[Relation], msgspec.Meta(min_length=1, max_length=16)]
    path_m: Annotated[list[tuple[Finite, Finite]], msgspec.Meta(min_length=1, max_length=64)]
    executions: Count = 0
    successes: Count = 0


class Behaviours(Message, kw_only=True, frozen=True):
    """What procedural memory makes of the broadcast of `cycle`: every scheme that it considered,
    those that are not instantiated included, of guidance schemes only some that are.

    `learned` are the guidance schemes that it has learned since the last message, and those that
    were judged; in a journal it may be all of them.
    """

    cycle: Count
    behaviours: list[Behaviour]
    learned: list[GuidanceScheme] = []


class Action(Message, kw_only=True, frozen=True):
    """The scheme that action selection chose for the broadcast of `cycle`, and its action for the
    sensory-motor memory. `scheme` and `action` are empty if no behaviour was active enough: the
    action before continues.

    `behaviours` are all that were considered, the chosen one included. `threshold` is the
    activation that the next selection needs.
    """

    cycle: Count
    scheme: str
    action: str = ""
    activation: Unit
    parameters: dict[str, Scalar]
    behaviours: list[Behaviour] = []
    threshold: Unit = 0.0


class MotorProgram(Message, kw_only=True, frozen=True):
    """The sensory-motor memory begins to execute `action`, chosen in `cycle`, or has new parameters
    for it.
    """

    cycle: Count
    action: Name
    parameters: dict[str, Scalar]
