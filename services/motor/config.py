"""The settings of sensory-motor memory."""

from __future__ import annotations

from typing import Annotated

import msgspec

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
        PositiveSpeed, msgspec.Meta(description="Speed on a free straight, in m/s.")
    ] = 4.0
    lateral_m_s2: Annotated[
        PositiveAcceleration,
        msgspec.Meta(description="Lateral acceleration in a bend at most, in m/s2."),
    ] = 1.5
    braking_m_s2: Annotated[
        PositiveAcceleration,
        msgspec.Meta(description="Deceleration when braking, in m/s2."),
    ] = 2.5
    blind_m: Annotated[
        PositiveMetres,
        msgspec.Meta(
            description="Distance that the robot may travel within the age of its pose, in m: the "
            "older the pose, the lower the speed."
        ),
    ] = 1.0
    max_pose_age_s: Annotated[
        PositiveSeconds,
        msgspec.Meta(description="Age of the pose at which the robot stops, in s."),
    ] = 2.0
    stuck_after_s: Annotated[
        PositiveSeconds,
        msgspec.Meta(
            description="Time that a robot may stand, although it is commanded to move, before it "
            "counts as stuck, in s."
        ),
    ] = 5.0
    guided_share: Annotated[
        PositiveShare,
        msgspec.Meta(
            description="Share of what lies between the path of a guidance scheme and that of the "
            "one before by which the robot corrects its path: less is smoother."
        ),
    ] = 0.3
