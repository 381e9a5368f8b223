"""Examples of what is sensed and perceived, and of the simulator's truth."""

from __future__ import annotations

from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.examples.arrays import ramp
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.sensing import (
    Associations,
    Building,
    Calibration,
    Energy,
    Learned,
    LearnedObject,
    MotorCommand,
    Obstacle,
    Odometry,
    Percept,
    Percepts,
    PlaceMatch,
    Pose,
    RangeScan,
    RememberedView,
    SelfMotion,
    SpeedLimit,
    StereoFrame,
    Street,
    StreetClosure,
    TruePose,
    TrueTown,
    View,
)


def messages() -> list[Message]:
    """A message of every type but three, from the cameras' frames to the true town."""
    image = ramp(2, 3, 3, dtype="|u1")
    depth = ramp(2, 3, dtype="<f4")
    return [
        StereoFrame(frame=6, left=image, right=image, calibration=_calibration()),
        Odometry(speed_m_s=2.5, turn_rate_rad_s=-0.125, dt_s=0.05),
        SelfMotion(frame=6, since_ns=1_000_000_000, motions=ramp(4, 3, dtype="<f8")),
        View(frame=6, image=image, depth_m=depth, calibration=_calibration()),
        RangeScan(frame=6, bearing_rad=ramp(5, dtype="<f4"), range_m=ramp(5, dtype="<f4")),
        _percepts(),
        _motor_command(),
        TruePose(pose=_pose(), travelled_m=12.5, progress=0.25, collisions=2, energy=0.75),
        _town(),
    ]


def learned() -> Learned:
    """An object learned, a view remembered, and PAM nodes that were conscious together."""
    associations = Associations(
        updated_ns=800_000_000,
        names=["object:building-07", "category:shop", "feeling:danger"],
        base_levels=Array.of([0.25, 0.5, 0.125]),
        activations=Array.of([1.0, 0.5, 0.25]),
        sources=Array.of([0, 1, 0], "<i4"),
        targets=Array.of([1, 0, 2], "<i4"),
        weights=Array.of([0.25, 0.125, 0.25]),
    )
    return Learned(
        frame=6,
        objects=[LearnedObject(label="building-08", embedding=ramp(4, dtype="<f4"))],
        views=[RememberedView(frame=2, view_ns=400_000_000, code=ramp(4, dtype="|u1"))],
        associations=associations,
    )


def percept() -> Percept:
    """An object recognised."""
    return Percept(
        label="building-07",
        activation=0.875,
        evidence=0.75,
        bearing_rad=-0.25,
        range_m=18.5,
        bearing_sd_rad=0.01,
        range_sd_m=0.55,
        width_m=9.0,
        height_m=6.5,
        whole=True,
        box_px=(12, 34, 56, 78),
        outline_px=[(12, 34), (68, 34), (68, 112)],
        function="shop",
        feelings={Feeling.DANGER: 0.25},
    )


def street_closure() -> StreetClosure:
    """A street that a person closes."""
    return StreetClosure(street="ring", closed=True)


def energy() -> Energy:
    """The energy that the body senses."""
    return Energy(frame=6, level=0.75, is_charging=True)


def place_match() -> PlaceMatch:
    """A place recognised by its view."""
    return PlaceMatch(frame=2, view_ns=400_000_000, score=0.75)


def _calibration() -> Calibration:
    return Calibration(
        width_px=320,
        height_px=240,
        fx_px=240.0,
        fy_px=241.0,
        cx_px=160.5,
        cy_px=120.5,
        baseline_m=0.4,
        mount_height_m=1.6,
        mount_forward_m=0.25,
        right_rotation_rad=(0.001, -0.002, 0.003),
        left_distortion=(0.1, -0.2, 0.001, 0.002, 0.05),
        right_distortion=(0.11, -0.21, 0.0, 0.0, 0.06),
    )


def _percepts() -> Percepts:
    return Percepts(
        frame=6,
        objects=[percept()],
        road_m=ramp(3, 2, dtype="<f4"),
        road_boundary_m=ramp(2, 2, dtype="<f4"),
        matches=[place_match()],
    )


def _motor_command() -> MotorCommand:
    return MotorCommand(
        left_wheel_rad_s=10.5,
        right_wheel_rad_s=-9.5,
        halted_by=SpeedLimit.OBSTACLE,
        slowed_by=SpeedLimit.POSE_AGE,
        pose_age_ns=400_000_000,
    )


def _pose() -> Pose:
    return Pose(x_m=3.5, y_m=-1.25, heading_rad=0.5)


def _town() -> TrueTown:
    street = Street(
        name="ring",
        line_m=[(0.0, 0.0), (60.0, 0.5)],
        width_m=8.0,
        closed=True,
    )
    house = Building(
        name="building-07",
        pose=_pose(),
        width_m=9.0,
        depth_m=8.0,
        height_m=6.5,
        district="Old Town",
        function="shop",
        outline_m=[(0.0, 0.0), (9.0, 0.0), (9.0, 8.0)],
    )
    kiosk = Obstacle(
        kind="kiosk",
        pose=_pose(),
        length_m=2.0,
        width_m=1.75,
        height_m=2.5,
    )
    return TrueTown(
        seed=7,
        streets=[street],
        buildings=[house],
        obstacles=[kiosk],
        kerbs_m=ramp(3, 4, dtype="<f4"),
        walls_m=ramp(2, 4, dtype="<f4"),
    )
