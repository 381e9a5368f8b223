"""Rendered towns as sensory memory sees them."""

from __future__ import annotations

import msgspec
import numpy as np

from cogmap.robot import NEAREST_DEPTH_M
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import Calibration, View
from cogmap.services.sensory.disparity import DepthFromStereo
from cogmap.services.sensory.rectify import rectification
from cogmap.training.rendering.towns import Views

PERIOD_NS = 200_000_000


def seen(views: Views) -> list[View]:
    """The views of a town, one every 200 ms."""
    calibration = msgspec.json.decode(views["calibration"].tobytes(), type=Calibration)
    rectified = rectification(calibration)
    matcher = DepthFromStereo(rectified.calibration, NEAREST_DEPTH_M)
    lefts = np.asarray(views["left"], np.uint8)
    rights = np.asarray(views["right"], np.uint8)

    result = []
    for number, images in enumerate(zip(lefts, rights, strict=True)):
        left, right = rectified.apply(*images)
        view = View(
            stamp_ns=(number + 1) * PERIOD_NS,
            frame=number,
            image=Array.of(left),
            depth_m=Array.of(matcher.depth_m(left, right)),
            calibration=rectified.calibration,
        )
        result.append(view)
    return result
