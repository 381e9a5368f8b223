"""How perception is configured."""

from __future__ import annotations

from typing import Annotated

import msgspec

from schemas.sensing import Unit

Positive = Annotated[float, msgspec.Meta(gt=0)]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The weights are ONNX files, those in this package where empty.

    A node becomes a percept when its total activation, base level and current, is over `percept_threshold`; a building
    of no known node gets one where it covers `learned_share` of the view. What fits its known size worse than
    `worst_misfit` deviations, or stands nobody knows where, is placed as a building of the usual size would be.
    """

    segments_weights: str = ""
    object_weights: str = ""
    road_weights: str = ""
    base_level: Unit = 0.0
    percept_threshold: Unit = 0.7
    learned_share: Unit = 0.01
    narrowest_px: Annotated[int, msgspec.Meta(ge=4, le=1000)] = 8
    worst_misfit: Positive = 2.0
    worst_range_sd_share: Positive = 0.15
