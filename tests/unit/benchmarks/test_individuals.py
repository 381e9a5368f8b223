"""The benchmark of individuals: what counts as there, as a wrong closure, as a right name."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from benchmarks.individuals.closures import wrong_closures
from benchmarks.individuals.measure import PLANS, metrics
from benchmarks.individuals.names import judged_names, sure_right_share
from benchmarks.individuals.town import Houses, Town, Visit, visit
from benchmarks.individuals.visitor import Plan, Visitor
from cogmap.cli.launch.individuals.buildings import Buildings
from cogmap.cli.launch.individuals.judge import SEEN_VIEWS, BuildingMetrics
from cogmap.robot import calibration
from cogmap.runtime.module import Module
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import Delta, DropNode, Link, Operation, Phase
from cogmap.schemas.nodes import Goal, LinkKind, LoopClosure, Percept
from cogmap.schemas.sensing import Building, Pose, Street, TruePose, TrueTown
from cogmap.testing import landmark, percept, percepts, stamp_ns

BAKERY_M = (30.0, 10.0)
OTHER_M = (42.0, 10.0)
ORIGIN = np.zeros(3)


def building(name: str, at_m: tuple[float, float]) -> Building:
    pose = Pose(x_m=at_m[0], y_m=at_m[1], heading_rad=0.0)
    return Building(name=name, pose=pose, width_m=8.0, depth_m=6.0, height_m=7.0)


TOWN = TrueTown(
    seed=1,
    streets=[Street(name="street", line_m=[(0.0, 0.0), (60.0, 0.0)], width_m=8.0)],
    buildings=[building("bakery", BAKERY_M), building("shop-1", OTHER_M)],
)


def closure(
    name: str,
    there_m: tuple[float, float],
    here_m: tuple[float, float],
    *,
    by_place: bool = False,
    accepted: bool | None = True,
) -> LoopClosure:
    """Join what was seen at two times, at both from the origin, heading along x."""
    return LoopClosure(
        id=name,
        from_ns=stamp_ns(1),
        to_ns=stamp_ns(2),
        cue=name,
        ahead_m=there_m[0],
        left_m=there_m[1],
        range_m=math.hypot(*here_m),
        bearing_rad=math.atan2(here_m[1], here_m[0]),
        sd_m=0.5,
        sd_rad=0.1 if by_place else 0.0,
        accepted=accepted,
    )


def test_a_closure_is_wrong_if_it_joins_two_buildings() -> None:
    pose_at = {stamp_ns(1): ORIGIN, stamp_ns(2): ORIGIN}
    closures = [
        closure("same", BAKERY_M, (31.0, 11.0)),
        closure("beside", (33.0, 10.0), (39.0, 10.0)),
        closure("rejected", BAKERY_M, OTHER_M, accepted=False),
        closure("not judged", BAKERY_M, OTHER_M, accepted=None),
    ]

    assert wrong_closures(closures, pose_at, Buildings(TOWN)) == (2, 1)


def test_a_closure_by_a_place_is_wrong_if_the_places_are_apart() -> None:
    pose_at = {stamp_ns(1): ORIGIN, stamp_ns(2): np.array([5.0, 0.0, 0.0])}
    near = closure("near", (0.0, 0.0), (0.0, 0.0), by_place=True)
    assert wrong_closures([near], pose_at, Buildings(TOWN)) == (1, 0)

    pose_at[stamp_ns(2)] = np.array([7.0, 0.0, 0.0])
    assert wrong_closures([near], pose_at, Buildings(TOWN)) == (1, 1)


def test_a_taught_name_is_right_if_the_building_there_has_it() -> None:
    def at(name: str, where_m: tuple[float, float], activation: float) -> Message:
        bearing_rad = math.atan2(where_m[1], where_m[0])
        seen = percept(name, bearing_rad, math.hypot(*where_m), activation=activation)
        return percepts(1, seen)

    views = [
        at("bakery", BAKERY_M, 0.95),
        at("bakery", OTHER_M, 0.92),
        at("bakery", (10.0, 40.0), 0.5),
        at("new-building-1", OTHER_M, 0.99),
    ]
    judged = judged_names(views, {stamp_ns(1): ORIGIN}, Buildings(TOWN))

    assert judged == [(0.95, True), (0.92, False), (0.5, False)]
    assert sure_right_share(judged) == 0.5


def test_a_name_is_judged_by_what_the_outline_shows_not_by_where_it_was_placed() -> None:
    camera = calibration()
    bakery_px = round(camera.cx_px - camera.fx_px * BAKERY_M[1] / BAKERY_M[0])
    horizon_px = round(camera.cy_px)
    outline_px = [
        (bakery_px - 5, horizon_px - 10),
        (bakery_px + 5, horizon_px - 10),
        (bakery_px + 5, horizon_px + 5),
        (bakery_px - 5, horizon_px + 5),
    ]
    beyond = percept("bakery", math.atan2(OTHER_M[1], OTHER_M[0]), math.hypot(*OTHER_M))
    beyond = msgspec.structs.replace(beyond, outline_px=outline_px)
    view = msgspec.structs.replace(percepts(1, beyond), calibration=camera)

    ((_, is_right),) = judged_names([view], {stamp_ns(1): ORIGIN}, Buildings(TOWN))

    assert is_right


class Drive:
    """Feeds a visitor with a robot that stands on the street before the bakery."""

    def __init__(self, plan: Plan) -> None:
        self.visitor = Visitor(1, plan)
        self.module: Module = self.visitor.watching()
        self.frame = 0
        self.version = 0
        self.module.feed(TOWN)

    def pose(self, x_m: float = 0.0) -> list[Operation]:
        """Return the operations that are offered at the next pose."""
        self.frame += 1
        pose = Pose(x_m=x_m, y_m=0.0, heading_rad=0.0)
        true = TruePose(stamp_ns=stamp_ns(self.frame), pose=pose, travelled_m=0.0, progress=0.0)
        offered = self.module.feed(true)
        return [each for offer in offered if isinstance(offer, Offer) for each in offer.operations]

    def see_bakery(self) -> None:
        """See it SEEN_VIEWS times."""
        bearing_rad = math.atan2(BAKERY_M[1], BAKERY_M[0])
        for _ in range(SEEN_VIEWS):
            self.pose()
            seen = percept("new-building-1", bearing_rad, math.hypot(*BAKERY_M))
            self.module.feed(percepts(self.frame, seen))

    def commit(self, *operations: Operation) -> None:
        self.version += 1
        delta = Delta(
            stamp_ns=stamp_ns(self.frame),
            version=self.version,
            cycle=1,
            phase=Phase.OBJECTS,
            operations=list(operations),
        )
        self.module.feed(delta)


EXPLORE_S = stamp_ns(SEEN_VIEWS + 1) / 1e9


def explored(drive: Drive) -> list[Operation]:
    """Let the agent put the bakery on its map, and return what is offered after exploring."""
    drive.see_bakery()
    node = Percept(id="p", label="p", bearing_rad=math.atan2(10, 30), range_m=math.hypot(30, 10))
    known = landmark("new-building-1", [BAKERY_M])
    drive.commit(known, node, Link(source="p", target=known.id, kind=LinkKind.INSTANCE))
    return drive.pose()


def test_the_agent_is_sent_to_a_building_by_the_name_that_it_has_on_its_map() -> None:
    drive = Drive(Plan(EXPLORE_S, goals=1))
    (goal,) = explored(drive)
    assert isinstance(goal, Goal)
    assert goal.object == "new-building-1"

    drive.commit(goal)
    assert drive.pose(x_m=20.0) == []
    drive.commit(goal, Goal(id=goal.id, object=goal.object, reached_ns=1))
    assert drive.pose(x_m=28.0) == [DropNode(id=goal.id)]
    assert drive.visitor.reached == [True]
    assert drive.visitor.is_over


def test_an_agent_that_only_believes_to_be_there_has_not_reached_it() -> None:
    drive = Drive(Plan(EXPLORE_S, goals=1))
    (goal,) = explored(drive)
    assert isinstance(goal, Goal)

    drive.commit(Goal(id=goal.id, object=goal.object, reached_ns=1))
    drive.pose(x_m=5.0)
    assert drive.visitor.reached == [False]


def test_a_building_that_is_not_on_the_map_is_not_reached() -> None:
    drive = Drive(Plan(EXPLORE_S, goals=1))
    drive.see_bakery()

    assert drive.pose() == []
    assert drive.visitor.reached == [False]
    assert drive.visitor.is_over


def test_a_visit_of_equal_houses_is_judged_at_the_level_of_percepts() -> None:
    town = visit(Visit(7, Houses.EQUAL, Plan(explore_s=4.0)))

    assert town.drive_s == pytest.approx(4.0)
    assert town.explored.seen > 0
    assert town.explored.given <= town.explored.percepts
    assert town.names == []


def found(**facts: int | float) -> BuildingMetrics:
    usual: dict[str, int | float] = {
        "seen": 10,
        "on_map": 10,
        "right": 10,
        "error_median_m": 1.0,
        "missing": 0,
        "doubled": 0,
        "strays": 0,
        "glimpsed": 0,
        "percepts": 100,
        "given": 80,
        "pure": 60,
    }
    return BuildingMetrics(**(usual | facts))


def town(houses: Houses, buildings: BuildingMetrics, **facts: object) -> Town:
    usual: dict[str, object] = {
        "explored": buildings,
        "final": buildings,
        "reached": [True, False],
        "names": [(0.95, True), (0.5, False)],
        "estimate_m": 1.0,
        "fused_m": 4.0,
        "closures": 3,
        "wrong_closures": 1,
        "drive_s": 600.0,
        "wall_s": 60.0,
    }
    return Town(visit=Visit(1, houses, PLANS[houses]), **(usual | facts))


def test_the_metrics_of_buildings_are_of_the_towns_together() -> None:
    towns = [
        town(Houses.NEVER_TAUGHT, found()),
        town(Houses.NEVER_TAUGHT, found(seen=30, on_map=20, right=5, error_median_m=3.0)),
        town(Houses.MIXED, found()),
        town(Houses.EQUAL, found(on_map=12)),
    ]
    measured = metrics(towns)

    assert measured["individuals_per_building"] == pytest.approx(30 / 40)
    assert measured["right_share"] == pytest.approx(15 / 30)
    assert measured["error_median_m"] == pytest.approx(2.0)
    assert measured["percept_purity"] == pytest.approx(0.75)
    assert measured["goals_reached_share"] == pytest.approx(0.5)
    assert measured["error_over_fused"] == pytest.approx(0.25)
    assert measured["equal_individuals_per_building"] == pytest.approx(1.2)
    assert measured["sure_right_share"] == 1.0
    assert measured["wrong_closures"] == 1.0
