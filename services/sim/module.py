"""The simulation as a module: frames and odometry out, motor commands in."""

from __future__ import annotations

from collections import deque

from cogmap.runtime.module import Module
from schemas import topics
from schemas.base import Message
from schemas.sensing import MotorCommand
from services.sim.config import Config, check
from services.sim.scripted.camera_level import CameraLevelSim
from services.sim.scripted.percept_level import PerceptLevelSim
from services.sim.scripted.trajectory import Way
from services.sim.simulation import Simulation

__all__ = ["Config", "build"]

CATCH_UP_NS = 250_000_000
PATIENCE_NS = 1_000_000_000
TOWN_PERIOD_NS = 5_000_000_000
_RATE_WINDOW_NS = 1_000_000_000
_TELLS = (topics.CLOCK, topics.TRUE_POSE, topics.TRUE_TOWN)
_EMITS = (*_TELLS, topics.ODOMETRY, topics.STEREO)
_EMITS_LED = (*_TELLS, topics.SELF_MOTION, topics.SCAN, topics.PERCEPTS)


class Lockstep:
    """Time goes on by one frame for each motor command that answers the last frame, until the route
    is complete.
    """

    def __init__(self, simulation: Simulation | PerceptLevelSim | CameraLevelSim) -> None:
        self._simulation = simulation
        self._asked_ns: int | None = None

    def start(self) -> list[Message]:
        """The town, and the first frame."""
        return [self._simulation.town(), *self._advance()]

    def command(self, command: MotorCommand) -> list[Message] | None:
        """The next frame and what led to it, if `command` answers the last one; else it is passed
        over.
        """
        if command.stamp_ns != self._asked_ns or self._simulation.progress >= 1.0:
            return None
        self._simulation.drive(command)
        return self._advance()

    def _advance(self) -> list[Message]:
        simulation = self._simulation
        said = [message for _ in range(simulation.ticks_per_frame) for message in simulation.step()]
        self._asked_ns = simulation.now_ns
        return [*said, simulation.clock(0.0), simulation.truth(), *simulation.view()]


class RealTime:
    """Time goes on as the wall's does, but slips where more than CATCH_UP_NS would have to be
    caught up.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._started = False
        self._owed_ns = 0
        self._seen_ns: int | None = None
        self._history: deque[tuple[int, int]] = deque()
        self._command_ns = -1
        self._heard_ns = 0

    def start(self) -> None:
        """Time begins with the next tick."""
        self._started = True

    def command(self, command: MotorCommand) -> None:
        """Drive as the newest command says; an older one that comes late is passed over."""
        if command.stamp_ns > self._simulation.now_ns or command.stamp_ns < self._command_ns:
            return
        self._command_ns = command.stamp_ns
        self._heard_ns = self._simulation.now_ns
        self._simulation.drive(command)

    def tick(self, wall_ns: int) -> list[Message]:
        """What there is to say until `wall_ns`, on a monotonic clock."""
        if not self._started:
            return []
        first = self._seen_ns is None
        since_ns = wall_ns - (wall_ns if self._seen_ns is None else self._seen_ns)
        self._seen_ns = wall_ns
        self._owed_ns = (
            self._simulation.tick_ns if first else min(self._owed_ns + since_ns, CATCH_UP_NS)
        )
        said: list[Message] = []
        frame_due = False
        while self._owed_ns >= self._simulation.tick_ns:
            frame_due |= self._step(said)
        if said:
            said += [self._simulation.clock(self._rate(wall_ns)), self._simulation.truth()]
        if frame_due:
            said.append(self._simulation.frame())
        return said

    def _step(self, said: list[Message]) -> bool:
        """Let one tick pass; whether a frame is due at its end."""
        simulation = self._simulation
        if simulation.now_ns - self._heard_ns >= PATIENCE_NS:
            simulation.brake()
        if simulation.now_ns % TOWN_PERIOD_NS == 0:
            said.append(simulation.town())
        said.append(simulation.tick())
        self._owed_ns -= simulation.tick_ns
        return simulation.now_ns // simulation.tick_ns % simulation.ticks_per_frame == 0

    def _rate(self, wall_ns: int) -> float:
        """Simulated over wall time in the last second."""
        self._history.append((wall_ns, self._simulation.now_ns))
        while len(self._history) > 2 and wall_ns - self._history[0][0] > _RATE_WINDOW_NS:
            self._history.popleft()
        passed_ns = wall_ns - self._history[0][0]
        return (self._simulation.now_ns - self._history[0][1]) / passed_ns if passed_ns else 1.0


def build(config: Config, instance: str = "sim") -> Module:
    """The simulation module. Raises ConfigError as `check` does."""
    check(config)
    awaits = config.awaits or {"sim": 1}
    if config.way is not None:
        return _led(config, config.way, Module("sim", instance), awaits)
    simulation = Simulation(config)
    module = Module("sim", instance).journaling(
        topics.TRUE_POSE, simulation.resume, simulation.truth
    )
    if config.mode == "lockstep":
        lockstep = Lockstep(simulation)
        return module.on(topics.MOTOR_COMMAND, lockstep.command, _EMITS).on_start(
            lockstep.start, awaits, _EMITS
        )
    real_time = RealTime(simulation)
    module.on(topics.MOTOR_COMMAND, real_time.command).on_start(real_time.start, awaits)
    return module.every(simulation.tick_ns, real_time.tick, _EMITS)


def _led(config: Config, way: Way, module: Module, awaits: dict[str, int]) -> Module:
    """`module` with a robot that is led along `way`."""
    if way.sensing == "cameras":
        cameras = Lockstep(CameraLevelSim(config, way))
        says = _EMITS
        return module.on(topics.MOTOR_COMMAND, cameras.command, says).on_start(
            cameras.start, awaits, says
        )
    led = Lockstep(
        PerceptLevelSim(way, config.noise, config.percepts, config.frame_hz, config.seed)
    )
    return module.on(topics.MOTOR_COMMAND, led.command, _EMITS_LED).on_start(
        led.start, awaits, _EMITS_LED
    )
