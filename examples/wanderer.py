"""A module that drives by the range scan alone, in the place of `motor`.

Run it beside the others: `cogmap run --without motor`, and `python examples/wanderer.py`; `--help`
lists its options.
"""

from __future__ import annotations

from typing import Annotated

import msgspec
import numpy as np

from cogmap import MessageError, Module, run_program, topics
from cogmap.schemas.sensing import MotorCommand, RangeScan

AHEAD_RAD = 0.3

Speed = Annotated[
    float, msgspec.Meta(gt=0, le=50, description="Speed of the wheels, in rad/s, above 0 to 50.")
]
Clearance = Annotated[
    float, msgspec.Meta(gt=0, le=100, description="Distance that is free, in m, above 0 to 100.")
]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The settings of the wanderer."""

    cruise_rad_s: Speed = 10.0
    clearance_m: Clearance = 4.0


class Wanderer:
    """Drives straight on, and turns left where something is in its way."""

    def __init__(self, config: Config) -> None:
        self._config = config

    def on_scan(self, scan: RangeScan) -> MotorCommand:
        """Return the command that answers a scan.

        Raises MessageError if it has not as many bearings as ranges.
        """
        bearing_rad = scan.bearing_rad.numpy().astype(np.float64)
        range_m = scan.range_m.numpy().astype(np.float64)
        if bearing_rad.shape != range_m.shape:
            raise MessageError(f"scan with {bearing_rad.shape} bearings, {range_m.shape} ranges")

        is_ahead = np.abs(bearing_rad) < AHEAD_RAD
        is_close = (range_m > 0) & (range_m < self._config.clearance_m)
        blocked = bool((is_ahead & is_close).any())

        right_rad_s = self._config.cruise_rad_s
        left_rad_s = 0.0 if blocked else right_rad_s
        return MotorCommand(
            stamp_ns=scan.stamp_ns, left_wheel_rad_s=left_rad_s, right_wheel_rad_s=right_rad_s
        )


def build(config: Config, instance: str = "") -> Module:
    """Build the module `motor`, by range scan alone."""
    wanderer = Wanderer(config)
    module = Module("motor", instance)
    return module.on(topics.SCAN, wanderer.on_scan, emits=[topics.MOTOR_COMMAND])


if __name__ == "__main__":
    run_program(build, Config, "wanderer")
