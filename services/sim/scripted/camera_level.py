"""A robot that follows a line, with cameras and wheels: images and odometry, as in a town.

It stands still until its first images are rendered, so that all of the line is seen.
"""

from __future__ import annotations

import msgspec

from cogmap.robot import calibration
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Odometry, Pose, TrueTown
from cogmap.services.sim.config import Config
from cogmap.services.sim.layout import roadside
from cogmap.services.sim.odometry import WheelOdometry
from cogmap.services.sim.rendering.camera import StereoCamera
from cogmap.services.sim.scripted.follower import TURN_AS_M, LineFollower
from cogmap.services.sim.scripted.trajectory import Leg, Trajectory
from cogmap.services.sim.world import World

_ORIGIN = Pose(x_m=0.0, y_m=0.0, heading_rad=0.0)


class CameraLevelSim(LineFollower):
    """Renders what its cameras see and measures what its wheels would report. Physics is not
    simulated: the robot is placed on its line.
    """

    def __init__(self, config: Config, trajectory: Trajectory) -> None:
        tick_ns = 1_000_000_000 // config.odometry_hz
        ticks_per_frame = config.odometry_hz // config.frame_hz
        super().__init__(trajectory, tick_ns, ticks_per_frame)

        place = roadside.along(trajectory, config.seed)
        mount = calibration(config.width_px, config.height_px)
        self.world = World(place, config.egl)
        self.camera = StereoCamera(self.world, mount)
        self._odometry = WheelOdometry(config.noise, config.seed)

    def step(self) -> list[Message]:
        """Advance by one tick: odometry of each straight and each turn on the spot."""
        since_ns = self.now_ns
        is_first_frame_taken = self._frames > 0
        legs = self._advance(self._trajectory.speed_m_s if is_first_frame_taken else 0.0)
        if not legs:
            return [self._at_rest()]

        rows = self._measure(legs)
        return self._stamped(rows, since_ns)

    def _stamped(self, rows: list[Odometry], since_ns: int) -> list[Message]:
        """The odometry of a tick, each row with the time of its end; the last one's is now."""
        passed_s = 0.0
        stamped: list[Message] = []
        for row in rows:
            passed_s += row.dt_s
            stamp_ns = since_ns + round(1e9 * passed_s)
            if row is rows[-1]:
                stamp_ns = self.now_ns
            stamped.append(msgspec.structs.replace(row, stamp_ns=stamp_ns))

        return stamped

    def view(self) -> list[Message]:
        """The next stereo frame."""
        self.world.place_robot(self._pose())

        number = self._next_frame()
        return [self.camera.frame(self.now_ns, number)]

    def town(self) -> TrueTown:
        """The line and the buildings along it."""
        town = self.world.town.message()
        return msgspec.structs.replace(town, stamp_ns=self.now_ns)

    def _at_rest(self) -> Odometry:
        return Odometry(
            stamp_ns=self.now_ns,
            speed_m_s=0.0,
            turn_rate_rad_s=0.0,
            dt_s=self.tick_ns / 1e9,
        )

    def _measure(self, legs: list[Leg]) -> list[Odometry]:
        """Odometry of each straight and each turn, which together take a tick."""
        pace_s = self._pace_s(legs)
        rows = []
        for length_m, turn_rad in legs:
            if length_m:
                ahead = Pose(x_m=length_m, y_m=0.0, heading_rad=0.0)
                rows.append(self._odometry.measure(_ORIGIN, ahead, pace_s * length_m))
            if turn_rad:
                turned = Pose(x_m=0.0, y_m=0.0, heading_rad=turn_rad)
                duration_s = pace_s * TURN_AS_M * abs(turn_rad)
                rows.append(self._odometry.measure(_ORIGIN, turned, duration_s))

        return rows
