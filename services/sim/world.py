"""The town in pybullet: shapes with pictures, and a wheeled robot with physics."""

from __future__ import annotations

import logging
import tempfile
import weakref
from collections.abc import Collection
from pathlib import Path

import cv2
import numpy as np

from cogmap.geometry.arrays import Singles
from schemas.sensing import Pose
from services.sim.layout.barriers import barrier
from services.sim.layout.furniture import Prop
from services.sim.layout.place import Place
from services.sim.layout.plan import Plot, Point
from services.sim.rendering import mesh, prop_shapes, scenery
from services.sim.rendering.egl import Egl
from services.sim.rendering.egl import works as egl_works
from services.sim.rendering.light import relief
from services.sim.rendering.wall import Image
from services.sim.robot import Robot, upright_quaternion
from services.sim.stdio import pybullet, quiet

STEP_S = 1 / 240
_GRAVITY_M_S2 = -9.81
_NOT_SOLID = -1
_CONTACT_BODY = 2
_ORIGIN = (0.0, 0.0)
_log = logging.getLogger(__name__)


class World:
    """A place with a robot in it. Positions in metres, x east, y north, z up; close it when done.

    With `want_egl` it is rendered by EGL where that works, and only in one world at a time in a
    process (otherwise CogmapError).
    """

    def __init__(self, town: Place, want_egl: bool = True) -> None:
        self.town = town
        with quiet():
            self.client: int = pybullet.connect(pybullet.DIRECT)

        self.egl = Egl.load(self.client) if want_egl and egl_works() else None
        self._leave = weakref.finalize(self, _leave, self.client, self.egl)
        renderer = "EGL" if self.egl else "TinyRenderer, more slowly than by EGL"
        _log.info("the camera's pictures are drawn by %s", renderer)

        self.relief = _relief(town)
        self.building_of_body: dict[int, str] = {}
        self.props: list[int] = []
        self.collisions = 0
        self._barriers: dict[str, int] = {}
        self._solid: set[int] = set()
        self._is_touching = False
        self.streets: list[int] = []
        self._build()
        self.robot = Robot(self.client, town.start)

    def step(self, dt_s: float) -> None:
        """Advance by `dt_s`, in steps of STEP_S."""
        steps = round(dt_s / STEP_S)

        for _ in range(steps):
            pybullet.stepSimulation(physicsClientId=self.client)

        self._count_collisions()

    def close_streets(self, names: Collection[str]) -> None:
        """Let barriers close these streets, and no others."""
        for name in sorted(self._barriers.keys() - names):
            body = self._barriers.pop(name)
            self._solid.discard(body)
            pybullet.removeBody(body, physicsClientId=self.client)

        for road in self.town.roads:
            if road.name in names and road.name not in self._barriers:
                self._barriers[road.name] = self._add_obstacle(barrier(road))

    def pose(self) -> Pose:
        """The robot's pose."""
        return self.robot.pose()

    def place_robot(self, pose: Pose) -> None:
        """Put the robot there, at rest, with the ground under it and the sky around it, at any
        distance.
        """
        self.robot.place(pose)
        self._move(self._soil, _on_tile(pose.x_m), _on_tile(pose.y_m))
        self._move(self.sky, pose.x_m, pose.y_m)

    def close(self) -> None:
        """Leave pybullet; nothing of it stays."""
        self._leave()

    def _count_collisions(self) -> None:
        """Count when the robot begins to touch something that stands on the ground."""
        contacts = pybullet.getContactPoints(self.robot.body, physicsClientId=self.client)
        touched = {contact[_CONTACT_BODY] for contact in contacts or ()}
        is_touching = not self._solid.isdisjoint(touched)
        if is_touching and not self._is_touching:
            self.collisions += 1

        self._is_touching = is_touching

    def _move(self, body: int, x_m: float, y_m: float) -> None:
        upright = (0, 0, 0, 1)
        pybullet.resetBasePositionAndOrientation(
            body,
            (x_m, y_m, 0),
            upright,
            physicsClientId=self.client,
        )

    def _build(self) -> None:
        client = self.client
        pybullet.setGravity(0, 0, _GRAVITY_M_S2, physicsClientId=client)
        pybullet.setTimeStep(STEP_S, physicsClientId=client)

        self._add_ground()
        self.sky = self._add(*scenery.sky())
        for plot in self.town.plots:
            self._add_building(plot)

        for prop in self.town.props:
            self._add_prop(prop)

    def _add_ground(self) -> None:
        grass, pavement, *streets = scenery.ground(self.town.roads)
        floor = self._solid_box(scenery.GROUND_M, scenery.GROUND_M, 1.0, middle_m=-1.0)
        self._soil = self._add(*grass, floor)
        pybullet.changeDynamics(self._soil, -1, lateralFriction=1.0, physicsClientId=self.client)

        self._add(*pavement)
        self.streets = [self._add(*street) for street in streets]

    def _add_building(self, plot: Plot) -> None:
        kind = plot.kind
        half_height_m = kind.height_m / 2
        solid = self._solid_box(
            kind.width_m / 2,
            kind.depth_m / 2,
            half_height_m,
            middle_m=half_height_m,
        )

        surface, picture = mesh.building(kind)
        body = self._add(surface, picture, solid, (plot.x_m, plot.y_m), plot.heading_rad)
        self.building_of_body[body] = kind.name
        self._solid.add(body)

    def _add_prop(self, prop: Prop) -> None:
        surface, picture = prop_shapes.shape(prop)
        at_m = (prop.x_m, prop.y_m)

        body = self._add(surface, picture, at_m=at_m, heading_rad=prop.heading_rad)
        self.props.append(body)

    def _add_obstacle(self, prop: Prop) -> int:
        """Add a prop that nothing passes."""
        length_m, width_m, height_m = prop.size_m
        half_m = (length_m / 2, width_m / 2, height_m / 2)
        solid = self._solid_box(*half_m, middle_m=height_m / 2)

        surface, picture = prop_shapes.shape(prop)
        at_m = (prop.x_m, prop.y_m)
        body = self._add(surface, picture, solid, at_m, prop.heading_rad)
        self._solid.add(body)

        return body

    def _solid_box(self, half_x_m: float, half_y_m: float, half_z_m: float, middle_m: float) -> int:
        """A box that nothing passes, its middle at height `middle_m`."""
        return int(
            pybullet.createCollisionShape(
                pybullet.GEOM_BOX,
                halfExtents=[half_x_m, half_y_m, half_z_m],
                collisionFramePosition=[0, 0, middle_m],
                physicsClientId=self.client,
            )
        )

    def _add(
        self,
        surface: mesh.Mesh,
        picture: Image,
        solid: int = _NOT_SOLID,
        at_m: Point = _ORIGIN,
        heading_rad: float = 0.0,
    ) -> int:
        """Add a body. Its shape and picture go through files, as all renderers of pybullet load
        nothing else.
        """
        client = self.client
        with tempfile.TemporaryDirectory(prefix="cogmap-") as folder:
            form, paint = _written(surface, picture, Path(folder))
            shape = pybullet.createVisualShape(
                pybullet.GEOM_MESH,
                fileName=form,
                specularColor=[0, 0, 0],
                physicsClientId=client,
            )
            body = pybullet.createMultiBody(
                0,
                solid,
                shape,
                (*at_m, 0.0),
                upright_quaternion(heading_rad),
                physicsClientId=client,
            )
            texture = pybullet.loadTexture(paint, physicsClientId=client)

        pybullet.changeVisualShape(body, -1, textureUniqueId=texture, physicsClientId=client)

        return int(body)


def _written(surface: mesh.Mesh, picture: Image, folder: Path) -> tuple[str, str]:
    """The files of a shape and of the picture on it."""
    form = folder / "surface.obj"
    form.write_text(surface.obj())

    paint = folder / "texture.bmp"
    bgr = np.ascontiguousarray(picture[..., ::-1])
    cv2.imwrite(str(paint), bgr)
    return str(form), str(paint)


def _relief(town: Place) -> Singles:
    """The height of the town's buildings and props."""
    boxes = [(plot.footprint, plot.kind.height_m) for plot in town.plots]
    for prop in town.props:
        _, _, height_m = prop.size_m
        boxes.append((prop.area, height_m))

    return relief(boxes)


def _on_tile(where_m: float) -> float:
    """The nearest multiple of the grass's tile, so that its picture stays in place."""
    tiles = round(where_m / scenery.GRASS_TILE_M)

    return tiles * scenery.GRASS_TILE_M


def _leave(client: int, egl: Egl | None) -> None:
    with quiet():
        if egl is not None:
            egl.unload()
        pybullet.disconnect(physicsClientId=client)
