"""A log as Rerun reads it, read back by Rerun's own library."""

from __future__ import annotations

import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from cogmap.errors import StorageError, UsageError
from cogmap.graph.graph import Graph
from cogmap.recording import open_log
from cogmap.recording.exporting.rerun import write_rerun
from cogmap.schemas import topics
from cogmap.schemas.nodes import ROOT_MAP, Need, Object
from cogmap.schemas.sensing import View
from tests.support.logs import SECOND_NS, delta, write_log
from tests.support.reference import REFERENCE

Rows = list[dict[str, Any]]


def read(path: Path) -> dict[str, Rows]:
    """What is in a file, but for what is static: the rows of each entity, a value a column."""
    chunks = pytest.importorskip("rerun.chunk")
    found: dict[str, Rows] = defaultdict(list)
    for chunk in chunks.RrdReader(path).stream():
        if not chunk.is_static:
            found[chunk.entity_path.removeprefix("/")] += chunk.to_record_batch().to_pylist()
    return found


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The reference drive for Rerun."""
    pytest.importorskip("rerun")
    written = tmp_path_factory.mktemp("rerun") / "drive.rrd"
    write_rerun(open_log(REFERENCE), written)
    return written


@pytest.fixture(scope="module")
def entities(path: Path) -> dict[str, Rows]:
    return read(path)


@pytest.fixture(scope="module")
def graph() -> Graph:
    log = open_log(REFERENCE)
    return log.graph_at(log.duration_s)


def test_nothing_is_lost(entities: dict[str, Rows], tmp_path: Path) -> None:
    log = open_log(REFERENCE)
    written = write_rerun(log, tmp_path / "again.rrd")

    assert {entity: len(rows) for entity, rows in entities.items()} == written
    camera = [written[f"map/robot/camera/{name}"] for name in ("image", "depth")]
    assert camera == 2 * [log.frame(topics.VIEW).num_rows]
    assert written["map/robot/scan"] == log.frame(topics.SCAN).num_rows
    assert written["truth/robot"] == log.frame(topics.TRUE_POSE).num_rows
    assert written["body/speed_m_s"] == log.frame(topics.ODOMETRY).num_rows


def test_times_are_those_of_the_log(entities: dict[str, Rows]) -> None:
    scans = open_log(REFERENCE).messages(topics.SCAN)
    times_s = [row["time"].total_seconds() for row in entities["map/robot/scan"]]

    assert times_s == pytest.approx([entry.time_s for entry in scans], abs=1e-6)


def test_the_pose_is_that_of_the_agent(entities: dict[str, Rows], graph: Graph) -> None:
    row = entities["map/robot"][-1]
    agent = graph.agent

    assert agent is not None
    (place,) = row["Transform3D:translation"]
    (turn,) = row["Transform3D:rotation_axis_angle"]
    assert place == pytest.approx((agent.x_m, agent.y_m, 0.0))
    assert turn["angle"] == pytest.approx(agent.heading_rad)


def test_images_are_those_of_the_camera(entities: dict[str, Rows]) -> None:
    view = next(iter(open_log(REFERENCE).messages(topics.VIEW))).message
    assert isinstance(view, View)
    (blob,) = entities["map/robot/camera/image"][0]["EncodedImage:blob"]
    image = cv2.imdecode(np.asarray(blob, np.uint8), cv2.IMREAD_COLOR)
    (depth,) = entities["map/robot/camera/depth"][0]["DepthImage:buffer"]

    assert image is not None
    assert image.shape == view.image.shape
    assert bytes(depth) == bytes(view.depth_m.data)


def test_the_map_has_every_object_and_place(entities: dict[str, Rows], graph: Graph) -> None:
    nodes = [node for node in graph.of_kind(Object) if node.map == ROOT_MAP]
    boxes = entities["map/objects"][-1]
    places = entities["map/places"][-1]

    centers = boxes["Boxes3D:centers"] or []
    assert sorted(tuple(center[:2]) for center in centers) == [
        pytest.approx(place_m) for place_m in sorted((node.x_m, node.y_m) for node in nodes)
    ]
    width, height = graph.places.extent(ROOT_MAP).shape
    (data,) = places["GridMap:data"]
    assert len(data) == 4 * width * height
    assert entities["map/path"][-1]["LineStrips3D:strips"]


def test_needs_are_scalars(tmp_path: Path) -> None:
    pytest.importorskip("rerun")
    need = Need(id="need:energy", label="energy", level=0.25)
    log = write_log(tmp_path / "log.mcap", [(SECOND_NS, delta(1, need))])
    write_rerun(open_log(log), tmp_path / "drive.rrd")

    (row,) = read(tmp_path / "drive.rrd")["needs/energy"]
    assert row["Scalars:scalars"] == [0.25]


def test_a_file_that_exists_is_left_alone(path: Path) -> None:
    with pytest.raises(StorageError, match="exists already"):
        write_rerun(open_log(REFERENCE), path)


def test_without_the_library_the_remedy_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)

    with pytest.raises(UsageError, match=r"cogmap\[rerun\]"):
        write_rerun(open_log(REFERENCE), tmp_path / "drive.rrd")
