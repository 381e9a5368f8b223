"""Messages between the body and perception: frames, odometry, views, percepts, motor commands."""

from __future__ import annotations

import enum
import math
from typing import Annotated

import msgspec
import numpy as np

from cogmap.schemas.array import Array
from cogmap.schemas.base import Count, Finite, Message, Metres, Name, Part, Unit
from cogmap.schemas.feelings import Feeling, salience_of


class Calibration(Part, kw_only=True, frozen=True):
    """A stereo camera: pinhole intrinsics in pixels, right camera relative to the left, mount on
    the robot.

    `right_rotation_rad` is the rotation vector of the right camera in the left one's frame (x
    right, y down, z forward); distortions are OpenCV's k1, k2, p1, p2, k3.
    """

    width_px: Annotated[int, msgspec.Meta(ge=16, le=8192)]
    height_px: Annotated[int, msgspec.Meta(ge=16, le=8192)]
    fx_px: Metres
    fy_px: Metres
    cx_px: Metres
    cy_px: Metres
    baseline_m: Annotated[float, msgspec.Meta(gt=0, le=10)]
    mount_height_m: Metres
    mount_forward_m: Finite = 0.0
    right_rotation_rad: tuple[Finite, Finite, Finite] = (0.0, 0.0, 0.0)
    left_distortion: tuple[Finite, Finite, Finite, Finite, Finite] = (0.0, 0.0, 0.0, 0.0, 0.0)
    right_distortion: tuple[Finite, Finite, Finite, Finite, Finite] = (0.0, 0.0, 0.0, 0.0, 0.0)


class StereoFrame(Message, kw_only=True, frozen=True):
    """A pair of images, uint8, grey (height, width) or RGB (height, width, 3), as the cameras gave
    them. `frame` counts from 0.
    """

    frame: Count
    left: Array
    right: Array
    calibration: Calibration


class Odometry(Message, kw_only=True, frozen=True):
    """Wheel odometry over the `dt_s` that end at `stamp_ns`: noisy mean speeds of the robot."""

    speed_m_s: Finite
    turn_rate_rad_s: Finite
    dt_s: Annotated[float, msgspec.Meta(gt=0, le=10)]


class SelfMotion(Message, kw_only=True, frozen=True):
    """What moved between two views: float64 (n, 5) rows, in order of time.

    Each is speed_m_s, turn_rate_rad_s and dt_s, then the standard deviations of the two speeds.
    """

    frame: Count
    since_ns: Count
    motions: Array


class Energy(Message, kw_only=True, frozen=True):
    """What the body senses of its energy at the stamp of a view: the level, 1 where the battery is
    full and 0 if the robot is out, and whether it is being charged.
    """

    frame: Count
    level: Unit
    is_charging: bool = False


class View(Message, kw_only=True, frozen=True):
    """The rectified left image, uint8 (h, w, 3), and depth along the optical axis, float32 (h, w);
    0 is unknown.
    """

    frame: Count
    image: Array
    depth_m: Array
    calibration: Calibration


class RangeScan(Message, kw_only=True, frozen=True):
    """Nearest obstacle by bearing (left positive), float32 (n,) each; range 0 is nothing seen."""

    frame: Count
    bearing_rad: Array
    range_m: Array


class Appearance(Part, kw_only=True, frozen=True):
    """What an object looks like from one side: a direction, float32 (n,) of length 1.

    The more alike two directions are, the likelier both are of one object: the logarithm of that,
    over any other object, is `sharpness` times what their cosine has over `even_cosine`.
    """

    direction: Array
    sharpness: Annotated[float, msgspec.Meta(gt=0, le=1e3)]
    even_cosine: Annotated[float, msgspec.Meta(ge=-1, le=1)]


MAX_BEARING_SD_RAD = 7.0
"""A bearing that is known worse is stated so: it is unknown from a half turn on."""


class Percept(Part, kw_only=True, frozen=True):
    """Something that is seen: what it may be called, what it looks like, and where it stands as
    seen from the robot.

    `name` is the likeliest name, empty if it has none, as a tree trunk; `activation` is the total
    activation of its PAM node, `evidence` how likely the views make it, whatever was
    expected, and `names` how likely it makes other names. `label` is that of the individual object
    that it is of, and `certainty` how likely it is of that one: the workspace finds it, unless what
    perceives knows it, as by a barcode.
    Bearing (left positive) and range point to the object's estimated centre; `whole` says that
    neither image border nor another object cuts it. `box_px` is left, top, width, height in the
    view; `outline_px` are the corners, column and row, of a polygon around what is seen of it.
    `function` is what it is used for, as far as what it was recognised as implies that. `feelings`
    are those that the PAM node activates, each with its activation.
    """

    name: str = ""
    names: dict[Name, Unit] = {}
    label: str = ""
    appearance: Appearance | None = None
    certainty: Unit = 1.0
    activation: Unit
    evidence: Unit
    bearing_rad: Finite
    range_m: Annotated[float, msgspec.Meta(gt=0, le=1e4)]
    bearing_sd_rad: Annotated[float, msgspec.Meta(gt=0, le=MAX_BEARING_SD_RAD)]
    range_sd_m: Annotated[float, msgspec.Meta(gt=0, le=1e4)]
    width_m: Metres
    height_m: Metres
    whole: bool
    box_px: tuple[int, int, int, int]
    outline_px: list[tuple[int, int]] = []
    function: str = ""
    feelings: dict[Feeling, Unit] = {}

    @property
    def salience(self) -> float:
        """Return how much its feelings make it matter, -1 to 1."""
        return salience_of(self.feelings)

    @property
    def has_bearing(self) -> bool:
        """Return whether the bearing is known: its standard deviation is below a half turn."""
        return self.bearing_sd_rad < math.pi

    @property
    def has_range(self) -> bool:
        """Return whether the range is known: its standard deviation is below the range."""
        return self.range_sd_m < self.range_m

    @property
    def has_place(self) -> bool:
        """Return whether it states where something stands, by bearing and range."""
        return self.has_bearing and self.has_range


class PlaceMatch(Part, kw_only=True, frozen=True):
    """A view from a place that was seen before, recognised by the views that led to it.

    `frame` and `view_ns` are those of the remembered view; `score` is how sure it is.
    """

    frame: Count
    view_ns: Count
    score: Unit


def _no_points() -> Array:
    points_m = np.empty((0, 2), np.float32)
    return Array.of(points_m)


class Percepts(Message, kw_only=True, frozen=True):
    """All that was recognised in one view.

    `road_m` and `road_boundary_m`: float32 (n, 2), ground points seen as road, and where it ends,
    in the robot's frame, x forward, y left. `matches` has at most one remembered view.
    `calibration` is that of the view, None for a sense without one.
    """

    frame: Count
    objects: list[Percept]
    road_m: Array
    road_boundary_m: Array = msgspec.field(default_factory=_no_points)
    matches: list[PlaceMatch] = []
    calibration: Calibration | None = None


class RememberedView(Part, kw_only=True, frozen=True):
    """A view to recognise a place by: its `frame` and stamp, and `code`, uint8 (n,), for EPAM to
    compare.
    """

    frame: Count
    view_ns: Count
    code: Array


class Associations(Part, kw_only=True, frozen=True):
    """The PAM nodes of perceptual associative memory, and the links between them.

    `base_levels` and `activations`, float64 (n,), are those of `names` after the broadcast of
    `updated_ns`. Link k leads from name `sources`[k] to name `targets`[k], int32 (m,), with
    `weights`[k], float64 (m,), 0 to 1.
    """

    updated_ns: Count
    names: list[Name]
    base_levels: Array
    activations: Array
    sources: Array
    targets: Array
    weights: Array


class Learned(Message, kw_only=True, frozen=True):
    """What perception learned from one view and the broadcasts before it, or, after a restart, from
    all before. `associations` are None if they were not published anew. `taught_share`, float64
    (n,), is the log likelihood of shares of the buildings seen that perception was taught.
    """

    frame: Count
    views: list[RememberedView] = []
    associations: Associations | None = None
    taught_share: Array | None = None


class SpeedLimit(enum.StrEnum):
    """What keeps the robot below its cruising speed; NONE if nothing does.

    POSE_AGE: the pose that the command is computed from is old, as the machine is too slow. STUCK:
    the robot was commanded to move and did not. AT_GOAL: every goal is reached. RECORDING: what is
    sensed was recorded, and no command moves anything in it. OTHER is for modules of other people.
    """

    NONE = ""
    BEND = "bend"
    ROUTE_END = "end of route"
    OBSTACLE = "obstacle"
    POSE_AGE = "pose age"
    STUCK = "stuck"
    NO_ACTION = "no action"
    NO_POSE = "no pose"
    NO_ROUTE = "no route"
    AT_GOAL = "at goal"
    RECORDING = "recording"
    OTHER = "other"


class MotorCommand(Message, kw_only=True, frozen=True):
    """Wheel speeds, answering the frame whose stamp it carries.

    `halted_by` is the reason of zero speed, `slowed_by` that of a lower speed than cruising.
    `pose_age_ns`: how much older than the newest message the pose is.
    """

    left_wheel_rad_s: Annotated[float, msgspec.Meta(ge=-1000, le=1000)]
    right_wheel_rad_s: Annotated[float, msgspec.Meta(ge=-1000, le=1000)]
    halted_by: SpeedLimit = SpeedLimit.NONE
    slowed_by: SpeedLimit = SpeedLimit.NONE
    pose_age_ns: Count = 0


class Pose(Part, kw_only=True, frozen=True):
    """A pose in the plane, heading counter-clockwise from x."""

    x_m: Finite
    y_m: Finite
    heading_rad: Finite


class StreetClosure(Message, kw_only=True, frozen=True):
    """Closes a street of the simulated town by a barrier, or opens it. People publish it."""

    street: Name
    closed: bool


class Reset(Message, kw_only=True, frozen=True):
    """Asks that the robot is carried back to where it began. People publish it."""


class TruePose(Message, kw_only=True, frozen=True):
    """Where the robot really is, and how often it has run into something. Observers only.

    `energy` is the level of its battery, absent where it has none. `resets` is how often it was
    carried back to where it began, absent before the first time.
    """

    pose: Pose
    travelled_m: Metres
    progress: Unit
    collisions: Count = 0
    energy: Unit | msgspec.UnsetType = msgspec.UNSET
    resets: Count | msgspec.UnsetType = msgspec.UNSET


class Street(Part, kw_only=True, frozen=True):
    """A street's centre line, (x, y) in metres, its width between the kerbs, and whether a barrier
    closes it.
    """

    name: Name
    line_m: list[tuple[Finite, Finite]]
    width_m: Metres
    closed: bool = False


class Building(Part, kw_only=True, frozen=True):
    """A building's footprint: centre, width along its heading, depth across it, height.

    `roof_rise_m` is how much higher the ridge of its roof, along its width, is than its eaves; 0 of
    a flat one. `outline_m` are the corners, (x, y) in metres, counter-clockwise, of one that is no
    rectangle, and has a flat roof. `function` is what it is used for, `district` the part of the
    town that it is in.
    """

    name: Name
    pose: Pose
    width_m: Metres
    depth_m: Metres
    height_m: Metres
    roof_rise_m: Metres = 0.0
    district: str = ""
    function: str = ""
    outline_m: list[tuple[Finite, Finite]] = []


class Obstacle(Part, kw_only=True, frozen=True):
    """What stands on a pavement or a street: centre, length along its heading, width, height."""

    kind: Name
    pose: Pose
    length_m: Metres
    width_m: Metres
    height_m: Metres


def _no_segments() -> Array:
    segments_m = np.empty((0, 4), np.float32)
    return Array.of(segments_m)


class TrueTown(Message, kw_only=True, frozen=True):
    """The town as it was built, published again when a street is closed or opened. Observers only.

    `kerbs_m`, where the surface of the streets ends, and `walls_m`, the buildings' outer walls, are
    segments, float32 (n, 4): x and y of one end, then of the other.
    """

    seed: Count
    streets: list[Street]
    buildings: list[Building]
    obstacles: list[Obstacle] = []
    kerbs_m: Array = msgspec.field(default_factory=_no_segments)
    walls_m: Array = msgspec.field(default_factory=_no_segments)
