"""Writes a log as Foxglove reads it: MCAP with the types of Foxglove, by its own library."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.recording.log import Entry, Log
from cogmap.recording.storage.reader import Progress
from cogmap.recording.views import camera_image, depth
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Broadcast
from cogmap.schemas.graph import Delta
from cogmap.schemas.nodes import PLAN_ID, ROOT_MAP, Object, PathColumn, PlaceColumn, Plan
from cogmap.schemas.process import Health
from cogmap.schemas.sensing import RangeScan, TruePose, View

MAP = "map"
ROBOT = "robot"
CAMERA = "camera"
TOWN = "town"
MAP_PERIOD_S = 1.0
"""How often the map is written: all of it each time."""

OBJECT_HEIGHT_M = 3.0
"""Of an object whose height is not known."""

_TOPICS = (
    topics.VIEW,
    topics.SCAN,
    topics.DELTA,
    topics.BROADCAST,
    topics.HEALTH,
    topics.TRUE_POSE,
)


def write_foxglove(log: Log, path: Path, progress: Progress | None = None) -> dict[str, int]:
    """Write the drive in `log` to the new file `path`. Returns the number of messages by topic.

    `/camera` and `/depth` are images, `/camera/calibration` the camera, `/tf` where the robot and
    its camera are, `/pose` what the agent believes, `/path`, `/plan`, `/objects` and `/places` the
    map, `/scan` the points of a range scan, `/log` what became conscious and what processes report,
    `/truth` where the robot is, in a frame of its own. Raises UsageError if the file exists or the
    library is not installed, and LogError if the log is damaged.
    """
    foxglove = _library()
    context = foxglove.Context()
    try:
        writer = foxglove.open_mcap(path, context=context)
    except FileExistsError:
        raise UsageError(f"{path} exists already: name a new file") from None

    with writer:
        drive = _Drive(foxglove, context, round(log.duration_s * 1e9))
        for entry in log.messages(*_TOPICS):
            drive.take(entry)
            if progress is not None:
                progress(entry.time_s / max(log.duration_s, 1e-9))
        drive.end()
    return dict(drive.written)


class _Drive:
    """Turns the messages of a drive into those of Foxglove, and writes them."""

    def __init__(self, foxglove: Any, context: Any, duration_ns: int) -> None:
        self.written: Counter[str] = Counter()
        self._messages = foxglove.messages
        self._channels: dict[str, Any] = {}
        self._context = context
        self._library = foxglove
        self._graph = Graph()
        self._map_due_s = 0.0
        self._begin_ns: int | None = None
        self._log_time_ns = 0
        self._shown: set[str] = set()
        self._takers: dict[type[Message], Callable[[Any], None]] = {
            View: self._on_view,
            RangeScan: self._on_scan,
            Delta: self._on_delta,
            Broadcast: self._on_broadcast,
            Health: self._on_health,
            TruePose: self._on_true_pose,
        }

    def take(self, entry: Entry) -> None:
        """Write what follows from a message."""
        if self._begin_ns is None:
            self._begin_ns = entry.log_time_ns
        self._log_time_ns = entry.log_time_ns
        self._takers[type(entry.message)](entry.message)
        if entry.time_s >= self._map_due_s and self._graph.agent is not None:
            self._map_due_s = entry.time_s + MAP_PERIOD_S
            self._write_map()

    def end(self) -> None:
        """Write the map as it is in the end."""
        if self._graph.agent is not None:
            self._write_map()

    def _write(self, topic: str, message: Any) -> None:
        channel = self._channels.get(topic)
        if channel is None:
            kind = getattr(self._library.channels, f"{type(message).__name__}Channel")
            channel = self._channels[topic] = kind(topic, context=self._context)
        channel.log(message, log_time=self._log_time_ns)
        self.written[topic] += 1

    def _time(self, stamp_ns: int) -> Any:
        """Return a time of the drive on the log's clock: as if both had begun at once."""
        second, nanosecond = divmod((self._begin_ns or 0) + stamp_ns, 10**9)
        return self._messages.Timestamp(sec=second, nsec=nanosecond)

    def _pose(self, x_m: float, y_m: float, heading_rad: float = 0.0, z_m: float = 0.0) -> Any:
        return self._messages.Pose(
            position=self._messages.Vector3(x=x_m, y=y_m, z=z_m),
            orientation=self._turned(heading_rad),
        )

    def _turned(self, heading_rad: float) -> Any:
        half_rad = heading_rad / 2
        return self._messages.Quaternion(x=0.0, y=0.0, z=math.sin(half_rad), w=math.cos(half_rad))

    def _poses(self, topic: str, stamp_ns: int, points_m: Floats) -> None:
        poses = [self._pose(x_m, y_m) for x_m, y_m in points_m.tolist()]
        stamp = self._time(stamp_ns)
        self._write(topic, self._messages.PosesInFrame(timestamp=stamp, frame_id=MAP, poses=poses))

    def _on_view(self, view: View) -> None:
        messages = self._messages
        stamp = self._time(view.stamp_ns)
        image = camera_image(view.image, "the view's image")
        _, encoded = cv2.imencode(".jpg", cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
        self._write(
            "/camera",
            messages.CompressedImage(
                timestamp=stamp, frame_id=CAMERA, data=encoded.tobytes(), format="jpeg"
            ),
        )
        depth_m = depth(view.depth_m, "the view's depth")
        height, width = depth_m.shape
        self._write(
            "/depth",
            messages.RawImage(
                timestamp=stamp,
                frame_id=CAMERA,
                width=width,
                height=height,
                encoding="32FC1",
                step=4 * width,
                data=depth_m.astype("<f4").tobytes(),
            ),
        )
        camera = view.calibration
        intrinsics = [camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1]
        projection = [*intrinsics[:3], 0, *intrinsics[3:6], 0, *intrinsics[6:], 0]
        self._write(
            "/camera/calibration",
            messages.CameraCalibration(
                timestamp=stamp,
                frame_id=CAMERA,
                width=camera.width_px,
                height=camera.height_px,
                K=[float(value) for value in intrinsics],
                P=[float(value) for value in projection],
            ),
        )
        # The camera's axes are right, down and forward; the robot's forward, left and up.
        self._write(
            "/tf",
            messages.FrameTransform(
                timestamp=stamp,
                parent_frame_id=ROBOT,
                child_frame_id=CAMERA,
                translation=messages.Vector3(
                    x=camera.mount_forward_m, y=0.0, z=camera.mount_height_m
                ),
                rotation=messages.Quaternion(x=-0.5, y=0.5, z=-0.5, w=0.5),
            ),
        )

    def _on_scan(self, scan: RangeScan) -> None:
        messages = self._messages
        bearing_rad = scan.bearing_rad.numpy().astype(np.float64)
        range_m = scan.range_m.numpy().astype(np.float64)
        met = range_m > 0
        points_m = range_m[met] * np.array([np.cos(bearing_rad[met]), np.sin(bearing_rad[met])])
        content = np.zeros((points_m.shape[1], 3), "<f4")
        content[:, :2] = points_m.T
        kind = messages.PackedElementFieldNumericType.Float32
        fields = [
            messages.PackedElementField(name=name, offset=4 * number, type=kind)
            for number, name in enumerate("xyz")
        ]
        self._write(
            "/scan",
            messages.PointCloud(
                timestamp=self._time(scan.stamp_ns),
                frame_id=ROBOT,
                pose=self._pose(0.0, 0.0),
                point_stride=12,
                fields=fields,
                data=content.tobytes(),
            ),
        )

    def _on_delta(self, delta: Delta) -> None:
        before = self._graph.agent
        self._graph.apply(delta)
        agent = self._graph.agent
        if agent is None or agent is before:
            return

        messages = self._messages
        stamp = self._time(max(agent.stamp_ns, 0))
        pose = self._pose(agent.x_m, agent.y_m, agent.heading_rad)
        self._write("/pose", messages.PoseInFrame(timestamp=stamp, frame_id=MAP, pose=pose))
        self._write(
            "/tf",
            messages.FrameTransform(
                timestamp=stamp,
                parent_frame_id=MAP,
                child_frame_id=ROBOT,
                translation=messages.Vector3(x=agent.x_m, y=agent.y_m, z=0.0),
                rotation=self._turned(agent.heading_rad),
            ),
        )

    def _on_broadcast(self, broadcast: Broadcast) -> None:
        coalition = broadcast.coalition
        nodes = ", ".join(node.id for node in coalition.nodes)
        self._say(broadcast.stamp_ns, coalition.codelet, f"conscious: {nodes}")

    def _on_health(self, health: Health) -> None:
        for note in health.notes:
            self._say(self._log_time_ns - (self._begin_ns or 0), health.instance, note)

    def _say(self, stamp_ns: int, name: str, sentence: str) -> None:
        level = self._messages.LogLevel.Info
        stamp = self._time(stamp_ns)
        said = self._messages.Log(timestamp=stamp, level=level, name=name, message=sentence)
        self._write("/log", said)

    def _on_true_pose(self, true: TruePose) -> None:
        pose = self._pose(true.pose.x_m, true.pose.y_m, true.pose.heading_rad)
        stamp = self._time(true.stamp_ns)
        shown = self._messages.PoseInFrame(timestamp=stamp, frame_id=TOWN, pose=pose)
        self._write("/truth", shown)

    def _write_map(self) -> None:
        """Write the path, the plan, the objects and the place nodes as they are now."""
        graph = self._graph
        assert graph.agent is not None
        stamp_ns = max(graph.agent.stamp_ns, 0)
        rows = rows_of(graph.path)
        self._poses("/path", stamp_ns, rows[:, [PathColumn.X_M, PathColumn.Y_M]])
        plan = graph.get(Plan, PLAN_ID)
        if plan is not None and plan.route is not None and plan.map == ROOT_MAP:
            self._poses("/plan", stamp_ns, plan.route.numpy().astype(np.float64))
        self._write_objects(stamp_ns)
        self._write_places(stamp_ns)

    def _write_objects(self, stamp_ns: int) -> None:
        messages = self._messages
        nodes = [node for node in self._graph.of_kind(Object) if node.map == ROOT_MAP]
        stamp = self._time(stamp_ns)
        gone = self._shown - {node.id for node in nodes}
        self._shown = {node.id for node in nodes}
        kind = messages.SceneEntityDeletionType.MatchingId
        deletions = [
            messages.SceneEntityDeletion(timestamp=stamp, type=kind, id=name)
            for name in sorted(gone)
        ]
        entities = [self._entity(node, stamp) for node in nodes]
        self._write("/objects", messages.SceneUpdate(deletions=deletions, entities=entities))

    def _entity(self, node: Object, stamp: Any) -> Any:
        messages = self._messages
        height_m = node.height_m or OBJECT_HEIGHT_M
        side_m = node.width_m or 1.0
        colour = messages.Color(r=0.79, g=0.54, b=0.07, a=0.5)
        cube = messages.CubePrimitive(
            pose=self._pose(node.x_m, node.y_m, z_m=height_m / 2),
            size=messages.Vector3(x=side_m, y=side_m, z=height_m),
            color=colour,
        )
        text = messages.TextPrimitive(
            pose=self._pose(node.x_m, node.y_m, z_m=height_m + 1.0),
            billboard=True,
            font_size=1.0,
            color=messages.Color(r=0.2, g=0.2, b=0.2, a=1.0),
            text=node.name or node.label,
        )
        return messages.SceneEntity(
            timestamp=stamp, frame_id=MAP, id=node.id, cubes=[cube], texts=[text]
        )

    def _write_places(self, stamp_ns: int) -> None:
        """Write road and what stands there, 0 to 255 each, a byte a place node."""
        messages = self._messages
        columns = (PlaceColumn.ROAD, PlaceColumn.OBSTACLE)
        window = self._graph.places.window(ROOT_MAP, columns)
        width, _ = window.shape
        if not width:
            return

        shares = np.stack([window.column(name).T for name in columns], axis=-1)
        content = np.asarray(255 * shares.clip(0, 1), np.uint8)
        cell_m = self._graph.cell_m()
        west, south = window.origin
        kind = messages.PackedElementFieldNumericType.Uint8
        fields = [
            messages.PackedElementField(name=name.value, offset=number, type=kind)
            for number, name in enumerate(columns)
        ]
        self._write(
            "/places",
            messages.Grid(
                timestamp=self._time(stamp_ns),
                frame_id=MAP,
                pose=self._pose((west - 0.5) * cell_m, (south - 0.5) * cell_m),
                column_count=width,
                cell_size=messages.Vector2(x=cell_m, y=cell_m),
                row_stride=len(columns) * width,
                cell_stride=len(columns),
                fields=fields,
                data=content.tobytes(),
            ),
        )


def _library() -> Any:
    try:
        import foxglove
        import foxglove.channels
        import foxglove.messages
    except ImportError:
        raise UsageError(
            "this needs Foxglove's library: install it by `pip install 'cogmap[foxglove]'`"
        ) from None
    return foxglove
