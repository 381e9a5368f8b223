"""The settings of the simulation."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Annotated, Literal

import msgspec

from cogmap.errors import ConfigError, UsageError
from cogmap.runtime.run import Run
from cogmap.services.sim.battery import Battery
from cogmap.services.sim.layout import towns
from cogmap.services.sim.layout.catalogue import CATALOGUE
from cogmap.services.sim.layout.closures import Closure
from cogmap.services.sim.layout.network import StreetNetwork
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.removals import Removal
from cogmap.services.sim.odometry import Noise
from cogmap.services.sim.percept_level.percepts import PerceptErrors
from cogmap.services.sim.trajectory import Trajectory

NEEDS_PYBULLET = (
    "rendering needs pybullet, which has wheels for Python 3.11 on Linux x86-64 only: "
    "`pip install 'cogmap[rendering]'` there, use the container, or drive at the level of "
    "percepts, as `cogmap run --tour` does: it renders nothing"
)
ODOMETRY_HZ = 20
"""Odometry messages a second, as wheel encoders of small robots are read."""

Side = Annotated[int, msgspec.Meta(ge=64, le=1024)]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A town or a street network with a robot in it, or a trajectory that a robot follows."""

    seed: Annotated[
        int,
        msgspec.Meta(ge=0, le=2**32, description="Seed of the town and of all noise."),
    ] = 1
    frame_hz: Annotated[
        int,
        msgspec.Meta(ge=1, le=20, description="Stereo frames a second, in Hz, a divisor of 20."),
    ] = 5
    width_px: Annotated[Side, msgspec.Meta(description="Width of a camera image, in pixels.")] = 320
    height_px: Annotated[Side, msgspec.Meta(description="Height of a camera image, in pixels.")] = (
        240
    )
    egl: Annotated[
        bool,
        msgspec.Meta(description="Render by EGL where it works; otherwise by TinyRenderer."),
    ] = True
    noise: Annotated[Noise, msgspec.Meta(description="Noise of the wheels' odometry.")] = Noise()
    percepts: Annotated[
        PerceptErrors,
        msgspec.Meta(description="Errors of percepts without cameras."),
    ] = PerceptErrors()
    battery: Annotated[
        Battery, msgspec.Meta(description="The battery and its charging, if run.energy is set.")
    ] = Battery()
    town: Annotated[
        str,
        msgspec.Meta(
            description="loop: a loop of streets. blocks: several blocks, with districts. "
            "osm:FILE: the streets and buildings of an OpenStreetMap extract. "
            "FILE.toml: a town of your own.",
        ),
    ] = "loop"
    town_size_m: Annotated[
        float,
        msgspec.Meta(ge=120, le=500, description="Side of a town of blocks, in m."),
    ] = 200.0
    start: Annotated[
        int,
        msgspec.Meta(
            ge=0,
            le=10**9,
            description="Number of the start in the town: 0 is the usual one, from 1 on others.",
        ),
    ] = 0
    sensing: Annotated[
        Literal["cameras", "percepts"],
        msgspec.Meta(
            description="cameras: rendered images and odometry are published, and perception "
            "runs. percepts: published with the errors that perception was measured to make."
        ),
    ] = "cameras"
    duration_s: Annotated[
        float,
        msgspec.Meta(
            gt=0,
            le=1e6,
            description="Simulated time of a drive at most, in s.",
        ),
    ] = 900.0
    ends_at_goal: Annotated[
        bool,
        msgspec.Meta(
            description="Whether the drive ends when the robot halts as every goal is reached."
        ),
    ] = False
    closures: Annotated[
        list[Closure], msgspec.Meta(description="Streets that are closed for some time.")
    ] = []
    removals: Annotated[
        list[Removal],
        msgspec.Meta(
            description="Buildings that are torn down while the robot drives; in a town that is "
            "sensed by percepts."
        ),
    ] = []
    trajectory: Annotated[
        Trajectory | None,
        msgspec.Meta(description="Line that the robot follows in lockstep, instead of a town."),
    ] = None
    streets: Annotated[
        StreetNetwork | None,
        msgspec.Meta(
            description="Streets without houses that the robot drives on, sensed by percepts, "
            "instead of a town."
        ),
    ] = None

    @property
    def renders(self) -> bool:
        """Return whether images are rendered, rather than percepts simulated."""
        sensing = self.sensing if self.trajectory is None else self.trajectory.sensing
        return sensing == "cameras"


def place_of(config: Config, battery: Battery | None = None) -> Place:
    """Return the town that is configured, with charging places for `battery`. Raises UsageError if
    there is none.
    """
    return towns.place(
        config.town,
        config.seed,
        config.town_size_m,
        start=config.start,
        charging_places=0 if battery is None else battery.places,
    )


def check(config: Config, run: Run) -> None:
    """Raise ConfigError if a town, a trajectory, or the removal of buildings, is not possible as it
    is set up, and UsageError if images cannot be rendered here.
    """
    if ODOMETRY_HZ % config.frame_hz:
        raise ConfigError(
            f"[sim] frame_hz is {config.frame_hz}: choose one that divides the odometry's rate, "
            f"{ODOMETRY_HZ}"
        )

    towns.check(config.town)

    if config.removals and config.sensing != "percepts":
        raise ConfigError(
            '[sim] removals: cameras cannot see that a building is gone: set sensing to "percepts"'
        )

    if config.streets is not None and (config.sensing != "percepts" or config.trajectory):
        raise ConfigError(
            "[sim] streets without houses are sensed by percepts, and have no trajectory: set "
            'sensing to "percepts" and leave trajectory out'
        )

    if config.renders and find_spec("pybullet") is None:
        raise UsageError(NEEDS_PYBULLET)

    trajectory = config.trajectory
    if trajectory is None:
        return

    if run.energy:
        raise ConfigError(
            "[sim] a robot that follows a trajectory needs no energy: set run.energy to false"
        )

    if not run.lockstep:
        raise ConfigError(
            "[sim] a robot follows a trajectory in lockstep only: set run.lockstep to true"
        )

    known = [kind.name for kind in CATALOGUE]
    for landmark in trajectory.landmarks:
        if trajectory.sensing == "cameras" and landmark.name not in known:
            raise ConfigError(
                f"[sim] cameras see no {landmark.name!r}: name each landmark after its kind of "
                f"building, {', '.join(known)}"
            )
