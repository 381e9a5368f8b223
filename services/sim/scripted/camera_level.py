"""A robot that is led along a line, with cameras and wheels: pictures and odometry, as in a town.

It stands still until its first pictures are taken, so that all its way is seen.
"""

from __future__ import annotations

from schemas.base import Message
from schemas.sensing import Odometry, Pose, TrueTown
from services.sim.config import Config
from services.sim.layout import roadside
from services.sim.odometry import WheelOdometry
from services.sim.rendering.camera import StereoCamera, calibration
from services.sim.scripted.percept_level import TURN_AS_M, Led
from services.sim.scripted.trajectory import Way
from services.sim.world import World

_HERE = Pose(x_m=0.0, y_m=0.0, heading_rad=0.0)


class CameraLevelSim(Led):
    """Says what its cameras see and what its wheels report, which no engine turns: it is put where
    it is led.
    """

    def __init__(self, config: Config, way: Way) -> None:
        super().__init__(
            way, 1_000_000_000 // config.odometry_hz, config.odometry_hz // config.frame_hz
        )
        self.world = World(roadside.along(way, config.seed), config.egl)
        self.camera = StereoCamera(self.world, calibration(config.width_px, config.height_px))
        self._odometry = WheelOdometry(config.noise, config.seed)

    def step(self) -> list[Message]:
        """Let one tick pass, and say what the wheels report of it: of each straight and each turn
        on the spot.
        """
        since_ns = self.now_ns
        legs = self._go(self._way.speed_m_s if self._frames else 0.0)
        if not legs:
            return [
                Odometry(
                    stamp_ns=self.now_ns,
                    speed_m_s=0.0,
                    turn_rate_rad_s=0.0,
                    dt_s=self.tick_ns / 1e9,
                )
            ]
        pace_s = self._pace_s(legs)
        rows = []
        for length_m, turn_rad in legs:
            if length_m:
                rows.append(
                    self._rolled(Pose(x_m=length_m, y_m=0.0, heading_rad=0.0), pace_s * length_m)
                )
            if turn_rad:
                turned = Pose(x_m=0.0, y_m=0.0, heading_rad=turn_rad)
                rows.append(self._rolled(turned, pace_s * TURN_AS_M * abs(turn_rad)))
        passed_s = 0.0
        for row in rows:
            passed_s += row.dt_s
            row.stamp_ns = since_ns + round(1e9 * passed_s)
        rows[-1].stamp_ns = self.now_ns
        return [*rows]

    def view(self) -> list[Message]:
        """The next stereo frame, as of now."""
        self.world.lead(self._pose())
        return [self.camera.frame(self.now_ns, self._number())]

    def town(self) -> TrueTown:
        """The way and the buildings along it, as of now."""
        message = self.world.town.message()
        message.stamp_ns = self.now_ns
        return message

    def _rolled(self, there: Pose, dt_s: float) -> Odometry:
        return self._odometry.measure(_HERE, there, dt_s)
