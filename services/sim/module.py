"""The simulation as a module: frames and odometry out, motor commands in."""

from __future__ import annotations

from cogmap.runtime.module import Module
from cogmap.runtime.run import REAL_TIME, Run
from cogmap.schemas import topics
from cogmap.services.sim.config import Config, check
from cogmap.services.sim.driven.percept_level import DrivenPerceptLevelSim
from cogmap.services.sim.lockstep import REPEAT_CHECK_NS, Lockstep, SteppedSim
from cogmap.services.sim.real_time import RealTime
from cogmap.services.sim.scripted.camera_level import CameraLevelSim
from cogmap.services.sim.scripted.percept_level import PerceptLevelSim
from cogmap.services.sim.simulation import Simulation

__all__ = ["Config", "build"]

_ALWAYS = (topics.CLOCK, topics.TRUE_POSE, topics.TRUE_TOWN)
_CAMERA_LEVEL = (*_ALWAYS, topics.ODOMETRY, topics.STEREO, topics.ENERGY)
_PERCEPT_LEVEL = (*_ALWAYS, topics.SELF_MOTION, topics.SCAN, topics.ENERGY, topics.PERCEPTS)


def build(config: Config, instance: str = "sim", run: Run = REAL_TIME) -> Module:
    """The module `sim`. Raises ConfigError as `check` does."""
    check(config, run)
    module = Module("sim", instance)
    battery = config.battery if run.energy else None
    if config.trajectory is not None:
        # The robot follows it, whatever it is commanded.
        if config.trajectory.sensing == "cameras":
            cameras = CameraLevelSim(config, config.trajectory)
            return _in_lockstep(module, config, run, cameras, _CAMERA_LEVEL)

        scripted = PerceptLevelSim(
            config.trajectory, config.noise, config.percepts, config.frame_hz, config.seed
        )
        return _in_lockstep(module, config, run, scripted, _PERCEPT_LEVEL)

    if config.sensing == "percepts":
        percepts = DrivenPerceptLevelSim(config, battery)
        module.on(topics.STREET_CLOSURE, percepts.closed_streets.on_closure)
        module.journaling(topics.TRUE_POSE, percepts.resume, percepts.truth)
        return _in_lockstep(module, config, run, percepts, _PERCEPT_LEVEL)

    simulation = Simulation(config, battery)
    module.on(topics.STREET_CLOSURE, simulation.closed_streets.on_closure)
    module.journaling(topics.TRUE_POSE, simulation.resume, simulation.truth)
    if run.lockstep:
        return _in_lockstep(module, config, run, simulation, _CAMERA_LEVEL)

    real_time = RealTime(simulation, config.command_timeout_s, config.max_command_age_s)
    module.on(topics.MOTOR_COMMAND, real_time.on_command)
    module.on_start(real_time.on_start, _required(run))
    return module.every(simulation.tick_ns, real_time.on_timer, _CAMERA_LEVEL)


def _in_lockstep(
    module: Module,
    config: Config,
    run: Run,
    simulation: SteppedSim,
    emits: tuple[topics.Topic, ...],
) -> Module:
    lockstep = Lockstep(simulation, config.repeat_after_s)
    module.on(topics.MOTOR_COMMAND, lockstep.on_command, emits)
    module.on_start(lockstep.on_start, _required(run), emits)
    return module.every(REPEAT_CHECK_NS, lockstep.on_timer, emits)


def _required(run: Run) -> dict[str, int]:
    """The modules that must be ready before time begins: at least the simulation itself."""
    return run.participants or {"sim": 1}
