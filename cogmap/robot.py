"""The robot: its body, and the stereo camera on its mast.

The simulation builds it, motor programs drive it, and attention and benchmarks reckon with its
width and with what its camera reaches. For another robot this file and its calibration change.
"""

from __future__ import annotations

import math

from cogmap.schemas.sensing import Calibration

WHEEL_RADIUS_M = 0.2
"""Radius of the two driven wheels."""

TRACK_M = 0.8
"""Distance between the driven wheels."""

MAX_WHEEL_RAD_S = 30.0
"""The fastest that the motors turn a wheel."""

BODY_RADIUS_M = 0.6
"""Half its width over the wheels."""

HALF_WIDTH_M = 0.7
"""Half the width that must be free where it drives: its body, and 0.1 m for the error of a range
at that distance.
"""

CAMERA_FORWARD_M = 0.3
"""How far before the axle the cameras are."""

CAMERA_RANGE_M = 60.0
"""Greatest depth that counts: there, the camera's disparity is 1.7 pixels."""

NEAREST_DEPTH_M = 2.2
"""Least depth that stereo matching finds: 48 pixels of disparity in images 320 pixels wide."""

NEAREST_SCAN_M = NEAREST_DEPTH_M + CAMERA_FORWARD_M + 0.1
"""The range scan has no range that is clearly below NEAREST_DEPTH_M, seen from the axle: something
with a range up to this may be nearer.
"""

CLEARANCE_M = NEAREST_SCAN_M
"""Distance to an obstacle ahead at which it stops: the last at which a range is known."""


def calibration(
    width_px: int = 320, height_px: int = 240, fov_rad: float = math.radians(75)
) -> Calibration:
    """Return the calibration of its camera for images of this size and horizontal field of view.

    The left camera sits on the robot's middle line. The right one is turned by
    `right_rotation_rad`, which takes directions in the right camera's frame to the left one's:
    OpenCV's R is its inverse.
    """
    focal_px = width_px / 2 / math.tan(fov_rad / 2)
    return Calibration(
        width_px=width_px,
        height_px=height_px,
        fx_px=focal_px,
        fy_px=focal_px,
        cx_px=(width_px - 1) / 2,
        cy_px=(height_px - 1) / 2,
        baseline_m=0.5,
        mount_height_m=1.5,
        mount_forward_m=CAMERA_FORWARD_M,
        right_rotation_rad=(0.004, -0.003, 0.006),
    )
