"""A guided tour: exploring, goals, a street that closes, and its end."""

from __future__ import annotations

import msgspec
import numpy as np

from cli.launch.guide import Guide, Stage, street_ahead
from schemas.array import Matrix
from schemas.base import Message
from schemas.codelets import Offer
from schemas.nodes import PLAN_ID, Goal, Object, Plan, PlanState, object_id
from schemas.sensing import Pose, Street, StreetClosure, TruePose, TrueTown
from tests.support.world.scenes import agent

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


def _guide() -> Guide:
    """A guide whose agent knows four buildings and has explored for 10 s."""
    guide = Guide(100.0, closes_street=True)
    guide.graph.change([agent(), *map(_object, PLACES)])
    guide.on_town(_town())
    guide.on_pose(_at(0.0))
    guide.on_pose(_at(10.0))
    return guide


def _offered(published: list[Message]) -> list[Goal]:
    (offer,) = published
    assert isinstance(offer, Offer)
    return [goal for goal in offer.operations if isinstance(goal, Goal)]


def _reach(guide: Guide, *goals: Goal) -> None:
    for goal in goals:
        guide.graph.change([msgspec.structs.replace(goal, reached_ns=1)])


def test_the_agent_explores_for_its_time() -> None:
    guide = _guide()

    assert guide.on_pose(_at(99.0)) == []
    assert guide.stage is Stage.EXPLORES
    assert _offered(guide.on_pose(_at(100.0)))


def test_it_explores_no_longer_where_nothing_is_left() -> None:
    guide = _guide()
    guide.graph.change([_plan(state=PlanState.NO_GOAL)])

    assert _offered(guide.on_pose(_at(20.0)))


def test_the_goals_are_objects_far_from_one_another() -> None:
    goals = _offered(_guide().on_pose(_at(100.0)))

    assert {goal.object for goal in goals} == {"inn", "bakery", "school"}


def test_given_goals_are_offered_instead() -> None:
    given = Goal(id="goal:a", x_m=3.0, y_m=0.0)
    guide = Guide(0.0, [given])
    guide.graph.change([agent()])

    assert _offered(guide.on_pose(_at(0.0))) == [given]


def test_a_street_of_the_route_to_the_last_goal_is_closed_once() -> None:
    guide = _guide()
    goals = _offered(guide.on_pose(_at(100.0)))
    guide.graph.change([*goals])
    _reach(guide, *goals[1:])
    guide.graph.change([_plan(goals[0].id)])

    assert guide.on_pose(_at(101.0)) == [StreetClosure(street="south", closed=True)]
    assert guide.stage is Stage.DETOURS
    assert guide.on_pose(_at(102.0)) == []


def test_where_the_agent_was_at_every_goal_the_tour_is_complete() -> None:
    guide = _guide()
    goals = _offered(guide.on_pose(_at(100.0)))
    guide.graph.change([*goals])
    _reach(guide, *goals)
    guide.on_pose(_at(101.0))

    assert guide.stage is Stage.COMPLETE
    assert "every goal" in guide.sentence


def test_a_street_that_alone_leads_on_is_not_closed() -> None:
    town = _town()
    open_ended = msgspec.structs.replace(town, streets=town.streets[:1])
    route_m = np.column_stack([np.arange(60.0), np.zeros(60)])

    assert street_ahead(open_ended, route_m) is None
    found = street_ahead(town, route_m)
    assert found is not None
    assert found.name == "south"
