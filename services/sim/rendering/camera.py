"""The stereo camera on the robot's mast."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Floats, Singles
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import Calibration, StereoFrame
from cogmap.services.sim.rendering import shadow_map
from cogmap.services.sim.rendering.light import Light, brightness, expose, shadow_top
from cogmap.services.sim.rendering.wall import Image
from cogmap.services.sim.stdio import pybullet, quiet
from cogmap.services.sim.world import World

# Images show no more: as near as the body lets anything come, and beyond the ground's corners.
NEAR_M = 0.2
FAR_M = 400.0
_NOON = (-0.4, -0.7, 1.0)
# The camera's axes (x right, y down, z forward) in the robot's (x forward, y left, z up).
_MOUNT: Floats = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], float)


@dataclass(frozen=True)
class Exposure:
    """One camera's image, uint8 (h, w, 3).

    A labelled one has also the true depth along the optical axis in metres, float32 (h, w), 0 in
    the sky, and pybullet's body at each pixel, int32 (h, w); otherwise these are empty.
    """

    image: Image
    depth_m: Singles = field(default_factory=lambda: np.empty((0, 0), np.float32))
    body: npt.NDArray[np.int32] = field(default_factory=lambda: np.empty((0, 0), np.int32))


class Station(NamedTuple):
    """A camera's axes as columns (3, 3), and its place (3,), in the world."""

    axes: Floats
    at_m: Floats


class StereoCamera:
    """Renders images of `world` from its robot."""

    def __init__(self, world: World, calibration: Calibration) -> None:
        self.calibration = calibration
        self._world = world
        self._projection = _projection(calibration)
        self._rays = _rays(calibration)
        rotation, _ = cv2.Rodrigues(np.asarray(calibration.right_rotation_rad))
        self._right_rotation: Floats = np.asarray(rotation, float)
        # The first images take long, and EGL announces them.
        with quiet():
            self.capture()
        if world.egl is not None:
            shadow_map.shrink()

    def capture(self) -> tuple[Image, Image]:
        """Render the left and the right image from where the robot is."""
        left, right = (self._render(station) for station in self._stations())
        return left.image, right.image

    def frame(self, stamp_ns: int, number: int) -> StereoFrame:
        """Render as `capture` does, and return the images as a message."""
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
        """Render as `capture` does, with true depth and bodies, for training and tests; in `light`,
        with noise from `rng`.
        """
        left_station, right_station = self._stations()
        left = self._render(left_station, True, light)
        right = self._render(right_station, True, light)
        if light is None:
            return left, right

        rng = rng or np.random.default_rng(0)
        top_m = shadow_top(self._world.relief, light)
        return (
            self._lit(left, left_station, top_m, light, rng),
            self._lit(right, right_station, top_m, light, rng),
        )

    def _lit(
        self,
        exposure: Exposure,
        station: Station,
        top_m: Singles,
        light: Light,
        rng: np.random.Generator,
    ) -> Exposure:
        """Return the exposure in `light`, with shadows up to `top_m`."""
        rays = self._rays @ station.axes.T.astype(np.float32)
        bright = brightness(exposure.depth_m, rays, station.at_m, top_m, light)
        image = expose(exposure.image, bright, light, rng)
        return replace(exposure, image=image)

    def _stations(self) -> tuple[Station, Station]:
        """Locate the left and the right camera."""
        position_m, quaternion = self._world.robot.position_and_orientation()
        matrix = pybullet.getMatrixFromQuaternion(quaternion)
        robot_axes = np.reshape(matrix, (3, 3))

        mount = self.calibration
        above_axle_m = mount.mount_height_m - position_m[2]
        left_at_m = position_m + robot_axes @ (mount.mount_forward_m, 0.0, above_axle_m)
        left_axes = robot_axes @ _MOUNT

        right_at_m = left_at_m + left_axes @ (mount.baseline_m, 0.0, 0.0)
        right_axes = left_axes @ self._right_rotation

        return (
            Station(left_axes, left_at_m),
            Station(right_axes, right_at_m),
        )

    def _render(
        self, station: Station, labelled: bool = False, light: Light | None = None
    ) -> Exposure:
        """Render what one camera sees, with depth and bodies if it is `labelled`."""
        world = self._world
        if world.egl is not None:
            world.egl.check()

        _, down, forward = station.axes.T
        target = (station.at_m + forward).tolist()
        view = pybullet.computeViewMatrix(station.at_m.tolist(), target, (-down).tolist())

        mount = self.calibration
        _, _, rgba, depth, mask = pybullet.getCameraImage(
            mount.width_px,
            mount.height_px,
            view,
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
        pixels = np.asarray(rgba, np.uint8).reshape(mount.height_px, mount.width_px, 4)
        image = np.ascontiguousarray(pixels[..., :3])
        if not labelled:
            return Exposure(image)

        body = np.asarray(mask, np.int32)
        is_sky = body == world.sky
        # Depth along the axis from OpenGL's depth buffer.
        nearer_m = (FAR_M - NEAR_M) * np.asarray(depth, np.float64)
        depth_m = (FAR_M * NEAR_M / (FAR_M - nearer_m)).astype(np.float32)
        return Exposure(image, np.where(is_sky, np.float32(0), depth_m), body)


def _rays(calibration: Calibration) -> Singles:
    """Compute the (h, w, 3) direction of each pixel in the camera's axes, of length 1 along the
    optical axis.
    """
    columns = np.arange(calibration.width_px)
    rows = np.arange(calibration.height_px)

    right = (columns - calibration.cx_px) / calibration.fx_px
    down = (rows - calibration.cy_px) / calibration.fy_px

    x, y = np.meshgrid(right, down)
    forward = np.ones_like(x)
    rays = np.stack([x, y, forward], axis=2)

    return rays.astype(np.float32)


def _projection(mount: Calibration) -> list[float]:
    """Return OpenGL's projection matrix of a pinhole camera centred on its image, by columns."""
    range_m = NEAR_M - FAR_M
    a = (FAR_M + NEAR_M) / range_m
    b = 2 * FAR_M * NEAR_M / range_m

    wide = 2 * mount.fx_px / mount.width_px
    high = 2 * mount.fy_px / mount.height_px

    return [wide, 0, 0, 0, 0, high, 0, 0, 0, 0, a, -1, 0, 0, b, 0]
