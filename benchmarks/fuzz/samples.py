"""Small files of every format that is read, as they should be."""

from __future__ import annotations

import bz2
import gzip
import lzma
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np

from cogmap.bus.codec import Envelope, decode, encode
from cogmap.recording.storage.writer import LogWriter
from cogmap.runtime.state.database import Database
from cogmap.runtime.state.journal import Journal
from cogmap.runtime.state.published import PublishedCounts
from cogmap.runtime.state.record import Record
from cogmap.schemas import topics
from cogmap.schemas.examples import GOLDEN

Files = dict[str, bytes]
"""The content of files by their names within a folder."""

OSM = """<?xml version="1.0" encoding="UTF-8"?>
<osm version="0.6">
  <node id="1" lat="48.40" lon="15.60"><tag k="name" v="Café"/></node>
  <node id="2" lat="48.40" lon="15.61"/>
  <node id="3" lat="48.41" lon="15.61" action="delete"/>
  <node id="4" lat="48.41" lon="15.60" version="2"/>
  <way id="7"><nd ref="1"/><nd ref="2"/><nd ref="4"/><tag k="highway" v="residential"/></way>
  <way id="8"><nd ref="1"/><nd ref="4"/><nd ref="2"/></way>
  <relation id="5"><member type="way" ref="8" role="outer"/>
    <tag k="type" v="multipolygon"/><tag k="building" v="school"/></relation>
</osm>
"""
STREETS = (
    '{"city": "Krems", "nodes_lonlat": [[15.6, 48.4], [15.61, 48.4]], "edges": [[0, 1, 740.0, '
    '"residential", "Long Street", [[15.6, 48.4], [15.605, 48.401], [15.61, 48.4]]]]}\n'
)
TSP = (
    "NAME : a\nTYPE : TSP\nDIMENSION : 3\nEDGE_WEIGHT_TYPE : EUC_2D\nNODE_COORD_SECTION\n"
    "1 0 0\n2 3 0\n3 3 4\nEOF\n"
)
TOUR = "NAME : a\nTYPE : TOUR\nDIMENSION : 3\nTOUR_SECTION\n1\n3\n2\n-1\nEOF\n"
G2O = (
    "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1.5 -2 0.25\nVERTEX_SE2 2 3 -2 0.25\nFIX 0\n"
    "EDGE_SE2 0 1 1 2 0.5 11 12 13 22 23 33\nEDGE_SE2 2 1 -1 2 0.5 11 0 0 22 0 33\n"
)
TORO = "VERTEX2 0 0 0 0\nVERTEX2 7 1.1 2.1 0.5\nEDGE2 0 7 1 2 0.5 11 12 22 33 13 23\n"
GRID = "type octile\nheight 2\nwidth 3\nmap\n.G@\nTS.\n"
ROUTES = "version 1\n0\ta.map\t3\t2\t0\t0\t2\t1\t2.41421356\n"
MRCLAM = {
    "Barcodes.dat": "# Subject # Barcode #\n1 5\n6 63\n7 25\n",
    "Landmark_Groundtruth.dat": "# Subject x y sd sd\n6 1.0 -2.0 0.0 0.0\n7 0.5 4.0 0.0 0.0\n",
    "Robot1_Odometry.dat": "# Time v w\n10.0 0.1 0.0\n10.5 0.2 -0.1\n",
    "Robot1_Measurement.dat": "# Time barcode r b\n10.2 63 2.0 0.1\n10.3 5 1.0 0.0\n",
    "Robot1_Groundtruth.dat": "# Time x y o\n10.0 0.0 0.0 0.0\n10.5 0.1 0.0 0.0\n",
}
TREES = {
    "odometry.csv": "t_s,speed_m_s,turn_rate_rad_s\n1.0,2.0,0.0\n1.1,2.0,0.1\n",
    "trees.csv": "t_s,range_m,bearing_rad,diameter_m\n1.05,6.22,0.0,0.4\n1.05,5.0,1.0,0.3\n",
    "gps.csv": "t_s,x_m,y_m\n1.0,-3.0,4.0\n",
}
BEACONS = {
    "odometry.csv": "t_s,distance_m,turn_rad\n1.0,0.2,0.0\n1.2,0.2,0.01\n",
    "ranges.csv": "t_s,beacon,range_m\n1.2,5,40.0\n1.1,1,20.0\n",
    "truth.csv": "t_s,x_m,y_m,heading_rad\n1.0,0.0,0.0,0.0\n1.2,0.2,0.0,0.01\n",
    "beacons.csv": "beacon,x_m,y_m\n1,20.0,0.0\n5,0.0,40.0\n",
}
MATRIX = "350 0 30 {} 0 350 20 0 0 0 1 0"
SENSOR = """sensor_type: camera
T_BS:
  cols: 4
  rows: 4
  data: [0.0, 0.0, 1.0, 0.3, -1.0, 0.0, 0.0, {}, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
resolution: [60, 40]
camera_model: pinhole
intrinsics: [55.0, 55.0, 29.5, 19.5]
distortion_model: radial-tangential
distortion_coefficients: [-0.05, 0.01, 0.0, 0.0]
"""
CAMERA = (
    "rate_hz = 10.0\nfx_px = 55.0\nfy_px = 55.0\ncx_px = 29.5\ncy_px = 19.5\nbaseline_m = 0.11\n"
    "mount_height_m = 1.2\nleft_distortion = [-0.28, 0.07, 0.0, 0.0, 0.0]\n"
)
SETTINGS = (
    '[run]\nlockstep = true\n[sim]\nseed = 3\ntown = "blocks"\nduration_s = 12.5\n'
    '[workspace]\ncell_m = 0.5\n[[workspace.goals]]\nname = "a"\nx_m = 3.0\ny_m = 4.0\n'
)
GOALS = "bakery\ntown hall\n12.5 -3\n"


def encoded(files: dict[str, str]) -> Files:
    """Return texts as they are in files."""
    return {name: text.encode() for name, text in files.items()}


def picture(suffix: str = ".png") -> bytes:
    """Return a picture of 60 by 40 pixels."""
    pixels = np.random.default_rng(0).integers(0, 256, (40, 60), np.uint8)
    return bytes(cv2.imencode(suffix, pixels)[1].tobytes())


def kitti() -> Files:
    """Return a KITTI sequence of two pairs."""
    poses = "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 1\n"
    camera = f"P0: {MATRIX.format(0)}\nP1: {MATRIX.format(-189)}\nTr: 1 0 0 0\n"
    texts = {"calib.txt": camera, "times.txt": "0.0\n1.036e-01\n", "poses.txt": poses}
    pictures = [f"image_{side}/{number:06}.png" for side in (0, 1) for number in (0, 1)]
    return encoded(texts) | dict.fromkeys(pictures, picture())


def euroc() -> Files:
    """Return a EuRoC sequence of two pairs."""
    files: Files = {}
    for camera, left_m in (("cam0", 0.0), ("cam1", -0.11)):
        folder = f"mav0/{camera}"
        files[f"{folder}/sensor.yaml"] = SENSOR.format(left_m).encode()
        files[f"{folder}/data.csv"] = b"#timestamp [ns],filename\n100,100.png\n200,200.png\n"
        files |= dict.fromkeys((f"{folder}/data/100.png", f"{folder}/data/200.png"), picture())
    truth = "#t, x, y, z, w, x, y, z\n100,0,0,0,1,0,0,0\n200,1,0,0,1,0,0,0\n"
    return files | {"mav0/state_groundtruth_estimate0/data.csv": truth.encode()}


def images() -> Files:
    """Return a folder of pictures with camera.toml."""
    files = encoded({"camera.toml": CAMERA, "times.txt": "0.0\n0.1\n"})
    for side in ("left", "right"):
        files |= {f"{side}/1.png": picture(), f"{side}/2.jpg": picture(".jpg")}
    return files


def made(name: str, make: Callable[[Path], object]) -> Files:
    """Return the files that `make` writes at a path of that name, in a folder of its own."""
    with tempfile.TemporaryDirectory() as folder:
        make(Path(folder) / name)
        return {
            str(path.relative_to(folder)): path.read_bytes()
            for path in sorted(Path(folder).rglob("*"))
            if path.is_file()
        }


def log(path: Path) -> None:
    """Write a log that has a message on every topic that belongs in one."""
    recorded = [each for each in topics.ALL if each.keep_in_log]
    writer = LogWriter(path, recorded, {"agent": "a", "config": "{}"})
    for number, topic in enumerate(recorded):
        payload = golden(topic)
        message = decode(topic, payload)
        envelope = Envelope(message.source, message.seq, 1, 5, 5)
        writer.write(topic, payload, envelope, 1_000_000 * number)
    writer.close()


def golden(topic: topics.Topic) -> bytes:
    """Return the bytes of the example of a topic."""
    return (GOLDEN / f"{topic.file_stem}.msgpack").read_bytes()


def journal(path: Path) -> None:
    """Write a journal of a few messages."""
    written = Journal(path)
    for topic in (topics.DELTA, topics.MOTOR_COMMAND, topics.OFFER):
        message = decode(topic, golden(topic))
        written.append(message, encode(message))
    written.close()


def counts(path: Path) -> None:
    """Write the counts of two topics."""
    written = PublishedCounts(path)
    for topic in (topics.DELTA, topics.DELTA, topics.OFFER):
        written.add(topic)
    written.close()


def database(path: Path) -> None:
    """Write a database of three records."""
    written = Database(path)
    written.put(Record(f"key {number}", "kind", bytes([number] * 40)) for number in range(3))
    written.close()


def export(path: Path) -> None:
    """Write an export of a database."""
    from cogmap.cli.memory import lines

    records = [Record(f"key {number}", "kind", bytes([number] * 40)) for number in range(3)]
    path.write_bytes(b"".join(lines.written(records, len(records))))


def arrays(path: Path) -> None:
    """Write arrays as renderings are kept."""
    calibration = np.frombuffer(msgspec.json.encode({"width_px": 3}), np.uint8)
    np.savez_compressed(path, calibration=calibration, names=np.array(["a"]), left=np.zeros((9, 9)))


def protocolbuffer(path: Path) -> None:
    """Write the extract as PBF."""
    import osmium

    with osmium.SimpleWriter(str(path)) as writer:
        for number in (1, 2, 4):
            node = osmium.osm.mutable.Node(id=number, location=(15.6, 48.4 + number / 100))
            writer.add_node(node)
        way = osmium.osm.mutable.Way(id=7, nodes=[1, 2, 4], tags={"highway": "residential"})
        writer.add_way(way)


def bag(path: Path, version: int, plugin: str = "MCAP") -> None:
    """Write a bag of ROS with odometry and laser scans, compressed where the format has it."""
    from rosbags import rosbag1, rosbag2
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_JAZZY)
    types: dict[str, Any] = store.types
    writer: Any
    if version == 1:
        writer = rosbag1.Writer(path)
        writer.set_compression(rosbag1.Writer.CompressionFormat.BZ2)
    else:
        writer = rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin[plugin])

    with writer:
        text = "std_msgs/msg/String"
        connection = writer.add_connection("/words", text, typestore=store)
        for number in range(5):
            message = types[text](data="words " * 20)
            serialize = store.serialize_ros1 if version == 1 else store.serialize_cdr
            writer.write(connection, 1_700_000_000_000_000_000 + number, serialize(message, text))


PACKERS: dict[str, Callable[[bytes], bytes]] = {
    ".gz": gzip.compress,
    ".bz2": bz2.compress,
    ".xz": lzma.compress,
}
