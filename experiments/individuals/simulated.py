"""The module `sim` in lockstep, of a place that no configuration names."""

from __future__ import annotations

from collections.abc import Collection

import msgspec

from cogmap.experiments.individuals.places import BETWEEN
from cogmap.robot import calibration
from cogmap.runtime.config import Sections, typed
from cogmap.runtime.module import Module
from cogmap.runtime.run import SECTION, Run
from cogmap.schemas import topics
from cogmap.schemas.sensing import Pose, TrueTown
from cogmap.services.sim.config import ODOMETRY_HZ, Config
from cogmap.services.sim.drivers.kinematic import KinematicRobot
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.lockstep import Lockstep
from cogmap.services.sim.percept_level.senses import PerceptSenses, View
from cogmap.services.sim.percept_level.surroundings import Surroundings
from cogmap.services.sim.percept_level.town_sensors import TownSensors
from cogmap.services.sim.simulation import Simulation

_TRUTH = (topics.CLOCK, topics.TRUE_POSE, topics.TRUE_TOWN, topics.ENERGY)
_SENSED = {
    True: (*_TRUTH, topics.ODOMETRY, topics.STEREO),
    False: (*_TRUTH, topics.SELF_MOTION, topics.SCAN, topics.PERCEPTS),
}


def simulator(place: Place, sections: Sections) -> Module:
    """Return the module `sim` of a robot in `place`; all else is as it is configured."""
    config = typed(sections, "sim", Config)
    run = typed(sections, SECTION, Run)
    ticks_per_frame = ODOMETRY_HZ // config.frame_hz
    if config.renders:
        # It needs pybullet, which percept-level drives do not.
        from cogmap.services.sim.camera_level import CameraSenses, PhysicalRobot
        from cogmap.services.sim.world import World

        world = World(place, config.egl, whole=False)
        cameras = CameraSenses(world, config, is_placed=False)
        robot = PhysicalRobot(world, config)
        simulation = Simulation(
            config, robot, cameras, place=place, ticks_per_frame=ticks_per_frame
        )
    else:
        surroundings = Surroundings(place)
        kinematic = KinematicRobot(place.start, surroundings, config.noise, config.seed)
        mount = calibration(config.width_px, config.height_px)
        sensors = TownSensors(place, surroundings, config.percepts, mount, config.seed)
        percepts = PerceptSenses(LooksOnly(sensors), config.percepts, config.seed)
        simulation = Simulation(
            config, kinematic, percepts, place=place, ticks_per_frame=ticks_per_frame
        )

    emits = _SENSED[config.renders]
    lockstep = Lockstep(simulation)
    module = Module("sim").on(topics.MOTOR_COMMAND, lockstep.on_command, emits)
    return module.on_start(lockstep.on_start, run.participants, emits)


class LooksOnly:
    """Sees what `sensors` see, and calls each house after its look alone, without its number."""

    def __init__(self, sensors: TownSensors) -> None:
        self._sensors = sensors

    def look(self, pose: Pose) -> View:
        """Return all that is seen from a pose."""
        seen = self._sensors.look(pose)
        objects = []
        for percept in seen.objects:
            look, _, _ = percept.name.partition(BETWEEN)
            objects.append(msgspec.structs.replace(percept, name=look))
        return seen._replace(objects=objects)

    def change(self, closed: Collection[str], gone: Collection[int]) -> None:
        """Let these streets be closed and these buildings be gone, and no others."""
        self._sensors.change(closed, gone)

    def town(self, closed: Collection[str], gone: Collection[int]) -> TrueTown:
        """Return the town as it is then."""
        return self._sensors.town(closed, gone)
