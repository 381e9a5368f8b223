"""A log as Foxglove reads it, read back by the public libraries of MCAP and protobuf."""

from __future__ import annotations

import json
import math
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from cogmap.errors import UsageError
from cogmap.graph.graph import Graph
from cogmap.recording import open_log
from cogmap.recording.exporting.foxglove import write_foxglove
from cogmap.schemas import topics
from cogmap.schemas.nodes import ROOT_MAP, Need, Object
from cogmap.schemas.sensing import View
from tests.support.logs import SECOND_NS, delta, write_log
from tests.support.reference import REFERENCE


def read(path: Path) -> dict[str, list[Any]]:
    """The messages of a file, decoded, by topic."""
    found = defaultdict(list)
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages():
            found[channel.topic].append(message)
    return found


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The reference drive for Foxglove."""
    written = tmp_path_factory.mktemp("foxglove") / "drive.mcap"
    write_foxglove(open_log(REFERENCE), written)
    return written


@pytest.fixture(scope="module")
def graph() -> Graph:
    log = open_log(REFERENCE)
    return log.graph_at(log.duration_s)


def test_nothing_is_lost(path: Path, tmp_path: Path) -> None:
    written = write_foxglove(open_log(REFERENCE), tmp_path / "again.mcap")
    counts = {topic: len(messages) for topic, messages in read(path).items()}

    assert counts == written
    log = open_log(REFERENCE)
    views = len(list(log.messages(topics.VIEW)))
    assert counts["/camera"] == counts["/depth"] == counts["/camera/calibration"] == views
    assert counts["/scan"] == len(list(log.messages(topics.SCAN)))
    assert counts["/truth"] == len(list(log.messages(topics.TRUE_POSE)))


def test_the_pose_is_that_of_the_agent(path: Path, graph: Graph) -> None:
    pose = read(path)["/pose"][-1].pose
    agent = graph.agent

    assert agent is not None
    assert (pose.position.x, pose.position.y) == pytest.approx((agent.x_m, agent.y_m))
    heading_rad = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
    assert math.remainder(heading_rad - agent.heading_rad, math.tau) == pytest.approx(0, abs=1e-9)


def test_images_are_those_of_the_camera(path: Path) -> None:
    messages = read(path)
    view = next(iter(open_log(REFERENCE).messages(topics.VIEW))).message
    assert isinstance(view, View)
    depth = messages["/depth"][0]
    encoded = np.frombuffer(messages["/camera"][0].data, np.uint8)
    image = cv2.imdecode(encoded, cv2.IMREAD_COLOR)

    assert image is not None
    assert image.shape == view.image.shape
    depth_m = np.frombuffer(depth.data, "<f4").reshape(depth.height, depth.width)
    assert np.array_equal(depth_m, view.depth_m.numpy())
    assert messages["/camera/calibration"][0].K[0] == view.calibration.fx_px


def test_the_map_has_every_object_and_place(path: Path, graph: Graph) -> None:
    messages = read(path)
    entities = messages["/objects"][-1].entities
    nodes = [node for node in graph.of_kind(Object) if node.map == ROOT_MAP]

    assert {entity.id for entity in entities} == {node.id for node in nodes}
    grid = messages["/places"][-1]
    width, height = graph.places.extent(ROOT_MAP).shape
    assert (grid.column_count, len(grid.data)) == (width, 2 * width * height)
    assert messages["/path"][-1].poses


def test_objects_that_were_forgotten_are_deleted(path: Path) -> None:
    shown: set[str] = set()
    for update in read(path)["/objects"]:
        shown -= {each.id for each in update.deletions}
        shown |= {each.id for each in update.entities}

    assert shown == {each.id for each in read(path)["/objects"][-1].entities}


def test_the_chain_of_frames_leads_from_the_map_to_the_camera(path: Path) -> None:
    frames = {(each.parent_frame_id, each.child_frame_id) for each in read(path)["/tf"]}

    assert frames == {("map", "robot"), ("robot", "camera")}


def test_a_file_that_exists_is_left_alone(path: Path) -> None:
    with pytest.raises(UsageError, match="exists already"):
        write_foxglove(open_log(REFERENCE), path)


def test_without_the_library_the_remedy_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "foxglove", None)

    with pytest.raises(UsageError, match=r"cogmap\[foxglove\]"):
        write_foxglove(open_log(REFERENCE), tmp_path / "drive.mcap")


def test_needs_are_json(tmp_path: Path) -> None:
    need = Need(id="need:energy", label="energy", level=0.25)
    log = write_log(tmp_path / "log.mcap", [(SECOND_NS, delta(1, need))])
    write_foxglove(open_log(log), tmp_path / "drive.mcap")

    with (tmp_path / "drive.mcap").open("rb") as file:
        ((_, channel, message),) = make_reader(file).iter_messages()
    assert (channel.topic, channel.message_encoding) == ("/needs", "json")
    assert json.loads(message.data) == {"need": "energy", "level": 0.25}
