"""The settings of the player."""

from __future__ import annotations

from typing import Annotated

import msgspec

from cogmap.schemas.base import Metres


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A recording that is played in the place of the simulation."""

    recording: Annotated[
        str,
        msgspec.Meta(
            description="The recording, as FORMAT:PATH; `cogmap run --help` lists the formats. "
            "Empty if the run is simulated."
        ),
    ] = ""
    robot: Annotated[
        int,
        msgspec.Meta(
            ge=1, le=1000, description="Number of the robot, where a recording has several."
        ),
    ] = 1
    left_topic: Annotated[
        str,
        msgspec.Meta(
            description="Topic of the left camera's images in a bag. Empty if its name, or what "
            "the cameras say of where they stand, tells it."
        ),
    ] = ""
    right_topic: Annotated[
        str,
        msgspec.Meta(description="The same of the right camera's."),
    ] = ""
    odometry_topic: Annotated[
        str,
        msgspec.Meta(description="Topic of the odometry in a bag. Empty if it has one or none."),
    ] = ""
    scan_topic: Annotated[
        str,
        msgspec.Meta(
            description="Topic of the laser scans in a bag without a stereo camera. Empty if it "
            "has one."
        ),
    ] = ""
    mount_height_m: Annotated[
        Metres,
        msgspec.Meta(
            description="How high above the ground a bag's cameras stand. 0 is as its static "
            "transforms say, or 1 m."
        ),
    ] = 0.0
    speed: Annotated[
        float,
        msgspec.Meta(
            ge=0.01,
            le=100,
            description="How many times as fast it is played as it was recorded, in real time; in "
            "lockstep it goes as fast as the agent does.",
        ),
    ] = 1.0
