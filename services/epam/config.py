"""How perception is configured."""

from __future__ import annotations

from typing import Annotated

import msgspec

from schemas.sensing import Unit

Positive = Annotated[float, msgspec.Meta(gt=0)]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The weights are ONNX files, those in this package where empty.

    What is a building with a probability over `percept_threshold` becomes a percept, by the name of
    the node that is likeliest, and with that node's total activation, base level and current. A
    building of no known node gets one where it covers `learned_share` of the view; another look of
    it is learned where it is recognised with an activation over `sure`. What fits its known size
    worse than `worst_misfit` deviations, or stands nobody knows where, is placed as a building of
    the usual size would be.
    """

    segments_weights: str = ""
    object_weights: str = ""
    road_weights: str = ""
    base_level: Unit = 0.0
    percept_threshold: Unit = 0.7
    learned_share: Unit = 0.03
    sure: Unit = 0.95
    narrowest_px: Annotated[int, msgspec.Meta(ge=4, le=1000)] = 8
    worst_misfit: Positive = 2.0
    worst_range_sd_share: Positive = 0.15
