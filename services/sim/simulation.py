"""The simulation, tick by tick: a driver moves the robot, and senses publish what it measures."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Protocol

import msgspec

from cogmap.schemas.base import Message
from cogmap.schemas.process import Clock
from cogmap.schemas.sensing import (
    MotorCommand,
    Pose,
    Reset,
    SpeedLimit,
    TruePose,
    TrueTown,
)
from cogmap.services.sim.battery import Battery, PowerSupply
from cogmap.services.sim.config import Config
from cogmap.services.sim.layout.closures import ClosedStreets
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.removals import RemovedBuildings
from cogmap.services.sim.odometry import Motion


class Driver(Protocol):
    """Moves the robot: by physics, by kinematics alone, or along a line."""

    @property
    def pose(self) -> Pose:
        """Return the true pose: the middle of the axle, and the heading."""

    @property
    def travelled_m(self) -> float:
        """Return the distance that it has travelled."""

    @property
    def collisions(self) -> int:
        """Return how often it ran into something."""

    @property
    def course_share(self) -> float | None:
        """Return the share of its course that it has travelled; None without a course."""

    def drive(self, command: MotorCommand) -> None:
        """Obey a command from now on."""

    def brake(self) -> None:
        """Stop the wheels."""

    def resume(self, last: TruePose) -> None:
        """Continue at the last true pose, at rest."""

    def advance(self, dt_s: float) -> list[Motion]:
        """Move for `dt_s`, and return the self-motion that the wheels measure."""


class Senses(Protocol):
    """Publishes what the robot measures of a place, by cameras or as percepts."""

    def on_motion(self, motions: list[Motion], since_ns: int, stamp_ns: int) -> list[Message]:
        """Take account of the self-motion of a tick; return what is published at once."""

    def view(self, pose: Pose, stamp_ns: int, frame: int, energy: list[Message]) -> list[Message]:
        """Return what is published of a view, with the energy that is sensed in it."""

    def change(self, closed: frozenset[str], gone: frozenset[int]) -> None:
        """Let these streets be closed and these buildings be gone, and no others."""

    def town(self, closed: Collection[str], gone: Collection[int]) -> TrueTown:
        """Return the place as it is then."""


class Simulation:
    """Simulated time starts at 0 and advances by `tick_ns` with every step, `ticks_per_frame` of
    them between two views.

    Without a `place` there is nothing in it that changes, and nothing to be charged at.
    """

    def __init__(
        self,
        config: Config,
        driver: Driver,
        senses: Senses,
        *,
        place: Place | None = None,
        battery: Battery | None = None,
        ticks_per_frame: int = 1,
    ) -> None:
        self.ticks_per_frame = ticks_per_frame
        self.tick_ns = 1_000_000_000 // (config.frame_hz * ticks_per_frame)
        self.now_ns = 0
        self.progress = 0.0
        self.is_resumed = False
        self.driver = driver
        self.senses = senses

        self.closed_streets = ClosedStreets((), ())
        self._removed = RemovedBuildings(0, ())
        self._power = PowerSupply(None, ())
        self._start = driver.pose
        self._resets = 0
        if place is not None:
            self._start = place.start
            self.closed_streets = ClosedStreets(place.roads, config.closures)
            self._removed = RemovedBuildings(len(place.plots), config.removals)
            self._power = PowerSupply(battery, place.charging_places_m)

        self._duration_ns = config.duration_s * 1e9
        self._ends_at_goal = config.ends_at_goal
        self._is_over = False
        self._frames = 0

    def resume(self, past: Iterable[Message]) -> None:
        """Continue at the time and the place of the last true pose, at rest; what was over stays
        over.
        """
        last: Message | None = None
        for message in past:
            last = message

        if not isinstance(last, TruePose):
            return

        self.is_resumed = True
        self.driver.resume(last)
        self._is_over = last.progress >= 1.0
        self._power.resume(last.energy)
        self._resets = last.resets or 0
        self.now_ns = last.stamp_ns
        self._frames = self.now_ns // self.tick_ns // self.ticks_per_frame

    def on_reset(self, _reset: Reset) -> list[Message]:
        """Carry the robot back to where it began, at rest; return its pose there. Time goes on, and
        the robot senses nothing of the way.
        """
        self._resets += 1
        self.driver.resume(msgspec.structs.replace(self.truth(), pose=self._start))
        return [self.truth()]

    def drive(self, command: MotorCommand) -> None:
        """Set the wheels' speeds if there is energy. A drive that ends at its goal is over once a
        command halts the robot there.
        """
        if self._ends_at_goal and command.halted_by is SpeedLimit.AT_GOAL:
            self._is_over = True
        if not self._power.is_out:
            self.driver.drive(command)

    def brake(self) -> None:
        """Stop the wheels."""
        self.driver.brake()

    def step(self) -> list[Message]:
        """Advance by one tick; return what is measured meanwhile and published at once."""
        dt_s = self.tick_ns / 1e9
        since_ns = self.now_ns
        before_m = self.driver.travelled_m
        motions = self.driver.advance(dt_s)
        self.now_ns += self.tick_ns

        self._power.advance(self.driver.pose, self.driver.travelled_m - before_m, dt_s)
        if self._power.is_out:
            self.driver.brake()

        return self.senses.on_motion(motions, since_ns, self.now_ns)

    def view(self) -> list[Message]:
        """Return the next view."""
        frame = self._frames
        self._frames += 1
        energy = self._power.sensed(self.now_ns, frame)
        return self.senses.view(self.driver.pose, self.now_ns, frame, energy)

    def clock(self, rate: float) -> Clock:
        """Return the simulated time, which passes at `rate` times the wall's."""
        return Clock(stamp_ns=self.now_ns, rate=rate)

    def truth(self) -> TruePose:
        """Return the robot's true pose. Progress is the share of its course that it has travelled,
        and without a course the share of the drive's duration.
        """
        share = self.driver.course_share
        if share is None:
            share = 1.0 if self._is_over else min(1.0, self.now_ns / self._duration_ns)
        self.progress = share

        return TruePose(
            stamp_ns=self.now_ns,
            pose=self.driver.pose,
            travelled_m=self.driver.travelled_m,
            progress=share,
            collisions=self.driver.collisions,
            energy=self._power.level,
            resets=self._resets or msgspec.UNSET,
        )

    def town(self) -> TrueTown:
        """Return the town as it is now."""
        town = self.senses.town(self.closed_streets.names, self._removed.numbers)
        return msgspec.structs.replace(town, stamp_ns=self.now_ns)

    def changed_town(self) -> list[Message]:
        """Return the town, if a street was closed or opened, or a building torn down, since the
        last call.
        """
        has_streets_changed = self.closed_streets.advance(self.now_ns)
        has_lost_buildings = self._removed.advance(self.now_ns)
        if not has_streets_changed and not has_lost_buildings:
            return []

        self.senses.change(self.closed_streets.names, self._removed.numbers)
        return [self.town()]
