"""The route-plan codelet: the shortest route to the next goal, or to a frontier where the agent
explores, as a node of the Workspace (paper §5.5).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats, Indices
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.codelets import Task
from cogmap.schemas.cognition import Direction, RouteReplay
from cogmap.schemas.graph import DropLink, Link, Operation, Phase
from cogmap.schemas.nodes import (
    PLAN_ID,
    SELF_ID,
    Goal,
    LinkKind,
    Map,
    Need,
    Object,
    PathSegment,
    Plan,
    PlanState,
    Self,
    place_id,
)
from cogmap.services.codelets.planning.config import SECTION, Config
from cogmap.services.codelets.planning.corridor import corridor
from cogmap.services.codelets.planning.doubt import doubted, may_doubt
from cogmap.services.codelets.planning.frontier import Standpoint, best_frontier
from cogmap.services.codelets.planning.goal_order import goal_order, order_before
from cogmap.services.codelets.planning.ground import COLUMNS, Ground, ground
from cogmap.services.codelets.planning.network import PlaceNetwork
from cogmap.services.codelets.planning.routes import (
    Visit,
    cost_m,
    lengths_m,
    route_to,
    visits,
)
from cogmap.services.codelets.planning.targets import (
    Cell,
    Target,
    as_reached,
    goals_m,
    has_arrived,
    is_at,
    is_satisfied,
    most_pressing,
    nearest_free,
    next_goal,
    open_goals,
    pending_goals,
    target_of,
)
from cogmap.services.codelets.planning.taut import taut
from cogmap.services.codelets.planning.urgency import is_done, is_urgent

START_M = 6.0


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """One task every `replan_cycles`, and at once where a goal is new or the route has ended or is
    blocked.
    """
    if graph.agent is None or is_done(graph, config):
        return []

    is_time = context.cycle % config.replan_cycles == 0
    if is_time or is_urgent(graph, graph.agent, config):
        return [context.task(CODELET.name, about=[SELF_ID, PLAN_ID])]
    return []


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Goals that are reached, and a new plan where the last one does not serve any longer."""
    agent = graph.agent
    if agent is None:
        raise MessageError(f"task {task.task_id}: the graph has no self node")

    before = graph.get(Plan, PLAN_ID)
    near = corridor(graph, agent, goals_m(graph), config)
    if near is not None:
        where = ground(graph, agent, config, within=near)
        planned = _planned(Situation(task, agent, where, before, config), graph)
        if not planned.plan.unreachable and not planned.plan.doubtful:
            return _answer(planned, graph)

    where = ground(graph, agent, config, [*pending_goals(graph).values()])
    return _answer(_planned(Situation(task, agent, where, before, config), graph), graph)


def _planned(now: Situation, graph: Graph) -> Planned:
    """What is planned on the ground of a situation."""
    targets = [target_of(goal, graph, now.where, now.config) for goal in open_goals(graph)]
    here = [target.goal for target in targets if is_at(target, now.agent, now.where, now.config)]
    reached = [goal for goal in here if is_satisfied(goal, graph, now.config)]
    at = {goal.id for goal in reached}
    left = [target_of(goal, graph, now.where, now.config) for goal in open_goals(graph, at)]
    return Planned(now, reached, left, _plan_for(here, at, left, graph, now))


def _plan_for(
    here: list[Goal], at: set[str], left: list[Target], graph: Graph, now: Situation
) -> Plan:
    """The plan of an agent that is at some goals, those reached with the ids `at`: it rests where a
    need is being satisfied.
    """
    if len(at) < len(here):
        return _routeless(PlanState.RESTS, now)
    if has_arrived(graph, at):
        return _routeless(PlanState.AT_GOAL, now)
    return _plan(most_pressing(left), now)


def _answer(planned: Planned, graph: Graph) -> Answer:
    """The plan, where it is another than before, and the goals that are reached."""
    now, reached, left, plan = planned
    answer = Answer()
    answer.operations.extend(_links_to_places(left, now.agent.map, graph))
    for goal in reached:
        answer.operations.append(as_reached(goal, now.task.stamp_ns))
        if now.before is not None and goal.id == next_goal(now.before):
            answer.events.append(_replay(now.before, Direction.REVERSE, now))

    if not _serves(plan, now):
        answer.operations.extend(_written(plan, now.before))
        answer.operations.extend(doubted(plan, now.before, left))
        if plan.route is not None and next_goal(plan) != next_goal(now.before):
            answer.events.append(_replay(plan, Direction.FORWARD, now))

    return answer


class Situation(NamedTuple):
    """What a plan is made from: the agent, the ground around it, and the plan before."""

    task: Task
    agent: Self
    where: Ground
    before: Plan | None
    config: Config

    @property
    def start(self) -> Cell | None:
        """The free place nearest to the agent."""
        agent = self.agent
        return nearest_free(agent.x_m, agent.y_m, self.where, self.where.is_free, START_M)

    def may_doubt(self, goal: Goal) -> bool:
        """Whether blocked road may be tried for a goal."""
        return may_doubt(goal, self.before, self.task.stamp_ns, self.config)


class Planned(NamedTuple):
    """In a situation, the goals that are reached, those that are left, and the plan for these."""

    now: Situation
    reached: list[Goal]
    left: list[Target]
    plan: Plan


CODELET = Codelet(
    name="route_plan",
    phase=Phase.BACKGROUND,
    due=due,
    run=run,
    reads=frozenset({Self, Goal, Need, Plan, Object, Map, PathSegment, *COLUMNS}),
    writes=frozenset({Plan, Goal, LinkKind.TOWARDS, LinkKind.AT}),
    config=Config,
    section=SECTION,
)


def _links_to_places(targets: list[Target], map_id: str, graph: Graph) -> list[Operation]:
    """The links of goals to the place nodes from which they are reached, where these are new."""
    links: list[Operation] = []
    for target in targets:
        if target.cell is None:
            continue

        goal = target.goal.id
        place = place_id(*target.cell, map_id)
        if graph.links.target(goal, LinkKind.AT) != place:
            links.append(Link(source=goal, target=place, kind=LinkKind.AT))

    return links


def _plan(targets: list[Target], now: Situation) -> Plan:
    """A plan for the goals that are left; to explore, where none has a route and that is wanted."""
    plan = _routeless(PlanState.NO_GOAL, now)
    start = now.start
    if start is None:
        unreachable = {target.goal.id: PlanState.BLOCKED for target in targets}
        return msgspec.structs.replace(plan, state=PlanState.BLOCKED, unreachable=unreachable)

    found, unreachable = _reachable(start, targets, now)
    plan = msgspec.structs.replace(plan, unreachable=unreachable)
    if found:
        return _to_goals(plan, start, found, now)

    if now.config.explore:
        plan = _to_frontier(plan, start, now)
    if plan.route is None and unreachable:
        state = next(iter(unreachable.values()))
        plan = msgspec.structs.replace(plan, state=state)
    return plan


def _routeless(state: PlanState, now: Situation) -> Plan:
    """A plan without a route, in this state."""
    return Plan(
        id=PLAN_ID,
        base_level=1.0,
        map=now.agent.map,
        state=state,
        planned_ns=now.task.stamp_ns,
    )


def _reachable(
    start: Cell, targets: list[Target], now: Situation
) -> tuple[list[Visit], dict[str, PlanState]]:
    """The targets to which routes lead from `start`, and why none leads to the others.

    Where a street that was blocked is the only one that is left, it may be free again.
    """
    where = now.where
    at_start = where.network.index_of(start)
    unreachable = {target.goal.id: target.state for target in targets if target.cell is None}

    found = [visit for visit in visits(where.network, targets) if _arrives(visit, at_start)]
    left = _without(targets, found)
    in_doubt = [target for target in left if now.may_doubt(target.goal)]
    found += [visit for visit in visits(where.doubted, in_doubt) if _arrives(visit, at_start)]

    for target in _without(targets, found):
        if target.cell is not None:
            unreachable[target.goal.id] = PlanState.NO_ROUTE

    return found, unreachable


def _arrives(visit: Visit, index: Cell) -> bool:
    """Whether activation arrives from a target at the place of that index."""
    return math.isfinite(visit.field.distance_m[index])


def _without(targets: list[Target], found: list[Visit]) -> list[Target]:
    """The targets that were not found."""
    names = {visit.target.goal.id for visit in found}
    return [target for target in targets if target.goal.id not in names]


def _to_goals(plan: Plan, start: Cell, found: list[Visit], now: Situation) -> Plan:
    """The plan with the order of the goals found, and the route to the first."""
    lengths = lengths_m(now.where.network, start, found)
    cells = np.array([start, *(visit.cell for visit in found)])
    positions_m = cells * now.where.network.cell_m
    names = [visit.target.goal.id for visit in found]
    planned = [] if now.before is None else now.before.goals

    order = goal_order(lengths, positions_m, order_before(names, planned), now.config)
    ordered = [found[number] for number in order]

    route = route_to(start, ordered[0])
    assert route is not None
    goals = [visit.target.goal.id for visit in ordered]
    is_doubtful = ordered[0].network is now.where.doubted
    plan = msgspec.structs.replace(plan, goals=goals, doubtful=is_doubtful)
    where = now.where
    # Agents kept less energy where such routes were taut: these lead nearer to kerbs.
    if ordered[0].target.goal.need:
        return _with_route(plan, route.cells, where)

    line = taut(route.cells, where.network.origin, where.is_clear)
    return _with_route(plan, line, where)


def _to_frontier(plan: Plan, start: Cell, now: Situation) -> Plan:
    """The plan with a route to the frontier that promises most, where there is one."""
    where = now.where
    standpoint = Standpoint(start, now.agent.heading_rad)
    frontier = best_frontier(where, standpoint, now.config, _frontier_before(now))
    if frontier is None:
        return plan

    nowhere = Goal(id="frontier")
    visit = visits(where.known, [Target(nowhere, frontier.cell)])[0]
    route = route_to(start, visit)
    if route is None:
        return plan
    return _with_route(msgspec.structs.replace(plan, explores=True), route.cells, where)


def _frontier_before(now: Situation) -> Cell | None:
    """The cell of the frontier that the agent goes to by the plan before."""
    before = now.before
    if before is None or not before.explores or before.route is None:
        return None

    i, j = _cells(before, now.where)[-1].tolist()
    return i, j


def _with_route(plan: Plan, cells: Indices | Floats, where: Ground) -> Plan:
    """The plan, ready to be driven along a route, (n, 2) in cells."""
    positions_m = cells * where.network.cell_m
    ready = msgspec.structs.replace(
        plan, state=PlanState.READY, route=Matrix.of(positions_m.astype(np.float64))
    )
    length_m = cost_m(_network_of(plan, where), _cells(ready, where))
    return msgspec.structs.replace(ready, length_m=length_m)


def _cells(plan: Plan, where: Ground) -> Indices:
    """(n, 2): the place nodes of a plan's route."""
    assert plan.route is not None
    cells = np.rint(plan.route.numpy() / where.network.cell_m)
    return cells.astype(np.int64)


def _serves(plan: Plan, now: Situation) -> bool:
    """Whether the plan before leads to the same goals as `plan` does, nearly as shortly, from where
    the agent is.
    """
    before = now.before
    if before is None or _aim(before) != _aim(plan):
        return False
    if before.route is None or plan.route is None:
        return before.route is plan.route

    cells = _cells(before, now.where)
    away_m = np.hypot(*(before.route.numpy() - (now.agent.x_m, now.agent.y_m)).T)
    nearest = int(away_m.argmin())
    moved = np.abs(cells[-1] - _cells(plan, now.where)[-1]).max()
    is_off = away_m[nearest] > now.config.off_route_m
    is_at_end = plan.explores and away_m[-1] <= now.config.reached_m
    if is_off or is_at_end or moved > now.config.same_frontier_cells // 2:
        return False

    network = _network_of(plan, now.where)
    left_m = cost_m(network, cells[nearest:])
    return left_m <= now.config.keep_route * plan.length_m + network.cell_m


def _network_of(plan: Plan, where: Ground) -> PlaceNetwork:
    """The links that a plan's route follows."""
    if plan.explores:
        return where.known
    return where.doubted if plan.doubtful else where.network


def _aim(plan: Plan) -> tuple[object, ...]:
    """What a plan is to reach, and what it came to."""
    return plan.map, plan.state, plan.explores, plan.doubtful, plan.goals, plan.unreachable


def _written(plan: Plan, before: Plan | None) -> list[Operation]:
    """The plan, and its link to the next goal."""
    operations: list[Operation] = [plan]
    goal = next_goal(plan)
    goal_before = next_goal(before)
    if goal:
        operations.append(Link(source=PLAN_ID, target=goal, kind=LinkKind.TOWARDS))
    elif goal_before:
        operations.append(DropLink(source=PLAN_ID, target=goal_before, kind=LinkKind.TOWARDS))

    return operations


def _replay(plan: Plan, direction: Direction, now: Situation) -> RouteReplay:
    """The place nodes of a plan's route, from the agent to the goal or back."""
    cells = _cells(plan, now.where)
    if direction is Direction.REVERSE:
        cells = cells[::-1]

    return RouteReplay(
        stamp_ns=now.task.stamp_ns,
        cycle=now.task.cycle,
        direction=direction,
        goal=next_goal(plan),
        map=plan.map,
        cells=Array.of(cells, "<i4"),
    )
