"""The settings of sensory-motor memory."""

from __future__ import annotations

from typing import Annotated

import msgspec

from cogmap import robot
from cogmap.schemas.base import (
    PositiveAcceleration,
    PositiveMetres,
    PositiveSeconds,
    PositiveShare,
    PositiveSpeed,
)


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Sensory-motor memory: motor programs, and the reactive layers under them."""

    cruise_m_s: Annotated[
        PositiveSpeed, msgspec.Meta(description="Speed on a free straight, in m/s, above 0 to 100.")
    ] = 4.0
    lookahead_m: Annotated[
        PositiveMetres,
        msgspec.Meta(
            description="Distance of the point ahead that pure pursuit steers to, "
            "in m, above 0 to 10000."
        ),
    ] = 2.5
    lateral_m_s2: Annotated[
        PositiveAcceleration,
        msgspec.Meta(
            description="Lateral acceleration in a bend at most, in m/s2, above 0 to 100."
        ),
    ] = 1.5
    braking_m_s2: Annotated[
        PositiveAcceleration,
        msgspec.Meta(description="Deceleration when braking, in m/s2, above 0 to 100."),
    ] = 2.5
    clearance_m: Annotated[
        PositiveMetres,
        msgspec.Meta(
            description="Distance to an obstacle at which the robot stops, in m, above 0 to 10000."
        ),
    ] = robot.CLEARANCE_M
    half_width_m: Annotated[
        PositiveMetres,
        msgspec.Meta(description="Half the width that must be free ahead, in m, above 0 to 10000."),
    ] = robot.HALF_WIDTH_M
    wheel_radius_m: Annotated[
        PositiveMetres, msgspec.Meta(description="Radius of driven wheels, in m, above 0 to 10000.")
    ] = robot.WHEEL_RADIUS_M
    track_m: Annotated[
        PositiveMetres,
        msgspec.Meta(description="Distance between the driven wheels, in m, above 0 to 10000."),
    ] = robot.TRACK_M
    blind_m: Annotated[
        PositiveMetres,
        msgspec.Meta(
            description="Distance that the robot may travel within the age of its pose, in m, "
            "above 0 to 10000: the older the pose, the lower the speed."
        ),
    ] = 1.0
    max_pose_age_s: Annotated[
        PositiveSeconds,
        msgspec.Meta(
            description="Age of the pose at which the robot stops, in s, above 0 to 3600."
        ),
    ] = 2.0
    stuck_after_s: Annotated[
        PositiveSeconds,
        msgspec.Meta(
            description="Time that a robot may stand although it is commanded to move before it "
            "counts as stuck, in s, above 0 to 3600."
        ),
    ] = 5.0
    stuck_m_s: Annotated[
        PositiveSpeed,
        msgspec.Meta(description="Speed below which the robot stands, in m/s, above 0 to 100."),
    ] = 0.1
    dock_m_s: Annotated[
        PositiveSpeed, msgspec.Meta(description="Speed of docking, in m/s, above 0 to 100.")
    ] = 0.5
    docked_m: Annotated[
        PositiveMetres,
        msgspec.Meta(
            description="Distance from its target at which the robot has docked, in m, "
            "above 0 to 10000."
        ),
    ] = 0.5
    guided_m: Annotated[
        PositiveMetres,
        msgspec.Meta(
            description="Distance from the end of a guidance scheme's path at which the robot "
            "stops, in m, above 0 to 10000."
        ),
    ] = 0.5
    guided_share: Annotated[
        PositiveShare,
        msgspec.Meta(
            description="Share of what lies between the path of a guidance scheme and that of the "
            "one before by which the robot corrects its path, above 0 to 1: less is smoother."
        ),
    ] = 0.3
