"""The settings of the player."""

from __future__ import annotations

from typing import Annotated

import msgspec


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
    speed: Annotated[
        float,
        msgspec.Meta(
            ge=0.01,
            le=100,
            description="How many times as fast it is played as it was recorded, in real time; in "
            "lockstep it goes as fast as the agent does.",
        ),
    ] = 1.0
