"""Where the agent is to go, and the route that leads there (paper §5.5)."""

from __future__ import annotations

import enum

from cogmap.schemas.array import Matrix
from cogmap.schemas.base import Finite, Metres, Name
from cogmap.schemas.nodes.base import NEVER_NS, GraphNode, Stamp
from cogmap.schemas.nodes.columns import RouteColumn, check_matrix
from cogmap.schemas.nodes.ids import ROOT_MAP

MAX_DETOUR_M = 10_000.0
"""Of what cannot be driven over at all."""


class PlanState(enum.StrEnum):
    """What a plan came to, or why a goal has no route.

    READY: its route is to be driven. AT_GOAL: the last of its goals is reached. RESTS: it is at a
    goal where a need is being satisfied. NO_ROUTE: no links lead to the goal. UNKNOWN_GOAL: the map
    has no object of that name. OUTSIDE: the goal is on no map. BLOCKED: the goal, or the agent, is
    at a place node without links. NO_GOAL: there is none, and nothing is left to explore.
    """

    READY = "ready"
    AT_GOAL = "the agent is at the goal"
    RESTS = "the agent stays until a need is satisfied"
    NO_ROUTE = "no route leads to the goal"
    UNKNOWN_GOAL = "the map has no object of that name"
    OUTSIDE = "the goal is outside every map"
    BLOCKED = "the goal or the agent is at a blocked place"
    NO_GOAL = "there is no goal"


class CostLayer(enum.StrEnum):
    """A layer of the cost of a place, as the reason why a route is dearer than it is long."""

    UNKNOWN = "part of it was never seen as road"
    EDGE = "a kerb or a wall leads across it"
    OBSTACLE = "something stands on it"
    NARROW = "it is too narrow for the robot there"
    SEEN_LATELY = "it was seen to be closed not long ago"
    BESIDE = "it leads close by a kerb or by something that stands there"


class Goal(GraphNode, kw_only=True, frozen=True, tag="goal"):
    """A place to go to: the object `object`, by its label, or a position where that is empty.

    It counts once the goal whose id is `after` is reached, at once where there is none of that id.
    `reached_ns` is the time of the view in which the agent was there, NEVER_NS before. One that
    serves a `need`, by its label, goes before all others; it is reached once that need is satisfied
    there, and then forgotten.
    """

    object: str = ""
    map: Name = ROOT_MAP
    x_m: Finite = 0.0
    y_m: Finite = 0.0
    after: str = ""
    reached_ns: Stamp = NEVER_NS
    need: str = ""


class Plan(GraphNode, kw_only=True, frozen=True, tag="plan"):
    """A route to the next goal, and the order of those after it.

    `goals` are ids of goals in the order of their visits; none where the plan explores. `route`:
    float64 (n, 2) of the map `map`, see RouteColumn, from where the agent was at `planned_ns` to
    the next goal, `length_m` long. It is `doubtful` if it leads over road that was blocked.
    `unreachable` has the reason for each goal that has no route. `detour_for` has, for a plan that
    leaves the route of the plan before, what each layer of cost adds to that route, in metres of
    free road, MAX_DETOUR_M at most.
    """

    map: Name = ROOT_MAP
    state: PlanState
    explores: bool = False
    doubtful: bool = False
    goals: list[Name] = []
    unreachable: dict[Name, PlanState] = {}
    planned_ns: Stamp = NEVER_NS
    length_m: Metres = 0.0
    route: Matrix | None = None
    detour_for: dict[CostLayer, Metres] = {}

    def __post_init__(self) -> None:
        if self.route is not None:
            check_matrix(self.id, self.route, "<f8", (len(RouteColumn),))
