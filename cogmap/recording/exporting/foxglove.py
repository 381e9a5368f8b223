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
from cogmap.schemas import topics
from cogmap.schemas.nodes import Need, Object, Self
from cogmap.schemas.sensing import RangeScan, TruePose, View

MAP = "map"
ROBOT = "robot"
CAMERA = "camera"
TOWN = "town"
SENSES = (topics.VIEW, topics.SCAN)
NEEDS = "/needs"
NEED_SCHEMA = {
    "title": "Need",
    "type": "object",
    "properties": {"need": {"type": "string"}, "level": {"type": "number"}},
}
"""Foxglove itself has no type for a number that is to be plotted."""
TYPES = {
    "/camera": "CompressedImage",
    "/camera/calibration": "CameraCalibration",
    "/depth": "RawImage",
    "/tf": "FrameTransform",
    "/scan": "PointCloud",
    "/pose": "PoseInFrame",
    "/path": "PosesInFrame",
    "/plan": "PosesInFrame",
    "/objects": "SceneUpdate",
    "/places": "Grid",
    "/log": "Log",
    "/truth": "PoseInFrame",
}
"""Foxglove's type of each other topic."""


def write_foxglove(log: Log, path: Path, progress: Progress | None = None) -> dict[str, int]:
    """Write the drive in `log` to the new file `path`. Returns the number of messages by topic.

    `/camera` and `/depth` are images, `/camera/calibration` the camera, `/tf` where the robot and
    its camera are, `/pose` what the agent believes, `/path`, `/plan`, `/objects` and `/places` the
    map, `/scan` the points of a range scan, `/needs` how strong each need is, `/log` what became
    conscious and what processes report, `/truth` where the robot is, in a frame of its own. Raises
    UsageError if the file exists or the library is not installed, and LogError if the log is
    damaged.
    """
    foxglove = library()
    context = foxglove.Context()
    try:
        writer = foxglove.open_mcap(path, context=context)
    except FileExistsError:
        raise UsageError(f"{path} exists already: name a new file") from None

    with writer:
        channels = Channels(foxglove, context)
        for moment in moments(log, SENSES, progress):
            channels.take(moment)
    return dict(channels.written)


class Channels:
    """Turns the moments of a drive into messages of Foxglove, and sends them to whatever is open in
    `context`: a file, or a server.

    All channels are open from the beginning. A server names a new one to its viewers before it lets
    them subscribe to it: a quick viewer would be refused.
    """

    def __init__(self, foxglove: Any, context: Any) -> None:
        self.written: Counter[str] = Counter()
        self._messages = foxglove.messages
        needs = foxglove.Channel(NEEDS, schema=NEED_SCHEMA, context=context)
        self._channels: dict[str, Any] = {NEEDS: needs}
        for topic, kind in TYPES.items():
            channel = getattr(foxglove.channels, f"{kind}Channel")
            self._channels[topic] = channel(topic, context=context)
        self._log_time_ns = 0
        self._shown: set[str] = set()
        self._writers: dict[type, Callable[[Any, Any], None]] = {
            View: self._write_view,
            RangeScan: self._write_scan,
            Self: self._write_pose,
            Need: self._write_need,
            Sentence: self._write_sentence,
            TruePose: self._write_true_pose,
            Map: self._write_map,
        }

    def take(self, moment: Moment) -> None:
        """Write what there is to show."""
        self._log_time_ns = moment.log_time_ns
        second, nanosecond = divmod(moment.stamp_ns, 10**9)
        stamp = self._messages.Timestamp(sec=second, nsec=nanosecond)
        self._writers[type(moment.content)](stamp, moment.content)

    def _write(self, topic: str, message: Any) -> None:
        self._channels[topic].log(message, log_time=self._log_time_ns)
        self.written[topic] += 1

    def _pose(self, x_m: float, y_m: float, heading_rad: float = 0.0, z_m: float = 0.0) -> Any:
        return self._messages.Pose(
            position=self._messages.Vector3(x=x_m, y=y_m, z=z_m),
            orientation=self._turned(heading_rad),
        )

    def _turned(self, heading_rad: float) -> Any:
        half_rad = heading_rad / 2
        return self._messages.Quaternion(x=0.0, y=0.0, z=math.sin(half_rad), w=math.cos(half_rad))

    def _write_poses(self, topic: str, stamp: Any, points_m: Floats) -> None:
        poses = [self._pose(x_m, y_m) for x_m, y_m in points_m.tolist()]
        self._write(topic, self._messages.PosesInFrame(timestamp=stamp, frame_id=MAP, poses=poses))

    def _write_view(self, stamp: Any, view: View) -> None:
        messages = self._messages
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

    def _write_scan(self, stamp: Any, scan: RangeScan) -> None:
        messages = self._messages
        kind = messages.PackedElementFieldNumericType.Float32
        fields = [
            messages.PackedElementField(name=name, offset=4 * number, type=kind)
            for number, name in enumerate("xyz")
        ]
        self._write(
            "/scan",
            messages.PointCloud(
                timestamp=stamp,
                frame_id=ROBOT,
                pose=self._pose(0.0, 0.0),
                point_stride=12,
                fields=fields,
                data=points_of(scan).tobytes(),
            ),
        )

    def _write_pose(self, stamp: Any, agent: Self) -> None:
        messages = self._messages
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

    def _write_need(self, _stamp: Any, need: Need) -> None:
        self._write(NEEDS, {"need": need.label, "level": need.level})

    def _write_sentence(self, stamp: Any, said: Sentence) -> None:
        level = self._messages.LogLevel.Info
        line = self._messages.Log(timestamp=stamp, level=level, name=said.name, message=said.text)
        self._write("/log", line)

    def _write_true_pose(self, stamp: Any, true: TruePose) -> None:
        pose = self._pose(true.pose.x_m, true.pose.y_m, true.pose.heading_rad)
        shown = self._messages.PoseInFrame(timestamp=stamp, frame_id=TOWN, pose=pose)
        self._write("/truth", shown)

    def _write_map(self, stamp: Any, known: Map) -> None:
        self._write_poses("/path", stamp, known.path_m)
        if known.plan_m is not None:
            self._write_poses("/plan", stamp, known.plan_m)
        self._write_objects(stamp, known.objects)
        self._write_places(stamp, known)

    def _write_objects(self, stamp: Any, nodes: list[Object]) -> None:
        messages = self._messages
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
        side_m = node.width_m or OBJECT_WIDTH_M
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

    def _write_places(self, stamp: Any, known: Map) -> None:
        """Write road and what stands there, 0 to 255 each, a byte a place node."""
        messages = self._messages
        columns = PLACE_COLUMNS
        width, _ = known.places.shape
        if not width:
            return

        shares = np.stack([known.places.column(name).T for name in columns], axis=-1)
        content = np.asarray(255 * shares.clip(0, 1), np.uint8)
        kind = messages.PackedElementFieldNumericType.Uint8
        fields = [
            messages.PackedElementField(name=name.value, offset=number, type=kind)
            for number, name in enumerate(columns)
        ]
        self._write(
            "/places",
            messages.Grid(
                timestamp=stamp,
                frame_id=MAP,
                pose=self._pose(*known.corner_m),
                column_count=width,
                cell_size=messages.Vector2(x=known.cell_m, y=known.cell_m),
                row_stride=len(columns) * width,
                cell_stride=len(columns),
                fields=fields,
                data=content.tobytes(),
            ),
        )


def library() -> Any:
    """Import Foxglove's library. Raises UsageError, with the remedy, if it is not installed."""
    try:
        import foxglove
        import foxglove.channels
        import foxglove.messages
    except ImportError:
        raise UsageError(
            "this needs Foxglove's library: install it by `pip install 'cogmap[foxglove]'`"
        ) from None
    return foxglove
