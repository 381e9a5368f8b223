"""The depth that sensory memory computes from rendered stereo pairs."""

from __future__ import annotations

import cv2
import msgspec
import numpy as np

from cogmap.schemas.sensing import Calibration
from cogmap.services.sensory.disparity import DepthFromStereo
from cogmap.services.sensory.module import Config
from cogmap.services.sensory.rectify import rectification
from cogmap.training.rendering.towns import Views


def with_stereo_depth(views: Views) -> Views:
    """Return `views` with the rectified `left` image and its calibration, and, instead of the
    `right` image, the depth `stereo_m` float32 (n, h, w), 0 where it is unknown.
    """
    cv2.setNumThreads(1)
    encoded = views["calibration"].tobytes()
    calibration = msgspec.json.decode(encoded, type=Calibration)
    rectified = rectification(calibration)
    matcher = DepthFromStereo(rectified.calibration, Config().nearest_m)

    lefts = []
    depths_m = []
    for raw_left, raw_right in zip(views["left"], views["right"], strict=True):
        left, right = rectified.apply(raw_left, raw_right)
        depth_m = matcher.depth_m(left, right)
        lefts.append(left)
        depths_m.append(depth_m)

    rectified_encoded = msgspec.json.encode(rectified.calibration)
    unchanged = {key: value for key, value in views.items() if key not in ("left", "right")}
    return unchanged | {
        "left": np.asarray(lefts),
        "stereo_m": np.asarray(depths_m),
        "calibration": np.frombuffer(rectified_encoded, np.uint8),
    }
