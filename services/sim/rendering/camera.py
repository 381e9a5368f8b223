"""The stereo camera on the robot's mast."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
import numpy.typing as npt

from schemas.array import Array
from schemas.sensing import Calibration, StereoFrame
from services.sim.rendering.light import Light, brightness, shadow_top, expose
from services.sim.rendering.wall import Image
from services.sim.stdio import pybullet, quiet
from services.sim.world import World

Matrix = npt.NDArray[np.float64]
NEAR_M = 0.2
FAR_M = 400.0
_NOON = (-0.4, -0.7, 1.0)
# The camera's axes (x right, y down, z forward) in the robot's (x forward, y left, z up).
_MOUNT: Matrix = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], float)


def calibration(
    width_px: int = 320, height_px: int = 240, fov_rad: float = math.radians(75)
) -> Calibration:
    """A camera of this size and horizontal field of view.

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
        mount_forward_m=0.3,
        right_rotation_rad=(0.004, -0.003, 0.006),
    )


@dataclass(frozen=True)
class Exposure:
    """One camera's picture, uint8 (h, w, 3).

    In a survey also the true depth along the optical axis in metres, float32 (h, w), 0 in the sky,
    and pybullet's body at each pixel, int32 (h, w); else these are empty.
    """

    image: Image
    depth_m: npt.NDArray[np.float32] = field(default_factory=lambda: np.empty((0, 0), np.float32))
    body: npt.NDArray[np.int32] = field(default_factory=lambda: np.empty((0, 0), np.int32))


class StereoCamera:
    """Takes pictures of `world` from its robot."""

    def __init__(self, world: World, calibration: Calibration) -> None:
        self.calibration = calibration
        self._world = world
        self._projection = _projection(calibration)
        right, _ = cv2.Rodrigues(np.asarray(calibration.right_rotation_rad))
        self._right_turn: Matrix = np.asarray(right, float)
        columns, rows = np.meshgrid(
            np.arange(calibration.width_px), np.arange(calibration.height_px)
        )
        across = (columns - calibration.cx_px) / calibration.fx_px
        down = (rows - calibration.cy_px) / calibration.fy_px
        self._rays = np.stack([across, down, np.ones_like(across)], axis=2).astype(np.float32)
        # The first pictures take long, and EGL announces them.
        with quiet():
            self.capture()

    def capture(self) -> tuple[Image, Image]:
        """The left and the right picture from where the robot is."""
        (left, left_at), (right, right_at) = self._stations()
        return self._expose(left, left_at, False, None).image, self._expose(
            right, right_at, False, None
        ).image

    def frame(self, stamp_ns: int, number: int) -> StereoFrame:
        """As `capture`, as it travels."""
        left, right = self.capture()
        return StereoFrame(
            stamp_ns=stamp_ns,
            frame=number,
            left=Array.of(left),
            right=Array.of(right),
            calibration=self.calibration,
        )

    def capture_labelled(
        self, light: Light | None = None, rng: np.random.Generator | None = None
    ) -> tuple[Exposure, Exposure]:
        """As `capture`, with true depth and bodies, for learning and tests; in `light`, with noise
        from `rng`.
        """
        left, right = (self._expose(turn, at, True, light) for turn, at in self._stations())
        if light is None:
            return left, right
        rng = rng or np.random.default_rng(0)
        top_m = shadow_top(self._world.relief, light)
        lit = []
        for exposure, (turn, at) in zip((left, right), self._stations(), strict=True):
            rays = self._rays @ turn.T.astype(np.float32)
            bright = brightness(exposure.depth_m, rays, at, top_m, light)
            lit.append(replace(exposure, image=expose(exposure.image, bright, light, rng)))
        return lit[0], lit[1]

    def _stations(self) -> list[tuple[Matrix, Matrix]]:
        """Each camera's axes as columns, and its place, in the world."""
        position, quaternion = self._world.robot.position_and_orientation()
        turn = np.reshape(pybullet.getMatrixFromQuaternion(quaternion), (3, 3))
        mount = self.calibration
        axle_height_m = position[2]
        left_at = position + turn @ (
            mount.mount_forward_m,
            0.0,
            mount.mount_height_m - axle_height_m,
        )
        left = turn @ _MOUNT
        return [
            (left, left_at),
            (left @ self._right_turn, left_at + left @ (mount.baseline_m, 0.0, 0.0)),
        ]

    def _expose(self, turn: Matrix, at: Matrix, labelled: bool, light: Light | None) -> Exposure:
        mount = self.calibration
        world = self._world
        if world.egl is not None:
            world.egl.check()
        _, _, rgba, depth, mask = pybullet.getCameraImage(
            mount.width_px,
            mount.height_px,
            pybullet.computeViewMatrix(
                at.tolist(), (at + turn[:, 2]).tolist(), (-turn[:, 1]).tolist()
            ),
            self._projection,
            lightDirection=light.sun if light else _NOON,
            lightColor=(1, 1, 1),
            lightAmbientCoeff=0.62,
            lightDiffuseCoeff=0.42,
            lightSpecularCoeff=0.0,
            shadow=0,
            flags=0 if labelled else pybullet.ER_NO_SEGMENTATION_MASK,
            renderer=pybullet.ER_BULLET_HARDWARE_OPENGL if world.egl else pybullet.ER_TINY_RENDERER,
            physicsClientId=world.client,
        )
        image = np.ascontiguousarray(
            np.asarray(rgba, np.uint8).reshape(mount.height_px, mount.width_px, 4)[..., :3]
        )
        if not labelled:
            return Exposure(image)
        body = np.asarray(mask, np.int32)
        return Exposure(
            image, np.where(body == world.sky, np.float32(0), _metres(np.asarray(depth))), body
        )


def _metres(depth: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Depth along the axis from OpenGL's depth buffer."""
    metres = FAR_M * NEAR_M / (FAR_M - (FAR_M - NEAR_M) * depth.astype(np.float64))
    return metres.astype(np.float32)


def _projection(mount: Calibration) -> list[float]:
    """OpenGL's projection matrix, column by column, of a pinhole camera centred on its picture."""
    a = (FAR_M + NEAR_M) / (NEAR_M - FAR_M)
    b = 2 * FAR_M * NEAR_M / (NEAR_M - FAR_M)
    wide = 2 * mount.fx_px / mount.width_px
    high = 2 * mount.fy_px / mount.height_px
    return [wide, 0, 0, 0, 0, high, 0, 0, 0, 0, a, -1, 0, 0, b, 0]
