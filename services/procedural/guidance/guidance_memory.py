"""The guidance schemes of procedural memory: learned, recalled and judged."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from msgspec.structs import replace

from cogmap.schemas.cognition import Action, ActionName, Behaviour, Broadcast, GuidanceScheme
from cogmap.schemas.nodes import Plan, PlanState, Self
from cogmap.services.procedural.guidance.arrivals import Arrivals
from cogmap.services.procedural.guidance.context import SEEN_NS, end_of, fit
from cogmap.services.procedural.guidance.lessons import AHEAD_M, STEP_M, Lessons, Place
from cogmap.services.procedural.patterns import Active

# A bound on memory: 13 s at five views a second.
REMEMBERED_PLACES = 64
# With less, one landmark among many that were missing led the robot astray at the end of its route.
MIN_FIT = 0.25
DRIVING = frozenset({ActionName.FOLLOW_PLAN, ActionName.SEEK})
NAME = "guide_{}"
_NUMBERED = re.compile(r"guide_(\d+)")


class GuidanceMemory:
    """Lets those schemes compete that it was given; those that it learns do once they are given to
    it, for an agent without a goal stands.

    Of more than `limit` that were learned or judged, it forgets the oldest.
    """

    def __init__(
        self,
        given: Sequence[GuidanceScheme],
        limit: int,
        step_m: float = STEP_M,
        ahead_m: float = AHEAD_M,
    ) -> None:
        self._given = {scheme.name: scheme for scheme in given}
        self._kept: dict[str, GuidanceScheme] = {}
        self._limit = limit
        self._lessons = Lessons(step_m, ahead_m)
        self._arrivals = Arrivals()
        self._next_number = number_after(given)
        self._drives = False
        self._places: dict[int, Place] = {}

    @property
    def kept(self) -> list[GuidanceScheme]:
        """Return all schemes that were learned or judged."""
        return list(self._kept.values())

    def restore(self, schemes: Iterable[GuidanceScheme]) -> None:
        """Continue with what was published before."""
        for scheme in schemes:
            self._keep(scheme)
        self._next_number = max(self._next_number, number_after(self.kept))

    def on_action(self, action: Action) -> None:
        """Note that an action is executed, or that the one before continues."""
        if not action.scheme:
            return

        self._drives = action.action in DRIVING
        if action.action != ActionName.GUIDE or action.scheme not in self._given:
            return

        # The agent is awaited where the scheme leads, as seen from where it was.
        end_m = end_of(action.parameters)
        seen_ns = action.parameters.get(SEEN_NS)
        place = self._places.get(seen_ns) if isinstance(seen_ns, int) else None
        if place is not None and end_m is not None:
            self._arrivals.expect(action.scheme, place.out(end_m), action.stamp_ns)

    def on_broadcast(self, broadcast: Broadcast) -> list[GuidanceScheme]:
        """Return the schemes that a broadcast completes, or lets be judged."""
        agent = _agent_of(broadcast)
        if agent is None:
            return []

        place = Place.of(agent)
        self._places[agent.stamp_ns] = place
        while len(self._places) > REMEMBERED_PLACES:
            del self._places[next(iter(self._places))]

        changed = []
        for name, is_success in self._arrivals.judged(place.at_m, broadcast.stamp_ns).items():
            scheme = self._given[name]
            judged = replace(
                scheme,
                executions=scheme.executions + 1,
                successes=scheme.successes + is_success,
            )
            changed.append(judged)

        relations = broadcast.coalition.relations.values()
        for lesson in self._lessons.on_view(agent, relations, self._drives):
            learned = GuidanceScheme(
                name=NAME.format(self._next_number),
                landmarks=lesson.landmarks,
                path_m=[(place_m.real, place_m.imag) for place_m in lesson.path_m],
            )
            self._next_number += 1
            changed.append(learned)

        for scheme in changed:
            self._keep(scheme)
        return changed

    def behaviours(self, broadcast: Broadcast, nodes: Sequence[Active]) -> list[Behaviour]:
        """Return the behaviour of the scheme that fits best, if that is at least MIN_FIT; none if
        the agent has a goal.
        """
        agent = _agent_of(broadcast)
        relations = broadcast.coalition.relations
        plans = [active.node for active in nodes if isinstance(active.node, Plan)]
        has_goal = any(plan.state is not PlanState.NO_GOAL for plan in plans)
        if agent is None or not relations or has_goal:
            return []

        activations = {active.node.id: active.activation for active in nodes}
        fits = [fit(scheme, relations, activations) for scheme in self._given.values()]
        found = [each for each in fits if each is not None and each.activation >= MIN_FIT]
        if not found:
            return []

        best = min(found, key=lambda each: each.rank)
        return [best.behaviour(agent.stamp_ns)]

    def _keep(self, scheme: GuidanceScheme) -> None:
        if scheme.name in self._given:
            self._given[scheme.name] = scheme
        self._kept[scheme.name] = scheme
        while len(self._kept) > self._limit:
            del self._kept[next(iter(self._kept))]


def number_after(schemes: Iterable[GuidanceScheme]) -> int:
    """Return the number after the highest that a scheme has in its name; 1 if none has any."""
    numbers = [0]
    for scheme in schemes:
        match = _NUMBERED.fullmatch(scheme.name)
        if match is not None:
            numbers.append(int(match[1]))
    return max(numbers) + 1


def _agent_of(broadcast: Broadcast) -> Self | None:
    agents = [node for node in broadcast.coalition.nodes if isinstance(node, Self)]
    return agents[0] if agents else None
