"""The simulation as a module: frames and odometry, or percepts, out; motor commands in."""

from __future__ import annotations

from cogmap.robot import calibration
from cogmap.runtime.module import Module
from cogmap.runtime.repetition import CHECK_NS
from cogmap.runtime.run import REAL_TIME, Run
from cogmap.schemas import topics
from cogmap.services.sim.battery import Battery
from cogmap.services.sim.config import ODOMETRY_HZ, Config, check, place_of
from cogmap.services.sim.drivers.kinematic import KinematicRobot
from cogmap.services.sim.drivers.line_follower import LineFollower
from cogmap.services.sim.layout.network import StreetNetwork
from cogmap.services.sim.lockstep import Lockstep
from cogmap.services.sim.percept_level.line_sensors import LineSensors
from cogmap.services.sim.percept_level.senses import PerceptSenses
from cogmap.services.sim.percept_level.street_sensors import StreetSensors
from cogmap.services.sim.percept_level.surroundings import Surroundings
from cogmap.services.sim.percept_level.town_sensors import TownSensors
from cogmap.services.sim.real_time import RealTime
from cogmap.services.sim.simulation import Simulation
from cogmap.services.sim.trajectory import Trajectory

__all__ = ["Config", "build"]

_ALWAYS = (topics.CLOCK, topics.PAUSED, topics.TRUE_POSE, topics.TRUE_TOWN, topics.ENERGY)
_CAMERA_LEVEL = (*_ALWAYS, topics.ODOMETRY, topics.STEREO)
_PERCEPT_LEVEL = (*_ALWAYS, topics.SELF_MOTION, topics.SCAN, topics.PERCEPTS)


def build(config: Config, instance: str = "sim", run: Run = REAL_TIME) -> Module:
    """Return the module `sim`, which does nothing where a recording is played in its place. Raises
    ConfigError as `check` does, and UsageError if images are to be rendered without pybullet.
    """
    if run.has_any("player"):
        return Module("sim", instance)

    check(config, run)
    module = Module("sim", instance)
    trajectory = config.trajectory
    battery = config.battery if run.energy else None
    ticks_per_frame = ODOMETRY_HZ // config.frame_hz
    emits = _CAMERA_LEVEL if config.renders else _PERCEPT_LEVEL

    if config.renders:
        # It needs pybullet, which percept-level drives do not.
        from cogmap.services.sim import camera_level

        if trajectory is None:
            simulation = camera_level.driven(config, battery, ticks_per_frame)
        else:
            simulation = camera_level.scripted(config, trajectory, ticks_per_frame)
    elif config.streets is not None:
        simulation = on_streets(config, config.streets)
    elif trajectory is None:
        simulation = driven(config, battery, ticks_per_frame)
    else:
        simulation = scripted(config, trajectory)

    if trajectory is None:
        module.on(topics.STREET_CLOSURE, simulation.closed_streets.on_closure)
        module.on(topics.RESET, simulation.on_reset, [topics.TRUE_POSE])
        module.journaling(topics.TRUE_POSE, simulation.resume, simulation.truth)

    # Time begins when these are ready: at least the simulation itself.
    required = run.participants or {"sim": 1}
    if run.lockstep:
        lockstep = Lockstep(simulation)
        module.on(topics.PRESENCE, lockstep.on_presence, [topics.PRESENCE])
        module.on(topics.MOTOR_COMMAND, lockstep.on_command, emits)
        module.on(topics.PAUSE, lockstep.on_pause, emits)
        module.on_start(lockstep.on_start, required, emits)
        return module.every(CHECK_NS, lockstep.on_timer, emits)

    real_time = RealTime(simulation)
    module.on(topics.MOTOR_COMMAND, real_time.on_command)
    module.on(topics.PAUSE, real_time.on_pause, [topics.PAUSED])
    module.on_start(real_time.on_start, required)
    return module.every(simulation.tick_ns, real_time.on_timer, emits)


def driven(config: Config, battery: Battery | None, ticks_per_frame: int) -> Simulation:
    """Return a robot that drives itself through the town that is configured, without physics."""
    place = place_of(config, battery)
    surroundings = Surroundings(place)
    robot = KinematicRobot(place.start, surroundings, config.noise, config.seed)
    mount = calibration(config.width_px, config.height_px)
    sensors = TownSensors(place, surroundings, config.percepts, mount, config.seed)
    senses = PerceptSenses(sensors, config.percepts, config.seed)
    return Simulation(
        config, robot, senses, place=place, battery=battery, ticks_per_frame=ticks_per_frame
    )


def on_streets(config: Config, network: StreetNetwork) -> Simulation:
    """Return a robot that drives itself along the streets of `network`, a view each tick."""
    place = network.place()
    surroundings = Surroundings(place)
    robot = KinematicRobot(place.start, surroundings, config.noise, config.seed)
    mount = calibration(config.width_px, config.height_px)
    sensors = StreetSensors(network, place, surroundings, config.percepts, mount, seed=config.seed)
    return Simulation(config, robot, PerceptSenses(sensors, config.percepts, config.seed))


def scripted(config: Config, trajectory: Trajectory) -> Simulation:
    """Return a robot that follows `trajectory`, a view each tick."""
    follower = LineFollower(trajectory, config.noise, config.seed)
    sensors = LineSensors(trajectory, follower, config.percepts, config.seed)
    return Simulation(config, follower, PerceptSenses(sensors, config.percepts, config.seed))
