"""Which motor program is executed, and from when on. Pure."""

from __future__ import annotations

from cogmap.errors import MessageError
from cogmap.runtime.run import Run
from cogmap.schemas.cognition import Action, MotorProgram
from cogmap.schemas.nodes import Plan, Self
from cogmap.schemas.sensing import Pose, SpeedLimit
from cogmap.services.motor.aim import Aim
from cogmap.services.motor.config import Config
from cogmap.services.motor.guide import Guide, Track
from cogmap.services.motor.parameters import Parameters
from cogmap.services.motor.programs import FollowPlan, Halt, Program, program_of


class Execution:
    """Actions start motor programs; before the first one the robot stands.

    In lockstep an action counts after the command of its own cycle, whichever comes first, and
    before that of the next.
    """

    def __init__(self, config: Config, run: Run) -> None:
        self._config = config
        self._is_lockstep = run.lockstep
        self._follow = FollowPlan(config)
        self._track = Track()
        self._program: Program = Halt(self._follow)
        self._executed: MotorProgram | None = None
        self._actions: list[Action] = []

    @property
    def executed(self) -> MotorProgram:
        """Return the program that was started last. Raises MessageError if none was."""
        if self._executed is None:
            raise MessageError("no motor program was started yet")
        return self._executed

    def start(self, program: MotorProgram) -> None:
        """Execute a program, from its beginning. Raises MessageError if there is none."""
        before = self._program
        self._program = self._program_of(program.action, program.parameters)
        if isinstance(self._program, Guide) and isinstance(before, Guide):
            self._program.continue_from(before)
        self._executed = program

    def put(self, action: Action) -> None:
        """Keep an action until it counts; none that waits is of a later cycle. Raises MessageError
        if it has no motor program.
        """
        if action.scheme:
            self._program_of(action.action, action.parameters)
        self._actions = [each for each in self._actions if each.cycle <= action.cycle]
        self._actions.append(action)

    def started(self, answered_cycle: int, waiting_cycle: int | None) -> list[MotorProgram]:
        """Start the programs that are due after the command of `answered_cycle`, and return them.
        The pose to answer next is of `waiting_cycle`, None if none has come.
        """
        started = []
        waiting = []
        for action in self._actions:
            is_next = waiting_cycle is not None and action.cycle < waiting_cycle
            if self._is_lockstep and action.cycle > answered_cycle and not is_next:
                waiting.append(action)
            elif action.scheme and not self._is_executed(action):
                started.append(self._start(action))

        self._actions = waiting
        return started

    def take(self, plan: Plan | None, agent: Pose | Self | None) -> None:
        """Take this plan as the current one, if it is new."""
        self._follow.take(plan, agent)

    def aim(self, stamp_ns: int, pose: Pose) -> Aim | SpeedLimit:
        """Return where the program steers to from the pose at a time, or why it halts."""
        self._track.put(stamp_ns, pose)
        return self._program.aim(pose)

    def _program_of(self, action: str, parameters: Parameters) -> Program:
        return program_of(action, parameters, self._follow, self._config, self._track)

    def _is_executed(self, action: Action) -> bool:
        executed = self._executed
        if executed is None:
            return False
        return (executed.action, executed.parameters) == (action.action, action.parameters)

    def _start(self, action: Action) -> MotorProgram:
        program = MotorProgram(
            stamp_ns=action.stamp_ns,
            cycle=action.cycle,
            action=action.action,
            parameters=action.parameters,
        )
        self.start(program)
        return program
