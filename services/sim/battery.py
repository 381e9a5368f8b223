"""The robot's battery: it runs down with time and with the distance driven, and is charged where
the robot stands at a charging place. Pure.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Annotated

import msgspec

from cogmap.schemas.base import Message, PositiveMetres, PositiveSeconds, Share
from cogmap.schemas.sensing import Energy, Pose
from cogmap.services.sim.layout.plan import Point

# A robot that is slower stands, and may be charged.
STANDS_M_S = 0.05


class Battery(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """How long a charge lasts, and where and how fast the battery is charged."""

    capacity_s: Annotated[
        float,
        msgspec.Meta(
            gt=0,
            le=1e9,
            description="Time that a full battery lasts at rest, in s.",
        ),
    ] = 1500.0
    cost_per_m: Annotated[
        Share,
        msgspec.Meta(description="Share of a full battery that a metre's drive costs."),
    ] = 0.001
    charge_s: Annotated[
        PositiveSeconds,
        msgspec.Meta(description="Time in which an empty battery would be charged, in s."),
    ] = 60.0
    charge_within_m: Annotated[
        PositiveMetres,
        msgspec.Meta(
            description="Distance from a charging place at most, of a robot that is charged as it "
            "stands, in m."
        ),
    ] = 7.0
    places: Annotated[
        int, msgspec.Meta(ge=1, le=100, description="Charging places in the town.")
    ] = 4


class PowerSupply:
    """The level of the battery, 1 where it is full; once it is 0 it stays 0, and the robot is out.

    Without a battery the robot is never out, and senses no energy.
    """

    def __init__(self, battery: Battery | None, places_m: Iterable[Point]) -> None:
        self._battery = battery
        self._places_m = tuple(places_m)
        self._level = 1.0
        self._is_charging = False

    @property
    def is_out(self) -> bool:
        """Return whether the wheels get no power any more."""
        return self._level <= 0.0

    @property
    def level(self) -> float | msgspec.UnsetType:
        """Return the true level, 0 to 1; UNSET without a battery."""
        return msgspec.UNSET if self._battery is None else self._level

    def resume(self, level: float | msgspec.UnsetType) -> None:
        """Continue from a level."""
        if level is not msgspec.UNSET:
            self._level = level

    def advance(self, pose: Pose, moved_m: float, dt_s: float) -> None:
        """Take account of `dt_s` in which the robot moved so far, to `pose`."""
        battery = self._battery
        if battery is None or self.is_out:
            return

        stands = moved_m <= STANDS_M_S * dt_s
        here_m = (pose.x_m, pose.y_m)
        away_m = min((math.dist(here_m, at_m) for at_m in self._places_m), default=math.inf)
        self._is_charging = stands and away_m <= battery.charge_within_m
        if self._is_charging:
            self._level = min(1.0, self._level + dt_s / battery.charge_s)
            return

        used = dt_s / battery.capacity_s + moved_m * battery.cost_per_m
        self._level = max(0.0, self._level - used)

    def sensed(self, stamp_ns: int, frame: int) -> list[Message]:
        """Return the energy that the body senses with a view; nothing without a battery."""
        if self._battery is None:
            return []

        energy = Energy(
            stamp_ns=stamp_ns, frame=frame, level=self._level, is_charging=self._is_charging
        )
        return [energy]
