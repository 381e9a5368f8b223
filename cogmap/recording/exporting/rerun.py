"""Writes a log as Rerun reads it: an .rrd file with the archetypes of Rerun, by its own library."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats
from cogmap.recording.exporting.moments import (
    OBJECT_HEIGHT_M,
    OBJECT_WIDTH_M,
    PLACE_COLUMNS,
    Map,
    Moment,
    Sentence,
    moments,
    points_of,
)
from cogmap.recording.log import Log
from cogmap.recording.storage.reader import Progress
from cogmap.recording.views import camera_image, depth
from cogmap.runtime.state.new_file import new_file
from cogmap.schemas import topics
from cogmap.schemas.nodes import Need, Object, Self
from cogmap.schemas.sensing import Calibration, Energy, Odometry, RangeScan, TruePose, View

APPLICATION = "cogmap"
TIME = "time"
STAMP = "stamp"
"""Timelines: seconds since the log's first message, as everywhere, and of when each thing is."""

ROBOT = "map/robot"
CAMERA = "map/robot/camera"
DEPTH = f"{CAMERA}/depth"
TRUTH = "truth/robot"
SENSES = (topics.VIEW, topics.SCAN, topics.ODOMETRY, topics.ENERGY)
OPTICAL_AXES = (-0.5, 0.5, -0.5, 0.5)
"""The turn, a quaternion, from the robot's axes, forward, left and up, to those of its camera:
right, down and forward.
"""

OBJECT_COLOUR = (201, 138, 18, 128)
PATH_COLOUR = (31, 119, 180)
PLAN_COLOUR = (214, 39, 40)
LINE_RADIUS_M = 0.1
AXES_M = 2.0


def write_rerun(log: Log, path: Path, progress: Progress | None = None) -> dict[str, int]:
    """Write the drive in `log` to the new file `path`. Returns how often each entity is in it.

    Below `map` is the learned map, `path`, `plan`, `objects` and `places`, and the `robot` where
    the agent believes it to be, with its range `scan` and its `camera`, whose `image` and `depth`
    they are. `truth/robot` is where it is, in a frame of its own; `needs` and `body` have the needs
    and the energy and speed that are sensed, `log` what became conscious and what processes report.
    Raises UsageError if the library is not installed, StorageError if the file exists or the disk
    refuses, and LogError if the log is damaged.
    """
    rerun = library()
    with new_file(path) as made:
        stream = rerun.RecordingStream(APPLICATION)
        stream.save(made)
        entities = Entities(rerun, stream)
        for moment in moments(log, SENSES, progress):
            entities.take(moment)
        stream.disconnect()
    return dict(entities.written)


class Entities:
    """Turns the moments of a drive into entities of Rerun, and sends them to where `stream` leads:
    a file, or a viewer.
    """

    def __init__(self, rerun: Any, stream: Any) -> None:
        self.written: Counter[str] = Counter()
        self._rerun = rerun
        self._stream = stream
        self._calibration: Calibration | None = None
        self._writers: dict[type, Callable[[Any], None]] = {
            View: self._write_view,
            RangeScan: self._write_scan,
            Odometry: self._write_odometry,
            Energy: self._write_energy,
            Self: self._write_pose,
            Need: self._write_need,
            Sentence: self._write_sentence,
            TruePose: self._write_true_pose,
            Map: self._write_map,
        }
        # Moments have times of their own: when they were written is of no matter.
        stream.set_log_time_enabled(False)
        stream.set_log_tick_enabled(False)
        stream.log("/", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)

    def take(self, moment: Moment) -> None:
        """Write what there is to show."""
        self._stream.set_time(TIME, duration=moment.time_s)
        self._stream.set_time(STAMP, timestamp=np.datetime64(moment.stamp_ns, "ns"))
        self._writers[type(moment.content)](moment.content)

    def _write(self, entity: str, *archetypes: Any) -> None:
        self._stream.log(entity, *archetypes)
        self.written[entity] += 1

    def _path(self, *parts: str) -> str:
        """Return the path of an entity whose parts may hold any characters."""
        path: str = self._rerun.new_entity_path(list(parts))
        return path.removeprefix("/")

    def _transform(self, x_m: float, y_m: float, heading_rad: float) -> Any:
        turn = self._rerun.RotationAxisAngle(axis=(0, 0, 1), radians=heading_rad)
        return self._rerun.Transform3D(translation=(x_m, y_m, 0), rotation=turn)

    def _write_view(self, view: View) -> None:
        rerun = self._rerun
        if view.calibration != self._calibration:
            self._calibration = view.calibration
            self._write_camera(view.calibration)

        image = camera_image(view.image, "the view's image")
        _, encoded = cv2.imencode(".jpg", cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
        picture = rerun.EncodedImage(contents=encoded.tobytes(), media_type="image/jpeg")
        self._write(f"{CAMERA}/image", picture)
        depth_m = depth(view.depth_m, "the view's depth")
        self._write(DEPTH, rerun.DepthImage(depth_m, meter=1.0))

    def _write_camera(self, camera: Calibration) -> None:
        rerun = self._rerun
        mount = rerun.Transform3D(
            translation=(camera.mount_forward_m, 0, camera.mount_height_m),
            quaternion=rerun.Quaternion(xyzw=OPTICAL_AXES),
        )
        lens = rerun.Pinhole(
            focal_length=(camera.fx_px, camera.fy_px),
            principal_point=(camera.cx_px, camera.cy_px),
            width=camera.width_px,
            height=camera.height_px,
            camera_xyz=rerun.ViewCoordinates.RDF,
        )
        self._write(CAMERA, mount, lens)

    def _write_scan(self, scan: RangeScan) -> None:
        self._write(f"{ROBOT}/scan", self._rerun.Points3D(points_of(scan)))

    def _write_odometry(self, moved: Odometry) -> None:
        self._write_scalar("body/speed_m_s", moved.speed_m_s)

    def _write_energy(self, energy: Energy) -> None:
        self._write_scalar("body/energy", energy.level)

    def _write_need(self, need: Need) -> None:
        self._write_scalar(self._path("needs", need.label), need.level)

    def _write_scalar(self, entity: str, value: float) -> None:
        self._write(entity, self._rerun.Scalars(value))

    def _write_pose(self, agent: Self) -> None:
        pose = self._transform(agent.x_m, agent.y_m, agent.heading_rad)
        self._write(ROBOT, pose, self._rerun.TransformAxes3D(AXES_M))

    def _write_true_pose(self, true: TruePose) -> None:
        pose = self._transform(true.pose.x_m, true.pose.y_m, true.pose.heading_rad)
        self._write(TRUTH, pose, self._rerun.TransformAxes3D(AXES_M))

    def _write_sentence(self, said: Sentence) -> None:
        line = self._rerun.TextLog(said.text, level=self._rerun.TextLogLevel.INFO)
        self._write(self._path("log", said.name), line)

    def _write_map(self, known: Map) -> None:
        self._write_line("map/path", known.path_m, PATH_COLOUR)
        plan_m = np.zeros((0, 2)) if known.plan_m is None else known.plan_m
        self._write_line("map/plan", plan_m, PLAN_COLOUR)
        self._write_objects(known.objects)
        if known.places.shape[0]:
            self._write_places(known)

    def _write_line(self, entity: str, points_m: Floats, colour: tuple[int, ...]) -> None:
        """Write a line on the ground; one of no points removes that of before."""
        strips = [np.column_stack([points_m, np.zeros(len(points_m))])] if len(points_m) else []
        line = self._rerun.LineStrips3D(strips, colors=colour, radii=LINE_RADIUS_M)
        self._write(entity, line)

    def _write_objects(self, nodes: list[Object]) -> None:
        heights_m = [node.height_m or OBJECT_HEIGHT_M for node in nodes]
        widths_m = [node.width_m or OBJECT_WIDTH_M for node in nodes]
        sized = list(zip(nodes, heights_m, strict=True))
        boxes = self._rerun.Boxes3D(
            centers=[(node.x_m, node.y_m, height_m / 2) for node, height_m in sized],
            sizes=list(zip(widths_m, widths_m, heights_m, strict=True)),
            labels=[node.name or node.label for node in nodes],
            colors=OBJECT_COLOUR,
        )
        self._write("map/objects", boxes)

    def _write_places(self, known: Map) -> None:
        """Write what stands at the place nodes as red, road as green, the more opaque the surer."""
        rerun = self._rerun
        road, obstacle = (known.places.column(name).T.clip(0, 1) for name in PLACE_COLUMNS)
        nothing = np.zeros_like(road)
        colours = np.stack([obstacle, road, nothing, np.maximum(road, obstacle)], axis=-1)
        # The first row of an image is its uppermost, that of the window the southernmost.
        pixels = np.asarray(255 * np.flipud(colours), np.uint8)
        height, width = road.shape
        kind = rerun.components.ImageFormat(
            width=width,
            height=height,
            color_model=rerun.ColorModel.RGBA,
            channel_datatype=rerun.ChannelDatatype.U8,
        )
        self._write(
            "map/places",
            rerun.GridMap(
                data=pixels.tobytes(),
                format=kind,
                cell_size=known.cell_m,
                translation=(*known.corner_m, 0),
            ),
        )


def library() -> Any:
    """Import Rerun's library. Raises UsageError, with the remedy, if it is not installed."""
    try:
        import rerun
    except ImportError:
        raise UsageError(
            "this needs Rerun's library: install it by `pip install 'cogmap[rerun]'`"
        ) from None
    return rerun
