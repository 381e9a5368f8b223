"""How the simulation is configured."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from cogmap.errors import ConfigError
from services.sim.layout.catalogue import CATALOGUE
from services.sim.odometry import Noise
from services.sim.scripted.percepts import PerceptErrors
from services.sim.scripted.trajectory import Way
from services.sim.world import STEP_S

Rate = Annotated[int, msgspec.Meta(ge=1, le=240)]
Side = Annotated[int, msgspec.Meta(ge=64, le=1024)]
Instances = Annotated[int, msgspec.Meta(ge=1, le=1000)]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """`awaits` are the modules, and how many instances of each, that must be ready before time
    begins.

    Without `egl` TinyRenderer draws the pictures even where EGL would. With a `way` the robot is
    led along that, in lockstep, and senses it as that says: where it has no cameras, its percepts
    err as `percepts` tells.
    """

    seed: Annotated[int, msgspec.Meta(ge=0, le=2**32)] = 1
    mode: Literal["lockstep", "real_time"] = "real_time"
    frame_hz: Rate = 5
    odometry_hz: Rate = 20
    width_px: Side = 320
    height_px: Side = 240
    egl: bool = True
    laps: Annotated[float, msgspec.Meta(gt=0, le=1000)] = 1.0
    noise: Noise = Noise()
    percepts: PerceptErrors = PerceptErrors()
    way: Way | None = None
    awaits: dict[str, Instances] = {}


def check(config: Config) -> None:
    """Raise ConfigError where the rates do not divide one another, or a way cannot be led along as
    it is set up.
    """
    if config.odometry_hz % config.frame_hz:
        raise ConfigError(
            f"[sim] frame_hz is {config.frame_hz}: choose one that divides odometry_hz, {config.odometry_hz}"
        )
    if config.way is not None and config.mode != "lockstep":
        raise ConfigError(
            '[sim] a robot that is led along a way waits for its mind: set mode to "lockstep"'
        )
    if config.way is not None and config.way.sensing == "cameras":
        _check_names(config.way)
    if round(1 / STEP_S) % config.odometry_hz:
        raise ConfigError(
            f"[sim] odometry_hz is {config.odometry_hz}: choose one that divides {round(1 / STEP_S)}"
        )


def _check_names(way: Way) -> None:
    known = [kind.name for kind in CATALOGUE]
    for each in way.landmarks:
        if each.name not in known:
            raise ConfigError(
                f"[sim] cameras see no {each.name!r}: name each landmark after its kind of building, {', '.join(known)}"
            )
