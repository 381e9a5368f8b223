"""The town as pybullet knows it: shapes with pictures, and a wheeled robot with physics."""

from __future__ import annotations

import logging
import math
import tempfile
import weakref
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from schemas.sensing import Pose
from services.sim.layout.plan import Plot
from services.sim.layout.town import Place
from services.sim.rendering import mesh, prop_shapes, scenery
from services.sim.rendering.egl import Egl
from services.sim.rendering.egl import works as egl_works
from services.sim.rendering.light import relief
from services.sim.rendering.wall import Image
from services.sim.robot import Robot
from services.sim.stdio import pybullet, quiet

STEP_S = 1 / 240
_log = logging.getLogger(__name__)


class World:
    """A place with a robot in it. Positions in metres, x east, y north, z up; close it when done.

    With `want_egl` EGL draws it where it works, and only in one world at a time in a process (else
    CogmapError).
    """

    def __init__(self, town: Place, want_egl: bool = True) -> None:
        self.town = town
        with quiet():
            self.client: int = pybullet.connect(pybullet.DIRECT)
        self.egl = Egl.load(self.client) if want_egl and egl_works() else None
        self._leave = weakref.finalize(self, _leave, self.client, self.egl)
        _log.info(
            "the camera's pictures are drawn by %s",
            "EGL" if self.egl else "TinyRenderer, more slowly than by EGL",
        )
        plots = [(plot.footprint, plot.kind.height_m) for plot in town.plots]
        self.relief = relief(plots + [(prop.area, prop.size_m[2]) for prop in town.props])
        self.building_of_body: dict[int, str] = {}
        self.props: list[int] = []
        self.streets: list[int] = []
        self._build()
        self.robot = Robot(self.client, town.start)

    def step(self, dt_s: float) -> None:
        """Let `dt_s` pass, in steps of STEP_S."""
        for _ in range(round(dt_s / STEP_S)):
            pybullet.stepSimulation(physicsClientId=self.client)

    def pose(self) -> Pose:
        """Where the robot is."""
        return self.robot.pose()

    def place_robot(self, pose: Pose) -> None:
        """Put the robot there, at rest, with the ground under it and the sky around it, however far
        that is.
        """
        self.robot.place(pose)
        under = [
            round(where / scenery.GRASS_TILE_M) * scenery.GRASS_TILE_M
            for where in (pose.x_m, pose.y_m)
        ]
        for body, (x_m, y_m) in ((self._soil, under), (self.sky, (pose.x_m, pose.y_m))):
            pybullet.resetBasePositionAndOrientation(
                body, (x_m, y_m, 0), (0, 0, 0, 1), physicsClientId=self.client
            )

    def close(self) -> None:
        """Leave pybullet; nothing of it stays."""
        self._leave()

    def _build(self) -> None:
        client = self.client
        pybullet.setGravity(0, 0, -9.81, physicsClientId=client)
        pybullet.setTimeStep(STEP_S, physicsClientId=client)
        half = [scenery.GROUND_M, scenery.GROUND_M, 1.0]
        floor = pybullet.createCollisionShape(
            pybullet.GEOM_BOX,
            halfExtents=half,
            collisionFramePosition=[0, 0, -1.0],
            physicsClientId=client,
        )
        grass, pavement, *street = scenery.ground(self.town.roads)
        self._soil = self._add(*grass, floor)
        pybullet.changeDynamics(self._soil, -1, lateralFriction=1.0, physicsClientId=client)
        self._add(*pavement)
        self.streets = [self._add(surface, picture) for surface, picture in street]
        self.sky = self._add(*scenery.sky())
        for plot in self.town.plots:
            self._raise(plot)
        for prop in self.town.props:
            self.props.append(
                self._add(
                    *prop_shapes.shape(prop),
                    place=(prop.x_m, prop.y_m, 0.0),
                    heading_rad=prop.heading_rad,
                )
            )

    def _raise(self, plot: Plot) -> None:
        kind = plot.kind
        half = [kind.width_m / 2, kind.depth_m / 2, kind.height_m / 2]
        solid = pybullet.createCollisionShape(
            pybullet.GEOM_BOX,
            halfExtents=half,
            collisionFramePosition=[0, 0, half[2]],
            physicsClientId=self.client,
        )
        body = self._add(*mesh.building(kind), solid, (plot.x_m, plot.y_m, 0.0), plot.heading_rad)
        self.building_of_body[body] = kind.name

    def _add(
        self,
        surface: mesh.Mesh,
        picture: Image,
        solid: int = -1,
        place: Sequence[float] = (0.0, 0.0, 0.0),
        heading_rad: float = 0.0,
    ) -> int:
        """Add a body. Its shape and picture go through files, the only way that every renderer of
        pybullet takes.
        """
        with tempfile.TemporaryDirectory(prefix="cogmap-") as folder:
            form = Path(folder) / "surface.obj"
            paint = Path(folder) / "texture.bmp"
            form.write_text(surface.obj())
            cv2.imwrite(str(paint), np.ascontiguousarray(picture[..., ::-1]))
            shape = pybullet.createVisualShape(
                pybullet.GEOM_MESH,
                fileName=str(form),
                specularColor=[0, 0, 0],
                physicsClientId=self.client,
            )
            turned = (0.0, 0.0, math.sin(heading_rad / 2), math.cos(heading_rad / 2))
            body = int(
                pybullet.createMultiBody(
                    0, solid, shape, place, turned, physicsClientId=self.client
                )
            )
            texture = pybullet.loadTexture(str(paint), physicsClientId=self.client)
        pybullet.changeVisualShape(body, -1, textureUniqueId=texture, physicsClientId=self.client)
        return body


def _leave(client: int, egl: Egl | None) -> None:
    with quiet():
        if egl is not None:
            egl.unload()
        pybullet.disconnect(physicsClientId=client)
