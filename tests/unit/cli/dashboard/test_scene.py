"""What a dashboard shows of the reference drive."""

from __future__ import annotations

import base64
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest

from cogmap.cli.dashboard import parts
from cogmap.cli.dashboard.parts import PartName
from cogmap.cli.dashboard.pictures import Pixels
from cogmap.cli.dashboard.received import Arrived
from cogmap.cli.dashboard.scene import FOLLOWED, Scene
from cogmap.graph.graph import Graph
from cogmap.recording import open_log
from cogmap.recording.storage.reader import LogReader
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.graph import Delta
from cogmap.schemas.nodes import Object
from cogmap.schemas.sensing import Percepts, TruePose, View
from cogmap.services.codelets.public import PlanningConfig
from cogmap.services.global_workspace.config import Config
from tests.support.health import report
from tests.support.reference import REFERENCE

SECOND_NS = 10**9


def new_scene() -> Scene:
    graph = Graph()

    def follow(delta: Delta, _incarnation: int | None) -> None:
        graph.apply(delta)

    return Scene(graph, follow, Config(), PlanningConfig(), Path("drive"))


def pixels_of(picture: str, kind: str) -> Pixels:
    """What is in a picture that is its own address."""
    start, content = picture.split(",")
    assert start == f"data:{kind};base64"
    pixels = cv2.imdecode(np.frombuffer(base64.b64decode(content), np.uint8), cv2.IMREAD_UNCHANGED)
    assert pixels is not None
    return np.asarray(pixels, np.uint8)


@pytest.fixture(scope="module")
def scene() -> Scene:
    """The end of the reference drive."""
    reader = LogReader(REFERENCE)
    shown = new_scene()
    for record in reader.records(FOLLOWED):
        arrived = Arrived(reader.message(record), record.envelope, record.log_time_ns)
        shown.take(record.topic, arrived)
    return shown


def test_the_agent_is_where_its_graph_says(scene: Scene) -> None:
    now = scene.part(PartName.NOW)
    agent = scene.graph.agent

    assert isinstance(now, parts.Now)
    assert agent is not None
    assert now.pose == pytest.approx((agent.x_m, agent.y_m, agent.heading_rad), abs=1e-3)
    assert len(now.samples) == 2 * agent.samples.shape[0]
    assert now.cycle == scene.graph.cycle
    assert now.conscious
    assert now.action


def test_its_time_is_that_of_the_drive(scene: Scene) -> None:
    now = scene.part(PartName.NOW)
    newest = open_log(REFERENCE).last(topics.PERCEPTS, lambda _message: True)

    assert isinstance(now, parts.Now)
    assert newest is not None
    assert now.at_s >= newest.message.stamp_ns / 1e9
    assert now.at_s < 60.0


def test_the_map_has_every_object_the_path_and_the_route(scene: Scene) -> None:
    drawn = scene.part(PartName.MAP)

    assert isinstance(drawn, parts.MapPart)
    assert {each.label for each in drawn.objects} == {
        node.label for node in scene.graph.of_kind(Object)
    }
    assert drawn.path
    assert drawn.route
    assert [goal.name for goal in drawn.goals]


def test_the_picture_of_places_is_as_large_as_the_map_says(scene: Scene) -> None:
    for name in (PartName.PLACES, PartName.COSTS):
        layer = scene.part(name)
        assert isinstance(layer, parts.Layer)
        pixels = pixels_of(layer.picture, "image/png")

        height, width, channels = pixels.shape
        cell_m = scene.graph.cell_m()
        assert (width * cell_m, height * cell_m) == (layer.width_m, layer.height_m)
        assert channels == 4
        assert pixels[..., 3].any()


def test_what_driving_costs_covers_the_places_and_blocks_some(scene: Scene) -> None:
    places = scene.part(PartName.PLACES)
    costs = scene.part(PartName.COSTS)
    assert isinstance(places, parts.Layer)
    assert isinstance(costs, parts.Layer)

    assert costs.west_m <= places.west_m
    assert costs.west_m + costs.width_m >= places.west_m + places.width_m
    colours = pixels_of(costs.picture, "image/png").reshape(-1, 4)
    assert len(np.unique(colours, axis=0)) > 2


def test_links_that_are_cut_have_two_ends_each(scene: Scene) -> None:
    cuts = scene.part(PartName.CUTS)

    assert isinstance(cuts, parts.Cuts)
    assert cuts.links
    assert len(cuts.links) % 4 == 0


def test_the_camera_shows_the_newest_view_and_what_was_recognized(scene: Scene) -> None:
    camera = scene.part(PartName.CAMERA)
    view = scene.received.message(topics.VIEW)
    percepts = scene.received.message(topics.PERCEPTS)

    assert isinstance(camera, parts.Camera)
    assert isinstance(view, View)
    assert isinstance(percepts, Percepts)
    assert camera.frame == view.frame
    assert len(camera.seen) == len(percepts.objects)
    depth = scene.part(PartName.DEPTH)
    assert isinstance(depth, parts.Depth)
    for picture in (camera.picture, depth.picture):
        height, width, _ = pixels_of(picture, "image/jpeg").shape
        assert (height, width) == (view.calibration.height_px, view.calibration.width_px)


def test_a_view_without_an_image_has_no_picture() -> None:
    no_image = np.zeros((4, 4, 2), np.uint8)
    reader = LogReader(REFERENCE)
    record = next(reader.records([topics.VIEW]))
    view = reader.message(record)
    assert isinstance(view, View)
    broken = msgspec.structs.replace(view, image=Array.of(no_image))
    shown = new_scene()
    shown.take(topics.VIEW, Arrived(broken, record.envelope, record.log_time_ns))
    camera = shown.part(PartName.CAMERA)

    assert isinstance(camera, parts.Camera)
    assert camera.frame == view.frame
    assert camera.picture == ""


def test_the_mind_shows_competitions_the_schemes_and_every_stage(scene: Scene) -> None:
    mind = scene.part(PartName.MIND)

    assert isinstance(mind, parts.Mind)
    assert any(each.conscious for each in mind.competitions)
    assert sum(each.is_chosen for each in mind.schemes) == 1
    titles = [stage.title for stage in mind.stages]
    assert titles == ["perceived", "workspace", "competition", "conscious", "action", "command"]
    assert all(stage.rows for stage in mind.stages)


def test_latency_is_that_of_the_modules_on_the_way(scene: Scene) -> None:
    system = scene.part(PartName.SYSTEM)

    assert isinstance(system, parts.SystemPart)
    modules = [stage.module for stage in system.stages]
    assert modules[:2] == ["sensory", "epam"]
    assert modules[-1] == "motor"
    assert 0.0 < system.cycle_p50_ms <= system.cycle_max_ms


def test_topics_are_those_of_which_messages_came(scene: Scene) -> None:
    listed = scene.part(PartName.TOPICS)

    assert isinstance(listed, parts.Topics)
    counts = {each.name: each.count for each in listed.topics}
    assert counts["workspace/delta"] == scene.graph.version
    assert "camera/stereo" not in counts


def test_the_true_town_is_in_the_frame_of_the_map(scene: Scene) -> None:
    truth = scene.part(PartName.TRUTH)

    assert isinstance(truth, parts.Truth)
    assert truth.streets
    assert truth.buildings
    assert truth.path[:2] == [0.0, 0.0]


def test_without_the_first_true_pose_the_town_has_names_alone() -> None:
    shown = new_scene()
    for entry in open_log(REFERENCE).messages(topics.TRUE_TOWN, topics.TRUE_POSE):
        if isinstance(entry.message, TruePose) and entry.message.seq == 0:
            continue
        shown.take(topics.of(entry.message), Arrived(entry.message, None, 0))
    streets = shown.part(PartName.STREETS)

    assert isinstance(streets, parts.Streets)
    assert streets.names
    assert shown.part(PartName.TRUTH) == parts.Truth()


def test_every_part_is_there_before_the_first_message() -> None:
    shown = new_scene()

    for name in PartName:
        assert isinstance(shown.part(name), parts.Part)


def test_a_part_has_another_version_when_something_of_it_has_changed() -> None:
    shown = new_scene()
    before = shown.versions.copy()
    shown.take(topics.HEALTH, Arrived(report("epam"), None, 0))

    changed = {name for name in PartName if shown.versions[name] != before[name]}
    assert changed == {PartName.SYSTEM, PartName.TOPICS}


def test_a_process_that_says_nothing_for_long_is_silent() -> None:
    shown = new_scene()
    shown.take(topics.HEALTH, Arrived(report("epam"), None, 0))
    shown.take(topics.HEALTH, Arrived(report("motor"), None, 6 * SECOND_NS))
    system = shown.part(PartName.SYSTEM)

    assert isinstance(system, parts.SystemPart)
    assert [(each.instance, each.is_silent) for each in system.processes] == [
        ("epam", True),
        ("motor", False),
    ]
