"""The settings of sensory memory."""

from __future__ import annotations

from typing import Annotated

import msgspec

from cogmap.schemas.base import Share
from cogmap.services.sensory.self_motion.sense import Source


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Depth from stereo, self-motion, and the noise of the wheels (paper §5.4)."""

    self_motion: Annotated[
        Source,
        msgspec.Meta(
            description="What measures self-motion: the wheels alone, the views alone (no odometry "
            "is waited for), or both, each as far as the other bears it out."
        ),
    ] = Source.BOTH
    max_pixels: Annotated[
        int,
        msgspec.Meta(
            ge=10_000,
            le=10_000_000,
            description="Most pixels of a view: larger images are made smaller, with their "
            "calibration. The time of a view grows with them.",
        ),
    ] = 120_000
    nearest_m: Annotated[
        float,
        msgspec.Meta(
            ge=0,
            le=100,
            description="Least depth that stereo matching finds, in m. 0 is as near as disparities "
            "of 15 % of the width allow: 2.2 m with the town's camera.",
        ),
    ] = 0.0
    speed_noise: Annotated[
        Share,
        msgspec.Meta(description="Standard deviation of the factor on the wheels' speed."),
    ] = 0.1
    turn_noise: Annotated[
        Share,
        msgspec.Meta(description="Standard deviation of the factor on the wheels' turn rate."),
    ] = 0.1
    drift_rad_per_sqrt_m: Annotated[
        Share,
        msgspec.Meta(
            description="Standard deviation of the wheels' heading after a metre, in rad, growing "
            "with the root of the distance."
        ),
    ] = 0.02
