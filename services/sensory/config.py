"""The settings of sensory memory."""

from __future__ import annotations

from typing import Annotated

import msgspec

from cogmap.robot import NEAREST_DEPTH_M
from cogmap.schemas.base import Share


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Depth from stereo, and the noise of the wheels (paper §5.4)."""

    nearest_m: Annotated[
        float,
        msgspec.Meta(ge=0.1, le=100, description="Least depth that stereo matching finds, in m."),
    ] = NEAREST_DEPTH_M
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
