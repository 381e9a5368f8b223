"""The objects of a map are judged by the true buildings that their percepts show."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from cogmap.bus.codec import Envelope
from cogmap.cli.launch.drive_metrics import drive_metrics, headline
from cogmap.cli.launch.individuals.buildings import NOTHING, Buildings
from cogmap.cli.launch.individuals.judge import SEEN_VIEWS, BuildingMetrics
from cogmap.cli.launch.individuals.percepts import MAX_OLDER_SIGHTS, MAX_SIGHTS, PerceptTally
from cogmap.cli.launch.tally import Tally
from cogmap.errors import NoAnswerError
from cogmap.graph.graph import Graph
from cogmap.graph.replica import Fetched, Replica
from cogmap.robot import calibration
from cogmap.schemas.graph import Delta, DropNode, Link, Links, Operation, Phase, SnapshotRequest
from cogmap.schemas.nodes import LinkKind, Object, Percept
from cogmap.schemas.sensing import Building, Calibration, Pose, TruePose, TrueTown
from cogmap.testing import agent, landmark, percept, percepts, stamp_ns

START = Pose(x_m=100.0, y_m=50.0, heading_rad=math.pi / 2)
"""The map's frame is that of the start: ahead is north in the world."""

INN_M = (100.0, 70.0)
MILL_M = (112.0, 70.0)
ENVELOPE = Envelope("test", 0, 1, 0, 0)


def building(name: str, at_m: tuple[float, float]) -> Building:
    pose = Pose(x_m=at_m[0], y_m=at_m[1], heading_rad=0.0)
    return Building(name=name, pose=pose, width_m=8.0, depth_m=6.0, height_m=7.0)


TOWN = TrueTown(seed=1, streets=[], buildings=[building("inn", INN_M), building("mill", MILL_M)])


def no_snapshot(_request: SnapshotRequest) -> Fetched:
    raise NoAnswerError("nobody answers")


class Drive:
    """Stands at the start and sees what it is told to, one view after the other."""

    def __init__(self, town: TrueTown | None = TOWN) -> None:
        self.tally = Tally(Replica(no_snapshot, Graph()))
        self.frame = 0
        self.version = 0
        if town is not None:
            self.tally.update(town, ENVELOPE, 0)

    def view(self, *seen: tuple[str, tuple[float, float], str]) -> None:
        """See each percept (its id, where it lies in the world) and give it to an object, if that
        has a name.
        """
        self.frame += 1
        now_ns = stamp_ns(self.frame)
        true = TruePose(stamp_ns=now_ns, pose=START, travelled_m=0.0, progress=0.1)
        self.tally.update(true, ENVELOPE, 0)

        operations: list[Operation] = [agent()]
        weights = {}
        perceived = []
        for name, (x_m, y_m), target in seen:
            to_x_m = x_m - START.x_m
            to_y_m = y_m - START.y_m
            node = Percept(
                id=name,
                label=name,
                activation=1.0,
                bearing_rad=math.atan2(to_y_m, to_x_m) - START.heading_rad,
                range_m=math.hypot(to_x_m, to_y_m),
            )
            operations.append(node)
            perceived.append(percept(name, node.bearing_rad, node.range_m))
            if target:
                weights[name] = {target: 1.0}

        self.tally.update(percepts(self.frame, *perceived), ENVELOPE, 0)
        self.commit(*operations, Links(kind=LinkKind.INSTANCE, weights=weights))

    def commit(self, *operations: Operation, phase: Phase = Phase.PERCEPTS) -> None:
        self.version += 1
        delta = Delta(
            stamp_ns=stamp_ns(self.frame),
            version=self.version,
            cycle=self.frame,
            phase=phase,
            operations=list(operations),
        )
        self.tally.update(delta, ENVELOPE, 0)

    @property
    def buildings(self) -> BuildingMetrics:
        found = drive_metrics(self.tally, {}, {}).buildings
        assert found is not None
        return found


def an_object(name: str, world_m: tuple[float, float]) -> Object:
    """Make an object that stands there in the world, by the map's frame."""
    ahead_m = world_m[1] - START.y_m
    left_m = START.x_m - world_m[0]
    return landmark(name, [(ahead_m, left_m)])


def test_a_place_shows_the_building_that_it_is_in_or_next_to() -> None:
    buildings = Buildings(TOWN)

    points_m = np.array([INN_M, (104.5, 70.0), (107.5, 70.0), (100.0, 75.9), (100.0, 76.1)])
    assert buildings.shown_at(points_m).tolist() == [0, 0, 1, 0, NOTHING]


def test_a_building_with_an_outline_is_where_that_is() -> None:
    corner = Building(
        name="corner",
        pose=Pose(x_m=5.0, y_m=5.0, heading_rad=0.0),
        width_m=20.0,
        depth_m=20.0,
        height_m=5.0,
        outline_m=[(0, 0), (20, 0), (20, 2), (2, 2), (2, 20), (0, 20)],
    )
    buildings = Buildings(TrueTown(seed=1, streets=[], buildings=[corner]))

    shown = buildings.shown_at(np.array([(1.0, 1.0), (1.0, 19.0), (12.0, 12.0)]))
    assert shown.tolist() == [0, 0, NOTHING]


@pytest.mark.parametrize(
    ("heading_rad", "column", "row", "shown"),
    [
        (math.pi / 2, 50, 62, "near"),
        (math.pi / 2, 50, 45, "near"),
        (math.pi / 2, 50, 40, "behind"),
        (0.0, 50, 40, "near"),
        (0.0, 68, 45, "behind"),
    ],
    ids=["wall", "slope", "above the ridge", "gable", "beside the gable's top"],
)
def test_what_shows_above_the_eaves_of_a_roof_is_the_building_behind_it(
    heading_rad: float, column: int, row: int, shown: str
) -> None:
    """The robot looks along x at eaves 4 m high, 17 m ahead, or at a gable of 6.5 m, 16 m ahead."""
    camera = Calibration(
        width_px=100,
        height_px=100,
        fx_px=100.0,
        fy_px=100.0,
        cx_px=50.0,
        cy_px=70.0,
        baseline_m=0.1,
        mount_forward_m=0.0,
        mount_height_m=1.0,
    )
    near = msgspec.structs.replace(
        building("near", (20.0, 0.0)),
        pose=Pose(x_m=20.0, y_m=0.0, heading_rad=heading_rad),
        height_m=6.5,
        roof_rise_m=2.5,
    )
    behind = msgspec.structs.replace(building("behind", (40.0, 0.0)), depth_m=20.0, height_m=30.0)
    buildings = Buildings(TrueTown(seed=1, streets=[], buildings=[near, behind]))
    left, right = column - 1, column + 1
    outline_px = [(left, row - 1), (right, row - 1), (right, row + 1), (left, row + 1)]

    number = buildings.shown_in(np.zeros(3), outline_px, camera)

    assert buildings.names[number] == shown


def test_an_object_is_the_building_that_most_of_its_percepts_show() -> None:
    drive = Drive()
    drive.commit(an_object("a", (101.0, 70.0)), phase=Phase.OBJECTS)
    for _ in range(SEEN_VIEWS):
        drive.view(("p", INN_M, "object:a"))
    for _ in range(SEEN_VIEWS - 1):
        drive.view(("p", MILL_M, "object:a"))

    found = drive.buildings
    assert (found.seen, found.on_map, found.right) == (1, 1, 1)
    assert found.error_median_m == pytest.approx(1.0)
    assert (found.percepts, found.given, found.pure) == (
        2 * SEEN_VIEWS - 1,
        2 * SEEN_VIEWS - 1,
        SEEN_VIEWS,
    )


def test_two_objects_of_one_building_are_two_on_the_map() -> None:
    drive = Drive()
    drive.commit(an_object("a", INN_M), an_object("b", (103.5, 70.0)), phase=Phase.OBJECTS)
    for _ in range(SEEN_VIEWS):
        drive.view(("p", INN_M, "object:a"))
        drive.view(("p", INN_M, "object:b"))

    found = drive.buildings
    assert (found.seen, found.on_map, found.right, found.doubled) == (1, 2, 1, 1)


def test_a_building_that_is_on_the_map_no_more_is_missing() -> None:
    drive = Drive()
    drive.commit(an_object("a", INN_M), an_object("b", MILL_M), phase=Phase.OBJECTS)
    for _ in range(SEEN_VIEWS):
        drive.view(("p", INN_M, "object:a"), ("q", MILL_M, "object:b"))
    drive.commit(DropNode(id="object:b"))

    found = drive.buildings
    assert (found.seen, found.on_map, found.missing) == (2, 1, 1)


def test_an_object_whose_percepts_show_nothing_is_on_the_map_and_never_right() -> None:
    drive = Drive()
    drive.commit(an_object("a", INN_M), phase=Phase.OBJECTS)
    for _ in range(SEEN_VIEWS):
        drive.view(("p", (60.0, 60.0), "object:a"))

    found = drive.buildings
    assert (found.seen, found.on_map, found.right, found.strays) == (0, 1, 0, 1)
    assert found.pure == 0


def test_a_building_seen_in_few_views_is_not_asked_for() -> None:
    drive = Drive()
    drive.commit(an_object("a", INN_M), phase=Phase.OBJECTS)
    for _ in range(SEEN_VIEWS - 1):
        drive.view(("p", INN_M, "object:a"))

    found = drive.buildings
    assert (found.seen, found.on_map, found.glimpsed) == (0, 0, 1)


def test_a_building_that_perception_shows_is_seen_though_it_never_entered_the_graph() -> None:
    drive = Drive()
    for _ in range(SEEN_VIEWS):
        drive.view(("p", INN_M, ""))

    found = drive.buildings
    assert (found.seen, found.on_map, found.missing, found.given) == (1, 0, 1, 0)
    assert headline(drive_metrics(drive.tally, {}, {})) == (
        "0 on the map for 1 seen in 10 views or more"
    )


def test_a_percept_that_is_linked_later_in_its_cycle_counts() -> None:
    drive = Drive()
    drive.commit(an_object("a", INN_M), phase=Phase.OBJECTS)
    drive.view(("p", INN_M, ""))
    drive.commit(Link(source="p", target="object:a", kind=LinkKind.INSTANCE), phase=Phase.OBJECTS)

    assert (drive.buildings.given, drive.buildings.pure) == (1, 1)


def test_an_object_that_enters_the_map_is_given_the_percept_of_its_label() -> None:
    drive = Drive()
    drive.view(("p", INN_M, ""), ("q", MILL_M, ""))
    drive.commit(an_object("q", (112.5, 70.0)), phase=Phase.OBJECTS)

    assert [sight.object for sight in drive.tally.percepts.entered] == ["", "object:q"]


def test_objects_of_a_recalled_map_are_not_judged() -> None:
    drive = Drive()
    drive.view(("p", INN_M, ""))
    drive.commit(an_object("p", INN_M), phase=Phase.CORRECTION)

    assert drive.buildings.glimpsed == 0
    assert drive.buildings.given == 0


def test_the_headline_tells_what_is_right_of_what_was_seen() -> None:
    drive = Drive()
    drive.commit(an_object("a", (102.0, 70.0)), an_object("b", (117.0, 70.0)), phase=Phase.OBJECTS)
    for _ in range(SEEN_VIEWS):
        drive.view(("p", INN_M, "object:a"), ("q", MILL_M, "object:b"))

    assert headline(drive_metrics(drive.tally, {}, {})) == (
        "2 on the map for 2 seen in 10 views or more; 1 of them right within 3 m, "
        "3.50 m off in the median"
    )


def test_without_the_true_town_the_headline_claims_nothing() -> None:
    drive = Drive(town=None)
    drive.commit(an_object("a", INN_M), phase=Phase.OBJECTS)
    metrics = drive_metrics(drive.tally, {}, {})

    assert metrics.buildings is None
    assert headline(metrics) == "1 on the map; the true ones are not known"


def test_a_percept_of_a_camera_shows_what_most_of_its_outline_does() -> None:
    """From 20 m south of the inn: its gable, and a tall tower behind it that looks over it."""
    tower = msgspec.structs.replace(building("tower", (100.0, 90.0)), height_m=18.0)
    buildings = Buildings(TrueTown(seed=1, streets=[], buildings=[*TOWN.buildings, tower]))
    pose = np.array([100.0, 50.0, math.pi / 2])
    camera = calibration()

    def shown(top_px: int, bottom_px: int) -> int:
        outline_px = [(155, top_px), (165, top_px), (165, bottom_px), (155, bottom_px)]
        return buildings.shown_in(pose, outline_px, camera)

    horizon_px = round(camera.cy_px)
    assert shown(horizon_px - 20, horizon_px + 5) == 0
    assert shown(horizon_px - 85, horizon_px - 70) == 2
    assert shown(0, 10) == NOTHING


def test_an_outline_without_an_area_shows_nothing() -> None:
    pose = np.array([100.0, 50.0, math.pi / 2])

    assert Buildings(TOWN).shown_in(pose, [(150, 100), (160, 100)], calibration()) == NOTHING


def test_a_percept_has_its_outline_whichever_of_two_messages_comes_first() -> None:
    outline_px = [(0, 0), (4, 0), (4, 4)]
    node = Percept(id="inn", label="inn", activation=1.0, bearing_rad=0.1, range_m=12.0)
    delta = Delta(stamp_ns=stamp_ns(1), version=1, cycle=1, phase=Phase.PERCEPTS, operations=[node])
    view = percepts(1, percept("inn", 0.1, 12.0, outline_px=outline_px))

    for messages in ((view, delta), (delta, view)):
        tally = PerceptTally()
        for message in messages:
            tally.update(message)

        (entered,) = tally.entered
        assert list(entered.outline_px) == outline_px


def test_of_a_long_drive_the_last_percepts_are_kept() -> None:
    tally = PerceptTally()
    in_a_view = 64
    views = 3 * MAX_SIGHTS // in_a_view
    seen = [percept("inn", bearing_rad, 12.0) for bearing_rad in np.linspace(-1.0, 1.0, in_a_view)]
    for frame in range(views):
        tally.update(percepts(frame, *seen))

    assert MAX_SIGHTS <= len(tally.seen) <= MAX_SIGHTS + MAX_OLDER_SIGHTS
    assert tally.seen[-1].stamp_ns == stamp_ns(views - 1)
