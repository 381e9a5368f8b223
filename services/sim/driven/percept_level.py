"""A robot that drives itself through a town and publishes percepts instead of images.

Neither physics nor images are simulated: an hour of driving takes a minute or two.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import msgspec
import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.robot import calibration
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.process import Clock
from cogmap.schemas.sensing import (
    MotorCommand,
    Odometry,
    Percepts,
    RangeScan,
    SelfMotion,
    TruePose,
    TrueTown,
)
from cogmap.services.sim.battery import Battery, PowerSupply
from cogmap.services.sim.config import Config, place_of
from cogmap.services.sim.driven.robot import KinematicRobot
from cogmap.services.sim.driven.sensors import Sensors
from cogmap.services.sim.driven.surroundings import Surroundings
from cogmap.services.sim.layout.closures import ClosedStreets
from cogmap.services.sim.layout.removals import RemovedBuildings
from cogmap.services.sim.odometry import Noise, WheelOdometry
from cogmap.services.sim.progress import Progress
from cogmap.services.sim.scripted.places import PlaceSim

Row = tuple[float, float, float, float, float]


class DrivenPerceptLevelSim:
    """Obeys motor commands, and publishes what sensory memory and EPAM would publish.

    Simulated time starts at 0 and advances by `tick_ns` with every step.
    """

    def __init__(self, config: Config, battery: Battery | None = None) -> None:
        self.tick_ns = 1_000_000_000 // config.odometry_hz
        self.ticks_per_frame = config.odometry_hz // config.frame_hz
        self.now_ns = 0
        self.progress = 0.0

        self._place = place_of(config, battery)
        self.closed_streets = ClosedStreets(self._place.roads, config.closures)
        self._removed = RemovedBuildings(len(self._place.plots), config.removals)
        self._surroundings = Surroundings(self._place)
        self._robot = KinematicRobot(self._place.start, self._surroundings)

        mount = calibration(config.width_px, config.height_px)
        self._sensors = Sensors(self._place, config.percepts, mount, config.seed)
        self._places = PlaceSim(config.percepts, config.seed)
        self._odometry = WheelOdometry(config.noise, config.seed)
        self._noise = config.noise
        self._power = PowerSupply(battery, self._place.charging_places_m)

        self._progress = Progress(config.duration_s, config.ends_at_goal)
        self._motions: list[Row] = []
        self._frames = 0

    def resume(self, past: Iterable[Message]) -> None:
        """Continue at the time and the place of the last true pose, at rest."""
        last: Message | None = None
        for message in past:
            last = message

        if not isinstance(last, TruePose):
            return

        self._robot.resume(last)
        self._progress.resume(last.progress)
        self._power.resume(last.energy)
        self.now_ns = last.stamp_ns
        self._frames = self.now_ns // self.tick_ns // self.ticks_per_frame

    def drive(self, command: MotorCommand) -> None:
        """Set the wheels' speeds, where there is energy."""
        self._progress.on_command(command)
        if not self._power.is_out:
            self._robot.drive(command)

    def step(self) -> list[Message]:
        """Advance by one tick; the self-motion of it is published with the view."""
        before = self._robot.pose
        dt_s = self.tick_ns / 1e9
        before_m = self._robot.travelled_m
        self._robot.advance(dt_s)
        self.now_ns += self.tick_ns
        moved_m = self._robot.travelled_m - before_m
        self._power.advance(self._robot.pose, moved_m, dt_s)
        if self._power.is_out:
            self._robot.brake()

        odometry = self._odometry.measure(before, self._robot.pose, dt_s)
        self._motions.append(_row(odometry, self._noise))
        return []

    def view(self) -> list[Message]:
        """Self-motion since the last view, range scan, the energy that is sensed, and percepts."""
        pose = self._robot.pose
        near = self._surroundings.near(pose.x_m, pose.y_m)
        seen = self._sensors.look(pose, near)

        frame = self._frames
        self._frames += 1
        stamp_ns = self.now_ns

        return [
            SelfMotion(
                stamp_ns=stamp_ns,
                frame=frame,
                since_ns=stamp_ns - self.tick_ns * len(self._motions),
                motions=Array.of(self._moved(), "<f8"),
            ),
            RangeScan(
                stamp_ns=stamp_ns,
                frame=frame,
                bearing_rad=Array.of(seen.bearing_rad),
                range_m=Array.of(seen.range_m),
            ),
            *self._power.sensed(stamp_ns, frame),
            Percepts(
                stamp_ns=stamp_ns,
                frame=frame,
                objects=seen.objects,
                road_m=Array.of(seen.road_m),
                road_boundary_m=Array.of(seen.boundary_m),
                matches=self._places.recognize(frame, stamp_ns, pose),
            ),
        ]

    def clock(self, rate: float) -> Clock:
        """The simulated time, which passes at `rate` times the wall's."""
        return Clock(stamp_ns=self.now_ns, rate=rate)

    def truth(self) -> TruePose:
        """The robot's true pose."""
        self.progress = self._progress.at(self.now_ns)

        return TruePose(
            stamp_ns=self.now_ns,
            pose=self._robot.pose,
            travelled_m=self._robot.travelled_m,
            progress=self.progress,
            collisions=self._robot.collisions,
            energy=self._power.level,
        )

    def town(self) -> TrueTown:
        """The town as it is now."""
        message = self._place.message(self.closed_streets.names, self._removed.numbers)
        return msgspec.structs.replace(message, stamp_ns=self.now_ns)

    def changed_town(self) -> TrueTown | None:
        """The town, where a street was closed or opened, or a building torn down, since the last
        call.
        """
        has_streets_changed = self.closed_streets.advance(self.now_ns)
        if has_streets_changed:
            self._surroundings.close(self.closed_streets.names)

        has_lost_buildings = self._removed.advance(self.now_ns)
        if has_lost_buildings:
            self._surroundings.remove(self._removed.numbers)

        return self.town() if has_streets_changed or has_lost_buildings else None

    def _moved(self) -> Floats:
        """(n, 5): the rows of self-motion since the last view."""
        rows = np.array(self._motions)
        self._motions = []
        return rows


def _row(odometry: Odometry, noise: Noise) -> Row:
    """What the wheels measured in a tick, with its standard deviations."""
    dt_s = odometry.dt_s
    distance_m = abs(odometry.speed_m_s) * dt_s
    drift_sd_rad_s = noise.drift_rad_per_sqrt_m * math.sqrt(distance_m) / dt_s
    factor_sd_rad_s = noise.turn * abs(odometry.turn_rate_rad_s)

    return (
        odometry.speed_m_s,
        odometry.turn_rate_rad_s,
        dt_s,
        noise.speed * abs(odometry.speed_m_s),
        math.hypot(factor_sd_rad_s, drift_sd_rad_s),
    )
