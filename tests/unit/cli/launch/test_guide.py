"""A guided tour: exploring, goals, a street that closes, and its end."""

from __future__ import annotations

import msgspec
import numpy as np

from cogmap.cli.launch.guide import Guide, Stage, street_ahead
from cogmap.cli.launch.observer import Observer
from cogmap.graph.graph import Graph
from cogmap.schemas.array import Matrix
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.nodes import PLAN_ID, Goal, Object, Plan, PlanState, object_id
from cogmap.schemas.sensing import Pose, Street, StreetClosure, TruePose, TrueTown
from cogmap.testing import agent

CORNERS = ((0.0, 0.0), (60.0, 0.0), (60.0, 40.0), (0.0, 40.0))
NAMES = ("south", "east", "north", "west")
PLACES = {"bakery": (50.0, -8.0), "school": (0.0, 45.0), "inn": (60.0, 45.0), "bank": (5.0, -8.0)}


def _town() -> TrueTown:
    ends = zip(NAMES, CORNERS, (*CORNERS[1:], CORNERS[0]), strict=True)
    streets = [Street(name=name, line_m=[a, b], width_m=6.0) for name, a, b in ends]
    return TrueTown(seed=1, streets=streets, buildings=[])


def _at(seconds: float) -> TruePose:
    origin = Pose(x_m=0.0, y_m=0.0, heading_rad=0.0)
    return TruePose(stamp_ns=round(seconds * 1e9), pose=origin, travelled_m=0.0, progress=0.0)


def _object(label: str) -> Object:
    x_m, y_m = PLACES[label]
    return Object(id=object_id(label), label=label, x_m=x_m, y_m=y_m, sightings=5)


def _plan(*goals: str, state: PlanState = PlanState.READY) -> Plan:
    places_m = np.column_stack([np.arange(0.0, 56.0), np.zeros(56)])
    route = Matrix.of(places_m) if goals else None
    return Plan(id=PLAN_ID, state=state, goals=[*goals], planned_ns=1, route=route)


class Tour:
    """A guide whose agent knows four buildings and has explored for 10 s."""

    def __init__(self, *goals: Goal, explore_s: float = 100.0) -> None:
        self.guide = Guide(explore_s, goals)
        self.graph = Graph()
        self.graph.change([agent(), *map(_object, PLACES)])
        self._observer = Observer()
        self._observer.update(_town())
        self.at(0.0)
        self.at(10.0)

    def at(self, seconds: float) -> list[Message]:
        """What the guide publishes then."""
        self._observer.update(_at(seconds))
        return self.guide.step(self._observer, self.graph)

    def reach(self, *goals: Goal) -> None:
        """Let the agent have been at these goals."""
        for goal in goals:
            self.graph.change([msgspec.structs.replace(goal, reached_ns=1)])


def _offered(published: list[Message]) -> list[Goal]:
    (offer,) = published
    assert isinstance(offer, Offer)
    return [goal for goal in offer.operations if isinstance(goal, Goal)]


def test_the_agent_explores_for_its_time() -> None:
    tour = Tour()

    assert tour.at(99.0) == []
    assert tour.guide.stage is Stage.EXPLORES
    assert _offered(tour.at(100.0))


def test_it_explores_no_longer_where_nothing_is_left() -> None:
    tour = Tour()
    tour.graph.change([_plan(state=PlanState.NO_GOAL)])

    assert _offered(tour.at(20.0))


def test_the_goals_are_objects_far_from_one_another() -> None:
    goals = _offered(Tour().at(100.0))

    assert {goal.object for goal in goals} == {"inn", "bakery", "school"}


def test_given_goals_are_offered_instead() -> None:
    given = Goal(id="goal:a", x_m=3.0, y_m=0.0)

    assert _offered(Tour(given).at(100.0)) == [given]


def test_a_street_of_the_route_to_the_last_goal_is_closed_once() -> None:
    tour = Tour()
    goals = _offered(tour.at(100.0))
    tour.graph.change([*goals])
    tour.reach(*goals[1:])
    tour.graph.change([_plan(goals[0].id)])

    assert tour.at(101.0) == [StreetClosure(street="south", closed=True)]
    assert tour.guide.stage is Stage.DETOURS
    assert tour.at(102.0) == []


def test_where_the_agent_was_at_every_goal_the_tour_is_complete() -> None:
    tour = Tour()
    goals = _offered(tour.at(100.0))
    tour.graph.change([*goals])
    tour.reach(*goals)
    tour.at(101.0)

    assert tour.guide.stage is Stage.COMPLETE
    assert "every goal" in tour.guide.sentence


def test_a_street_that_alone_leads_on_is_not_closed() -> None:
    town = _town()
    open_ended = msgspec.structs.replace(town, streets=town.streets[:1])
    route_m = np.column_stack([np.arange(60.0), np.zeros(60)])

    assert street_ahead(open_ended, route_m) is None
    found = street_ahead(town, route_m)
    assert found is not None
    assert found.name == "south"
