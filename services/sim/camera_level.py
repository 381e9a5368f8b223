"""Camera-level sensing: renders what the cameras see, and publishes what the wheels measure.

What is here needs pybullet; nothing else of the simulation imports it.
"""

from __future__ import annotations

import math
from collections.abc import Collection

from cogmap.robot import calibration
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import MotorCommand, Odometry, Pose, TruePose, TrueTown
from cogmap.services.sim.battery import Battery
from cogmap.services.sim.config import Config, place_of
from cogmap.services.sim.drivers.line_follower import LineFollower
from cogmap.services.sim.layout import roadside
from cogmap.services.sim.layout.town import Town
from cogmap.services.sim.odometry import Motion, WheelOdometry
from cogmap.services.sim.rendering.camera import StereoCamera
from cogmap.services.sim.simulation import Simulation
from cogmap.services.sim.trajectory import Trajectory
from cogmap.services.sim.world import World


class PhysicalRobot:
    """Drives the robot of a `world` by its physics."""

    course_share = None

    def __init__(self, world: World, config: Config) -> None:
        self.pose = world.pose()
        self.travelled_m = 0.0
        self._world = world
        self._odometry = WheelOdometry(config.noise, config.seed)

    @property
    def collisions(self) -> int:
        """Return how often it ran into something."""
        return self._world.collisions

    def drive(self, command: MotorCommand) -> None:
        """Obey a command from now on."""
        self._world.robot.drive(command.left_wheel_rad_s, command.right_wheel_rad_s)

    def brake(self) -> None:
        """Stop the wheels."""
        self._world.robot.drive(0.0, 0.0)

    def resume(self, last: TruePose) -> None:
        """Continue at the last true pose, at rest."""
        self._world.place_robot(last.pose)
        self._world.robot.drive(0.0, 0.0)
        self._world.collisions = last.collisions
        self.pose = self._world.pose()
        self.travelled_m = last.travelled_m

    def advance(self, dt_s: float) -> list[Motion]:
        """Move for `dt_s`."""
        before = self.pose
        self._world.step(dt_s)
        self.pose = self._world.pose()

        dx_m = self.pose.x_m - before.x_m
        dy_m = self.pose.y_m - before.y_m
        self.travelled_m += math.sqrt(dx_m**2 + dy_m**2)
        return [self._odometry.measure(before, self.pose, dt_s)]


class CameraSenses:
    """Publishes stereo frames of `world` and wheel odometry. If its robot has no physics, it is
    placed where it is before each frame.
    """

    def __init__(self, world: World, config: Config, is_placed: bool) -> None:
        self.camera = StereoCamera(world, calibration(config.width_px, config.height_px))
        self.world = world
        self._is_placed = is_placed

    def on_motion(self, motions: list[Motion], since_ns: int, stamp_ns: int) -> list[Message]:
        """Return odometry for each motion of a tick, stamped with the time of its end."""
        passed_s = 0.0
        published: list[Message] = []
        for motion in motions:
            passed_s += motion.dt_s
            ends_ns = stamp_ns if motion is motions[-1] else since_ns + round(1e9 * passed_s)
            odometry = Odometry(
                stamp_ns=ends_ns,
                speed_m_s=motion.speed_m_s,
                turn_rate_rad_s=motion.turn_rate_rad_s,
                dt_s=motion.dt_s,
            )
            published.append(odometry)

        return published

    def view(self, pose: Pose, stamp_ns: int, frame: int, energy: list[Message]) -> list[Message]:
        """Return the stereo frame, and the energy that is sensed with it."""
        if self._is_placed:
            self.world.place_robot(pose)
        return [self.camera.frame(stamp_ns, frame), *energy]

    def change(self, closed: frozenset[str], gone: frozenset[int]) -> None:
        """Let barriers close these streets, and no others."""
        self.world.close_streets(closed)

    def town(self, closed: Collection[str], gone: Collection[int]) -> TrueTown:
        """Return the place as it is then."""
        return self.world.town.message(closed, gone)


def driven(config: Config, battery: Battery | None, ticks_per_frame: int) -> Simulation:
    """Return a robot with physics and cameras in the town that is configured."""
    place = place_of(config, battery)
    world = World(place, config.egl, whole=isinstance(place, Town))
    senses = CameraSenses(world, config, is_placed=False)
    robot = PhysicalRobot(world, config)
    return Simulation(
        config, robot, senses, place=place, battery=battery, ticks_per_frame=ticks_per_frame
    )


def scripted(config: Config, trajectory: Trajectory, ticks_per_frame: int) -> Simulation:
    """Return a robot with cameras that follows `trajectory`. It stands until its first images are
    rendered, so that all of the line is seen.
    """
    world = World(roadside.along(trajectory, config.seed), config.egl)
    senses = CameraSenses(world, config, is_placed=True)
    follower = LineFollower(trajectory, config.noise, config.seed, rest_ticks=ticks_per_frame)
    return Simulation(config, follower, senses, ticks_per_frame=ticks_per_frame)
