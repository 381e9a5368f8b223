"""Sensory-motor memory as a module: motor programs of the chosen action, and reactive layers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from cogmap.graph.graph import Graph
from cogmap.robot import HALF_WIDTH_M, WHEEL_RADIUS_M
from cogmap.runtime.module import Module
from cogmap.runtime.run import REAL_TIME, Run
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.cognition import Action, Competition, MotorProgram
from cogmap.schemas.graph import Delta, Operation, Phase
from cogmap.schemas.nodes import PLAN_ID, Goal, Plan, Self
from cogmap.schemas.process import Clock
from cogmap.schemas.sensing import MotorCommand, Pose, RangeScan, SelfMotion, SpeedLimit
from cogmap.services.motor.aim import Aim
from cogmap.services.motor.config import Config
from cogmap.services.motor.execution import Execution
from cogmap.services.motor.gate import LockstepGate
from cogmap.services.motor.motor import SensoryMotorMemory, halted, obstacle_ahead_m
from cogmap.services.motor.programs import sought_by
from cogmap.services.motor.reactive.escape import Escape
from cogmap.services.motor.reactive.near import NearObstacles
from cogmap.services.motor.reactive.stuck import StuckDetector

__all__ = ["Config", "MotorModule", "build"]

POSE_PHASES = frozenset({Phase.LOCALIZATION, Phase.LATE})
BEFORE_POSE = frozenset({Phase.PERCEPTS, Phase.CORRECTION})


class Estimate(NamedTuple):
    """A committed pose of the self node, the stamp of its view, its cycle, and the plan then."""

    stamp_ns: int
    cycle: int
    pose: Pose
    plan: Plan | None


class MotorModule:
    """An action starts a motor program; each new pose of the self node leads to a motor command.

    The plan is that of the graph, as it is when the pose is committed. In lockstep a command waits
    for what `LockstepGate` names. A pose that is published again, as the simulator publishes a
    frame again that nobody answered, is answered at once. In a recording nothing can be moved:
    programs start and end, and each command says so.
    """

    def __init__(self, config: Config, graph: Graph, run: Run) -> None:
        self._config = config
        self._is_lockstep = run.lockstep
        self._is_recorded = run.has_any("player")
        self._gate = LockstepGate()
        self._stuck = StuckDetector(config.stuck_after_s)
        self._escape = Escape()
        self._near = NearObstacles(HALF_WIDTH_M)
        self._motor = SensoryMotorMemory(config, self._near)

        self._graph = graph
        self._execution = Execution(config, run)
        self._is_resumed = False
        self._has_joined = False
        self._clear_m = math.inf
        self._newest_ns: dict[topics.Topic, int] = {}
        self._waiting: Estimate | None = None
        self._answered: MotorCommand | None = None
        self._answered_cycle = 0
        self._sought: Goal | None = None
        self._offered: Offer | None = None

    def restore(self, past: Iterable[Message]) -> None:
        """Resume the program that was executed last. A turn begins anew."""
        for message in past:
            if isinstance(message, MotorProgram):
                self._execution.start(message)
                self._is_resumed = True

    def executed(self) -> MotorProgram:
        """Return the program that is executed. Raises MessageError if none was yet."""
        return self._execution.executed

    def on_clock(self, clock: Clock) -> MotorCommand | None:
        """Stop the robot, once, when its newest pose has become too old."""
        self._newest_ns[topics.CLOCK] = clock.stamp_ns
        last = self._answered
        if last is None or last.halted_by or self._waiting is not None:
            return None

        age_ns = self._age_ns(last.stamp_ns)
        if age_ns <= self._config.max_pose_age_s * 1e9:
            return None

        return self._remember(halted(last.stamp_ns, SpeedLimit.POSE_AGE, age_ns))

    def on_motion(self, motion: SelfMotion) -> list[Message]:
        """Compare the motion with the commands before it."""
        self._stuck.on_motion(motion)
        if motion.stamp_ns > self._gate.motion_ns:
            self._near.on_motion(motion)
        self._gate.motion_ns = motion.stamp_ns
        self._newest_ns[topics.SELF_MOTION] = motion.stamp_ns

        return self._replies()

    def on_scan(self, scan: RangeScan) -> list[Message]:
        """Measure how far it is free ahead.

        In lockstep a repeated scan is answered at once: by the command for the pose that waits, by
        a halt if no pose has come since a restart, or by the last offer, which the next cycle waits
        for, and the command for its view: both may have been lost.
        """
        self._clear_m = obstacle_ahead_m(scan)
        is_repeated = scan.stamp_ns == self._gate.scan_ns
        if not is_repeated:
            self._near.on_scan(scan)

        self._gate.scan_ns = scan.stamp_ns
        self._newest_ns[topics.SCAN] = scan.stamp_ns

        answered = self._answered
        is_unheard = is_repeated and self._is_lockstep
        if is_unheard and answered is None and self._waiting is None:
            command = self._remember(halted(scan.stamp_ns, SpeedLimit.NO_POSE))
            return [*self._offers(command), command]

        replies = self._replies(at_once=is_repeated)
        if not is_unheard or replies:
            return replies

        if self._offered is not None:
            replies.append(self._offered)
        if answered is not None and answered.stamp_ns == scan.stamp_ns:
            replies.append(answered)
        return replies

    def on_delta(self, delta: Delta) -> list[Message]:
        """Command the wheels for a new pose of the self node; repeat the command for a repeated
        pose.
        """
        agents = [item for item in delta.operations if isinstance(item, Self)]
        if delta.phase not in POSE_PHASES or not agents:
            return []

        answered = self._answered
        is_pose_of_view = delta.phase is Phase.LOCALIZATION
        is_answered = answered is not None and answered.stamp_ns == delta.stamp_ns
        if answered is not None and is_answered and is_pose_of_view and self._is_lockstep:
            return [answered]

        is_repeated = self._waiting is not None and self._waiting.stamp_ns == delta.stamp_ns
        plan = self._graph.get(Plan, PLAN_ID)
        agent = agents[-1]
        pose = Pose(x_m=agent.x_m, y_m=agent.y_m, heading_rad=agent.heading_rad)
        self._waiting = Estimate(delta.stamp_ns, delta.cycle, pose, plan)
        if self._is_resumed or self._has_joined:
            self._gate.resume(delta.cycle)
            self._is_resumed = False
            self._has_joined = False

        return self._replies(at_once=is_repeated and is_pose_of_view)

    def on_load(self) -> list[Message]:
        """Take up the plan of a graph that was loaded as a whole.

        In lockstep its pose is answered too if none as new was: whoever loads it was restarted, or
        has lost the delta of that pose, and nobody else will answer it. If one was, the next cycle
        may still wait for an offer.
        """
        graph = self._graph
        plan = graph.get(Plan, PLAN_ID)
        agent = graph.agent
        self._execution.take(plan, agent)
        if agent is None or not self._is_lockstep:
            return []

        answered = self._answered
        if answered is not None and agent.stamp_ns <= answered.stamp_ns:
            return [self._offer(answered.stamp_ns, graph.cycle)]

        cycle = graph.cycle - 1 if graph.phase in BEFORE_POSE else graph.cycle
        pose = Pose(x_m=agent.x_m, y_m=agent.y_m, heading_rad=agent.heading_rad)
        self._waiting = Estimate(agent.stamp_ns, cycle, pose, plan)
        self._has_joined = True
        self._gate.resume(cycle)
        return self._replies()

    def on_competition(self, competition: Competition) -> list[Message]:
        """Note that a cycle's competition has ended."""
        self._gate.on_competition(competition)
        return self._replies()

    def on_action(self, action: Action) -> list[Message]:
        """Start the motor program of an action. Raises MessageError if there is none.

        After a restart, actions come again that were executed already.
        """
        if self._is_resumed and action.cycle <= self._execution.executed.cycle:
            return []

        self._execution.put(action)
        self._gate.on_action(action.cycle)
        return self._replies()

    def _replies(self, at_once: bool = False) -> list[Message]:
        """Return the programs that start, and the command for the newest pose."""
        replies: list[Message] = [*self._programs()]
        command = self._command(at_once)
        if command is not None:
            replies += [*self._offers(command), command, *self._programs()]
        return replies

    def _programs(self) -> list[MotorProgram]:
        """Start the programs that are due; what they seek is offered with the next command."""
        waiting_cycle = None if self._waiting is None else self._waiting.cycle
        started = self._execution.started(self._answered_cycle, waiting_cycle)
        for program in started:
            goal = sought_by(program)
            if goal is not None:
                self._sought = goal

        return started

    def _offers(self, command: MotorCommand) -> list[Message]:
        """Offer the goal that is sought, if the agent has none of that name that can be reached; in
        lockstep, where the next cycle waits for an offer, perhaps offer nothing.
        """
        goal = self._sought
        self._sought = None
        operations: list[Operation] = []
        if goal is not None:
            plan = self._graph.get(Plan, PLAN_ID)
            is_in_vain = plan is not None and goal.id in plan.unreachable
            if is_in_vain or self._graph.get(Goal, goal.id) is None:
                operations.append(goal)

        if not operations and not self._is_lockstep:
            return []
        return [self._offer(command.stamp_ns, self._graph.cycle, operations)]

    def _offer(self, stamp_ns: int, cycle: int, operations: Sequence[Operation] = ()) -> Offer:
        """Make an offer; it is repeated without its operations."""
        self._offered = Offer(stamp_ns=stamp_ns, cycle=cycle, operations=[])
        return Offer(stamp_ns=stamp_ns, cycle=cycle, operations=[*operations])

    def _command(self, at_once: bool = False) -> MotorCommand | None:
        """Make the command for the newest pose, if one is there and waits for nothing more."""
        estimate = self._waiting
        if estimate is None:
            return None

        is_open = at_once or self._gate.is_open(estimate.stamp_ns, estimate.cycle)
        if self._is_lockstep and not is_open:
            return None

        if at_once:
            self._gate.resume(estimate.cycle)
        self._waiting = None
        self._answered_cycle = estimate.cycle

        stamp_ns = estimate.stamp_ns
        age_ns = self._age_ns(stamp_ns)
        self._execution.take(estimate.plan, estimate.pose)
        aim = self._execution.aim(stamp_ns, estimate.pose)
        if self._is_recorded:
            return self._remember(halted(stamp_ns, SpeedLimit.RECORDING, age_ns))
        if not isinstance(aim, Aim):
            return self._remember(halted(stamp_ns, aim, age_ns))

        command = self._motor.command(stamp_ns, aim, self._clear_m, age_ns)
        return self._remember(self._escape.command(command, self._stuck.is_stuck))

    def _remember(self, command: MotorCommand) -> MotorCommand:
        wheels_rad_s = (command.left_wheel_rad_s + command.right_wheel_rad_s) / 2
        self._stuck.on_command(wheels_rad_s * WHEEL_RADIUS_M)
        self._answered = command

        return command

    def _age_ns(self, stamp_ns: int) -> int:
        """Compute a stamp's age by the last clock, self-motion and scan: none of them counts
        after the next one comes; 0 in lockstep, where time waits.
        """
        newest_ns = max(self._newest_ns.values(), default=0)
        return 0 if self._is_lockstep else max(0, newest_ns - stamp_ns)


def build(config: Config, instance: str, run: Run = REAL_TIME) -> Module:
    """Build the module `motor`."""
    graph = Graph(with_places=False)
    motor = MotorModule(config, graph, run)
    replies = (topics.MOTOR_PROGRAM, topics.MOTOR_COMMAND, topics.OFFER)
    module = (
        Module("motor", instance)
        .on(topics.SELF_MOTION, motor.on_motion, emits=replies)
        .on(topics.SCAN, motor.on_scan, emits=replies)
        .following(graph, motor.on_delta, emits=replies, on_load=motor.on_load)
        .on(topics.COMPETITION, motor.on_competition, emits=replies)
        .on(topics.ACTION, motor.on_action, emits=replies)
        .journaling(topics.MOTOR_PROGRAM, motor.restore, motor.executed, backfill=[topics.ACTION])
    )
    if not run.lockstep:
        module.on(topics.CLOCK, motor.on_clock, emits=replies)

    return module
