"""The world and the sensors in it, tick by tick of the odometry."""

from __future__ import annotations

import math
from collections.abc import Iterable

import msgspec

from cogmap.robot import calibration
from cogmap.schemas.base import Message
from cogmap.schemas.process import Clock
from cogmap.schemas.sensing import MotorCommand, Odometry, StereoFrame, TruePose, TrueTown
from cogmap.services.sim.battery import Battery, PowerSupply
from cogmap.services.sim.config import Config, place_of
from cogmap.services.sim.layout.closures import ClosedStreets
from cogmap.services.sim.layout.town import Town
from cogmap.services.sim.odometry import WheelOdometry
from cogmap.services.sim.progress import Progress
from cogmap.services.sim.rendering.camera import StereoCamera
from cogmap.services.sim.world import World


class Simulation:
    """A town with a robot. Simulated time starts at 0 and advances by `tick_ns` with every tick."""

    def __init__(self, config: Config, battery: Battery | None = None) -> None:
        self.config = config
        self.tick_ns = 1_000_000_000 // config.odometry_hz
        self.ticks_per_frame = config.odometry_hz // config.frame_hz
        self.now_ns = 0
        self.progress = 0.0

        place = place_of(config, battery)
        self.closed_streets = ClosedStreets(place.roads, config.closures)
        self.world = World(place, config.egl, whole=isinstance(place, Town))
        mount = calibration(config.width_px, config.height_px)
        self.camera = StereoCamera(self.world, mount)

        self._odometry = WheelOdometry(config.noise, config.seed)
        self._power = PowerSupply(battery, place.charging_places_m)
        self._progress = Progress(config.duration_s, config.ends_at_goal)
        self._pose = self.world.pose()
        self._travelled_m = 0.0
        self._frames = 0

    def resume(self, past: Iterable[Message]) -> None:
        """Continue at the time and the place of the last true pose, at rest."""
        last: Message | None = None
        for message in past:
            last = message

        if not isinstance(last, TruePose):
            return

        self.world.robot.place(last.pose)
        self._pose = self.world.pose()
        self._travelled_m = last.travelled_m
        self.world.collisions = last.collisions
        self._progress.resume(last.progress)
        self._power.resume(last.energy)
        self.now_ns = last.stamp_ns
        self._frames = self.now_ns // self.tick_ns // self.ticks_per_frame

    def drive(self, command: MotorCommand) -> None:
        """Set the wheels' speeds, where there is energy."""
        self._progress.on_command(command)
        if self._power.is_out:
            return

        self.world.robot.drive(command.left_wheel_rad_s, command.right_wheel_rad_s)

    def brake(self) -> None:
        """Stop the wheels."""
        self.world.robot.drive(0.0, 0.0)

    def tick(self) -> Odometry:
        """Advance by one tick: the wheels' measurement of it."""
        before = self._pose
        dt_s = self.tick_ns / 1e9

        self.world.step(dt_s)
        self.now_ns += self.tick_ns
        self._pose = self.world.pose()

        dx_m = self._pose.x_m - before.x_m
        dy_m = self._pose.y_m - before.y_m
        moved_m = math.sqrt(dx_m**2 + dy_m**2)
        self._travelled_m += moved_m

        self._power.advance(self._pose, moved_m, dt_s)
        if self._power.is_out:
            self.brake()

        odometry = self._odometry.measure(before, self._pose, dt_s)
        return msgspec.structs.replace(odometry, stamp_ns=self.now_ns)

    def step(self) -> list[Message]:
        """As `tick`, in a list."""
        return [self.tick()]

    def view(self) -> list[Message]:
        """As `frame`, and the energy that is sensed with it."""
        frame = self.frame()
        return [frame, *self._power.sensed(frame.stamp_ns, frame.frame)]

    def frame(self) -> StereoFrame:
        """The next stereo frame."""
        number = self._frames
        self._frames += 1
        return self.camera.frame(self.now_ns, number)

    def clock(self, rate: float) -> Clock:
        """The simulated time, which passes at `rate` times the wall's."""
        return Clock(stamp_ns=self.now_ns, rate=rate)

    def truth(self) -> TruePose:
        """The robot's true pose."""
        self.progress = self._progress.at(self.now_ns)

        return TruePose(
            stamp_ns=self.now_ns,
            pose=self._pose,
            travelled_m=self._travelled_m,
            progress=self.progress,
            collisions=self.world.collisions,
            energy=self._power.level,
        )

    def changed_town(self) -> TrueTown | None:
        """The town, where a street was closed or opened since the last call."""
        if not self.closed_streets.advance(self.now_ns):
            return None

        self.world.close_streets(self.closed_streets.names)
        return self.town()

    def town(self) -> TrueTown:
        """The town as it is now."""
        town = self.world.town.message(self.closed_streets.names)
        return msgspec.structs.replace(town, stamp_ns=self.now_ns)
