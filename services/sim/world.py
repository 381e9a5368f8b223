"""The town in pybullet: shapes with pictures, and a wheeled robot with physics."""

from __future__ import annotations

import logging
import math
import weakref
from collections.abc import Sequence
from functools import partial

import numpy as np

from cogmap.geometry.arrays import Singles
from cogmap.schemas.sensing import Pose
from cogmap.services.sim.layout.barriers import barriers
from cogmap.services.sim.layout.furniture import Prop
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.plan import Plot, Point, Road
from cogmap.services.sim.rendering import scenery
from cogmap.services.sim.rendering.egl import Egl
from cogmap.services.sim.rendering.egl_trial import works as egl_works
from cogmap.services.sim.rendering.light import relief
from cogmap.services.sim.robot import Robot
from cogmap.services.sim.scene.bodies import Bodies
from cogmap.services.sim.scene.builder import Builder
from cogmap.services.sim.scene.nearby import Nearby, Piece
from cogmap.services.sim.stdio import pybullet, quiet

STEP_S = 1 / 240
"""A step of the physics, pybullet's own."""

_GRAVITY_M_S2 = -9.81
_CONTACT_BODY = 2
# A collision is over where the robot has moved so far from it.
_RELEASED_M = 0.3
# Side of a square whose streets are shown and hidden together.
_TILE_M = 64.0
_log = logging.getLogger(__name__)


class World:
    """A place with a robot in it. Positions in metres, x east, y north, z up; close it when done.

    With `want_egl` it is rendered by EGL where that works, and only in one world at a time in a
    process (otherwise CogmapError). A place that is not `whole` consists of what is near the robot,
    and its obstacles stop the robot as its buildings do.
    """

    def __init__(self, town: Place, want_egl: bool = True, whole: bool = True) -> None:
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
        self.streets: list[int] = []
        self.collisions = 0
        self._barriers: dict[str, int] = {}
        self._closing = barriers(town.roads)
        self._solid: set[int] = set()
        self._touched_m: Point | None = None

        self._bodies = Bodies(self.client)
        self._builder = Builder(self._bodies)
        self._nearby: Nearby | None = None
        self._build(whole)
        self.robot = Robot(self.client, town.start)

    def step(self, dt_s: float) -> None:
        """Advance by `dt_s`, in steps of STEP_S."""
        steps = round(dt_s / STEP_S)

        for _ in range(steps):
            pybullet.stepSimulation(physicsClientId=self.client)

        # A collision begins when the robot touches something that stands on the ground; it may
        # bounce there.
        contacts = pybullet.getContactPoints(self.robot.body, physicsClientId=self.client)
        touched = {contact[_CONTACT_BODY] for contact in contacts or ()}
        is_touching = not self._solid.isdisjoint(touched)
        pose = self.robot.pose()
        here_m = (pose.x_m, pose.y_m)
        if self._touched_m is None:
            self.collisions += is_touching
            self._touched_m = here_m if is_touching else None
        elif not is_touching and math.dist(self._touched_m, here_m) > _RELEASED_M:
            self._touched_m = None

        if self._nearby is not None:
            self._follow(pose.x_m, pose.y_m)

    def pose(self) -> Pose:
        """Return the robot's pose."""
        return self.robot.pose()

    def place_robot(self, pose: Pose) -> None:
        """Put the robot there, at rest, with the ground under it and the sky around it, at any
        distance.
        """
        self.robot.place(pose)
        self._follow(pose.x_m, pose.y_m)

    def close_streets(self, names: frozenset[str]) -> None:
        """Let barriers close these streets, and no others."""
        for name, body in self._barriers.items():
            if name in names:
                self._bodies.show(body)
            else:
                self._bodies.hide(body)

        for name in sorted(names - self._barriers.keys()):
            (self._barriers[name],) = self._add_obstacle(self._closing[name])

    def close(self) -> None:
        """Leave pybullet; nothing of it stays."""
        self._leave()

    def _follow(self, x_m: float, y_m: float) -> None:
        """Let the ground, the sky and what is near follow the robot."""
        self._bodies.move(self._soil, _on_tile(x_m), _on_tile(y_m))
        self._bodies.move(self.sky, x_m, y_m)
        if self._nearby is not None:
            self._nearby.update(x_m, y_m)

    def _build(self, whole: bool) -> None:
        client = self.client
        pybullet.setGravity(0, 0, _GRAVITY_M_S2, physicsClientId=client)
        pybullet.setTimeStep(STEP_S, physicsClientId=client)

        self._soil = self._builder.soil()
        pybullet.changeDynamics(self._soil, -1, lateralFriction=1.0, physicsClientId=client)
        if not whole:
            self.sky = self._builder.sky()
            self._nearby = Nearby(self._pieces(), self._bodies.hide, self._bodies.show)
            self._follow(self.town.start.x_m, self.town.start.y_m)
            return

        self.streets = self._builder.streets(self.town.roads)[1:]
        self.sky = self._builder.sky()
        for plot in self.town.plots:
            self._add_building(plot)

        for prop in self.town.props:
            self.props.append(self._builder.prop(prop, is_solid=False))

    def _pieces(self) -> list[Piece]:
        """Return the pieces of the town: the streets tile by tile, the buildings and the props."""
        pieces = [_tile(self._builder, roads) for roads in _tiles(self.town.roads)]

        for plot in self.town.plots:
            at_m = (plot.x_m, plot.y_m)
            reach_m = math.hypot(plot.kind.width_m, plot.kind.depth_m) / 2
            pieces.append(Piece(at_m, reach_m, partial(self._add_building, plot)))

        for prop in self.town.props:
            at_m = (prop.x_m, prop.y_m)
            pieces.append(Piece(at_m, 0.0, partial(self._add_obstacle, prop)))

        return pieces

    def _add_building(self, plot: Plot) -> list[int]:
        body = self._builder.building(plot)
        self.building_of_body[body] = plot.kind.name
        self._solid.add(body)
        return [body]

    def _add_obstacle(self, prop: Prop) -> list[int]:
        body = self._builder.prop(prop, is_solid=True)
        self._solid.add(body)
        return [body]


def _tiles(roads: Sequence[Road]) -> list[tuple[Road, ...]]:
    """Group the roads by the tile of the plane that holds the middle of each."""
    tiles: dict[tuple[int, int], list[Road]] = {}
    for road in roads:
        x_m, y_m = road.middle
        column = math.floor(x_m / _TILE_M)
        row = math.floor(y_m / _TILE_M)

        tile = tiles.setdefault((column, row), [])
        tile.append(road)

    return [tuple(tiles[key]) for key in sorted(tiles)]


def _tile(builder: Builder, roads: tuple[Road, ...]) -> Piece:
    """Make one piece of the streets of a tile."""
    lines = [(road.start, road.end) for road in roads]
    ends_m = np.array(lines, float).reshape(-1, 2)
    low_m = ends_m.min(axis=0)
    high_m = ends_m.max(axis=0)
    widest_m = max(road.width_m for road in roads)

    middle_x_m, middle_y_m = ((low_m + high_m) / 2).tolist()
    diagonal_m = float(np.hypot(*(high_m - low_m)))
    reach_m = diagonal_m / 2 + widest_m

    add = partial(builder.streets, roads)
    return Piece((middle_x_m, middle_y_m), reach_m, add)


def _relief(town: Place) -> Singles:
    """Compute the relief of the town's buildings and props."""
    boxes = [(plot.footprint, plot.kind.height_m) for plot in town.plots]
    for prop in town.props:
        _, _, height_m = prop.size_m
        boxes.append((prop.area, height_m))

    return relief(boxes)


def _on_tile(where_m: float) -> float:
    """Round to a multiple of the grass's tile, so that its picture stays in place."""
    tiles = round(where_m / scenery.GRASS_TILE_M)

    return tiles * scenery.GRASS_TILE_M


def _leave(client: int, egl: Egl | None) -> None:
    with quiet():
        if egl is not None:
            egl.unload()
        pybullet.disconnect(physicsClientId=client)
