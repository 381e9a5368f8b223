"""The route-plan codelet: the cheapest route to the next goal, or to a frontier while the agent
explores, as a node of the Workspace (paper §5.5).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats, Indices
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.codelets import Task
from cogmap.schemas.cognition import Direction, RouteReplay
from cogmap.schemas.graph import DropLink, Link, Phase
from cogmap.schemas.nodes import (
    MAX_DETOUR_M,
    PLAN_ID,
    SELF_ID,
    CostLayer,
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
from cogmap.services.codelets.planning.activation import Field, Links, spread
from cogmap.services.codelets.planning.config import SECTION, Config
from cogmap.services.codelets.planning.corridor import corridor
from cogmap.services.codelets.planning.frontier import (
    SAME_FRONTIER_CELLS,
    Standpoint,
    best_frontier,
)
from cogmap.services.codelets.planning.ground import COLUMNS
from cogmap.services.codelets.planning.line_of_sight import straightened
from cogmap.services.codelets.planning.network import Cell, PlaceNetwork
from cogmap.services.codelets.planning.place_cost import PlaceCosts, place_costs
from cogmap.services.codelets.planning.replanning import is_done, is_urgent
from cogmap.services.codelets.planning.targets import (
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
from cogmap.services.codelets.planning.tours import (
    TourSettings,
    follow_activation,
    order_from,
    route_length,
)

START_M = 6.0
"""Within so far of the agent a route may begin: a place where it fits is near a street."""

KEEP_ROUTE = 1.15
"""A route is kept while it costs at most so many times a new one, so that the agent does not waver.
Chosen on simulated towns."""

OFF_ROUTE_M = 3.0
"""From its route, at which the agent plans anew: half a street's width."""


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """Return one task every `replan_cycles`, and at once if a goal is new or the route has ended or
    is blocked.
    """
    if graph.agent is None or is_done(graph, config):
        return []

    is_time = context.cycle % config.replan_cycles == 0
    if is_time or is_urgent(graph, graph.agent, config):
        return [context.task(CODELET.name, about=[SELF_ID, PLAN_ID])]
    return []


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Return goals that are reached, and a new plan if the last one does not serve any longer."""
    agent = graph.agent
    if agent is None:
        raise MessageError(f"task {task.task_id}: the graph has no self node")

    situation = Situation(task, graph, agent, config, graph.get(Plan, PLAN_ID))
    within = None
    if config.planning == "hierarchy":
        within = corridor(graph, agent, goals_m(graph, agent), config)
    if within is not None:
        outcome = planned(situation, place_costs(graph, agent, config, within=within))
        if not outcome.plan.unreachable and not outcome.plan.doubtful:
            return answer(outcome, situation)

    goals = [*pending_goals(graph).values()]
    return answer(planned(situation, place_costs(graph, agent, config, goals)), situation)


class Situation(NamedTuple):
    """What is planned for: the graph, the agent in it, and the plan before."""

    task: Task
    graph: Graph
    agent: Self
    config: Config
    before: Plan | None


class Outcome(NamedTuple):
    """The goals that are reached, those that are left, and the plan for these, by the costs of
    places and the network that its route leads over.
    """

    reached: list[Goal]
    left: list[Target]
    plan: Plan
    costs: PlaceCosts
    network: PlaceNetwork


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


def planned(situation: Situation, costs: PlaceCosts) -> Outcome:
    """Plan on places of these costs."""
    task, graph, agent, config, before = situation
    network = costs.network()
    plan = Plan(
        id=PLAN_ID,
        base_level=1.0,
        map=agent.map,
        state=PlanState.NO_GOAL,
        planned_ns=task.stamp_ns,
    )

    targets = [target_of(goal, graph, agent, costs, config) for goal in open_goals(graph)]
    here = [target.goal for target in targets if is_at(target, agent, costs, config)]
    reached = [goal for goal in here if is_satisfied(goal, graph, config)]
    at = {goal.id for goal in reached}
    left = [target_of(goal, graph, agent, costs, config) for goal in open_goals(graph, at)]

    def outcome(over: PlaceNetwork = network, **changes: Any) -> Outcome:
        changed = msgspec.structs.replace(plan, **changes)
        return Outcome(reached, left, changed, costs, over)

    # At a goal that serves a need, the agent rests until the need is satisfied.
    if len(reached) < len(here):
        return outcome(state=PlanState.RESTS)
    if has_arrived(graph, at):
        return outcome(state=PlanState.AT_GOAL)

    targets = most_pressing(left)
    start = nearest_free(agent.x_m, agent.y_m, costs, costs.is_free, START_M)
    if start is None:
        unreachable = {target.goal.id: PlanState.BLOCKED for target in targets}
        return outcome(state=PlanState.BLOCKED, unreachable=unreachable)

    is_flat = config.planning == "gradient"
    # Activation spreads from each goal; those at which the agent is not activated have no route.
    found: list[Visit] = []
    unreachable = {}
    links = Links(network) if targets else None
    until = start if len(targets) == 1 else None
    for target in targets:
        if not target.cells:
            unreachable[target.goal.id] = target.state
            continue
        field = spread(network, np.array(target.cells), links, until)
        route = field.ascend(start) if is_flat else field.climb(start)
        if route is None:
            unreachable[target.goal.id] = PlanState.NO_ROUTE
        else:
            found.append(Visit(target.goal, route, field))

    if found:
        ordered = _ordered(found, start, situation, network)
        cells = ordered[0].route
        cost = costs.cost(CostLayer.BESIDE)
        line = cells.astype(np.float64)
        if not is_flat:
            line = straightened(cells, cost, costs.is_clear, network.origin)
        return outcome(
            state=PlanState.READY,
            goals=[visit.goal.id for visit in ordered],
            unreachable=unreachable,
            doubtful=not costs.is_free[tuple((cells - network.origin).T)].all(),
            **_along(line * network.cell_m),
        )

    if config.explore:
        network = costs.known_network()
        field = spread(network, np.array([start]))
        standpoint = Standpoint(start, agent.heading_rad)
        near: Cell | None = None
        if before is not None and before.explores and before.route is not None:
            i, j = _cells(before, costs)[-1].tolist()
            near = (i, j)
        frontier = best_frontier(costs, field, standpoint, config, near)
        back = None if frontier is None else field.climb(frontier.cell)
        if back is not None:
            return outcome(
                network,
                state=PlanState.READY,
                explores=True,
                unreachable=unreachable,
                **_along(back[::-1].astype(np.float64) * network.cell_m),
            )

    state = next(iter(unreachable.values()), PlanState.NO_GOAL)
    return outcome(state=state, unreachable=unreachable)


def answer(outcome: Outcome, situation: Situation) -> Answer:
    """Return the goals that are reached, and the plan, if it is another than before."""
    reached, left, plan, costs, _ = outcome
    task, graph, agent, _, before = situation
    changes = Answer()

    def away_m(cell: Cell) -> float:
        i, j = cell
        return math.hypot(i * costs.grid.cell_m - agent.x_m, j * costs.grid.cell_m - agent.y_m)

    for target in left:
        if not target.cells:
            continue
        place = place_id(*min(target.cells, key=away_m), agent.map)
        if graph.links.target(target.goal.id, LinkKind.AT) != place:
            changes.operations.append(Link(source=target.goal.id, target=place, kind=LinkKind.AT))

    for goal in reached:
        changes.operations.append(as_reached(goal, task.stamp_ns))
        if before is not None and goal.id == next_goal(before):
            changes.events.append(_replay(before, Direction.REVERSE, task, costs))

    if _serves(outcome, situation):
        return changes

    if before is not None and before.route is not None and before.goals[:1] == plan.goals[:1]:
        cells = _left_of(before, agent, costs)
        plan = msgspec.structs.replace(plan, detour_for=_added_m(costs, cells))
    changes.operations.append(plan)
    if plan.goals:
        changes.operations.append(
            Link(source=PLAN_ID, target=next_goal(plan), kind=LinkKind.TOWARDS)
        )
    elif next_goal(before):
        changes.operations.append(
            DropLink(source=PLAN_ID, target=next_goal(before), kind=LinkKind.TOWARDS)
        )
    if plan.route is not None and next_goal(plan) != next_goal(before):
        changes.events.append(_replay(plan, Direction.FORWARD, task, costs))
    return changes


class Visit(NamedTuple):
    """A goal, the (n, 2) cells of the route to it, and the activation that spreads from it."""

    goal: Goal
    route: Indices
    field: Field


def _ordered(
    found: Sequence[Visit], start: Cell, situation: Situation, network: PlaceNetwork
) -> list[Visit]:
    """Return the visits in an order that makes the tour short; in that of the plan before, while it
    is nearly as short. On a flat grid the nearest is always next.
    """
    before = situation.before
    cells = np.array([start, *(visit.route[-1] for visit in found)])
    i, j = (cells - np.array(network.origin)).T
    lengths_m = np.zeros((len(cells), len(cells)))
    for number, visit in enumerate(found, start=1):
        lengths_m[:, number] = visit.field.distance_m[i, j]
        lengths_m[number, :] = lengths_m[:, number]

    if situation.config.planning == "gradient":
        order = follow_activation(lengths_m)
        return [found[number - 1] for number in order.tolist()[1:]]

    order = order_from(lengths_m, cells * network.cell_m, TourSettings())
    names = [visit.goal.id for visit in found]
    if before is not None and set(names) <= set(before.goals):
        numbers = [names.index(name) + 1 for name in before.goals if name in names]
        kept = np.array([0, *numbers])
        max_m = KEEP_ROUTE * route_length(lengths_m, order, closed=False)
        if route_length(lengths_m, kept, closed=False) <= max_m:
            order = kept

    return [found[number - 1] for number in order.tolist()[1:]]


def _along(positions_m: Floats) -> dict[str, Any]:
    """Return a plan's route along (n, 2) positions, and its length, as fields of the plan."""
    length_m = float(np.hypot(*np.diff(positions_m, axis=0).T).sum())
    return {"route": Matrix.of(positions_m.astype(np.float64)), "length_m": length_m}


def _cells(plan: Plan, costs: PlaceCosts) -> Indices:
    """Return the (n, 2) place nodes of a plan's route."""
    assert plan.route is not None
    cells = np.rint(plan.route.numpy() / costs.grid.cell_m)
    return cells.astype(np.int64)


def _left_of(plan: Plan, agent: Self, costs: PlaceCosts) -> Indices:
    """Return the (k, 2) place nodes of a plan's route from where the agent is."""
    assert plan.route is not None
    away_m = np.hypot(*(plan.route.numpy() - (agent.x_m, agent.y_m)).T)
    return _cells(plan, costs)[int(away_m.argmin()) :]


def _serves(outcome: Outcome, situation: Situation) -> bool:
    """Decide whether the plan before leads to the same goals as a new one, nearly as cheaply, from
    where the agent is. At the end of its route it leads nowhere: the place of a goal moves with the
    object on the map.
    """
    _, _, plan, costs, network = outcome
    _, _, agent, config, before = situation
    if before is None or _aim(before) != _aim(plan):
        return False
    if before.route is None or plan.route is None:
        return before.route is plan.route

    away_m = np.hypot(*(before.route.numpy() - (agent.x_m, agent.y_m)).T)
    cells = _cells(plan, costs)
    moved = np.abs(_cells(before, costs)[-1] - cells[-1]).max()
    is_off = away_m.min() > OFF_ROUTE_M
    is_at_end = away_m[-1] <= config.reached_m
    if is_off or is_at_end or moved > SAME_FRONTIER_CELLS // 2:
        return False

    left_m = network.cost_m(_left_of(before, agent, costs))
    return left_m <= KEEP_ROUTE * network.cost_m(cells) + network.cell_m


def _aim(plan: Plan) -> tuple[object, ...]:
    """Return what a plan is to reach, and what it came to."""
    return plan.map, plan.state, plan.explores, plan.doubtful, plan.goals, plan.unreachable


def _added_m(costs: PlaceCosts, cells: Indices) -> dict[CostLayer, float]:
    """Return what each layer by itself adds to a route of (k, 2) cells, in metres of free road."""
    inside = cells - np.array(costs.grid.origin)
    is_inside = ((inside >= 0) & (inside < costs.grid.shape)).all(axis=1)
    i, j = inside[is_inside].T

    added_m = {}
    for layer, factor in costs.layers.items():
        by_layer_m = float((factor[i, j] - 1).sum()) * costs.grid.cell_m
        if by_layer_m >= 1.0:
            added_m[layer] = min(by_layer_m, MAX_DETOUR_M)
    return added_m


def _replay(plan: Plan, direction: Direction, task: Task, costs: PlaceCosts) -> RouteReplay:
    """Return the place nodes of a plan's route, from the agent to the goal or back."""
    cells = _cells(plan, costs)
    if direction is Direction.REVERSE:
        cells = cells[::-1]

    return RouteReplay(
        stamp_ns=task.stamp_ns,
        cycle=task.cycle,
        direction=direction,
        goal=next_goal(plan),
        map=plan.map,
        cells=Array.of(cells, "<i4"),
    )
