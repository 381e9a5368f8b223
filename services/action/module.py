"""Action: procedural memory, action selection and sensory-motor memory, in one process."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from cogmap.errors import MessageError
from cogmap.graph.graph import Graph
from cogmap.runtime.module import Module
from schemas import topics
from schemas.base import Message, Scalar
from schemas.cognition import Action, Broadcast, Competition
from schemas.graph import Delta, Phase
from schemas.nodes import NEVER_NS, PLAN_ID, Plan, PlanState, Self
from schemas.process import Clock
from schemas.sensing import MotorCommand, Pose, RangeScan, SelfMotion, SpeedLimit
from services.action.config import Config
from services.action.escape import Escape
from services.action.gate import LockstepGate
from services.action.motor import SensoryMotorMemory, halted, obstacle_ahead_m
from services.action.near import NearObstacles
from services.action.route import Route
from services.action.selection import HALT, ActionSelection
from services.action.stuck import StuckDetector

__all__ = ["ActionModule", "Config", "build"]

POSE_PHASES = frozenset({Phase.LOCALIZATION, Phase.LATE})


class Estimate(NamedTuple):
    """A committed pose of the self node, the stamp of its view, its cycle, and the plan then."""

    stamp_ns: int
    cycle: int
    pose: Pose
    plan: Plan | None


class ActionModule:
    """Broadcasts choose the action; each new pose of the self node leads to a motor command.

    It drives the route of the graph's plan, as it is when the pose is committed. In lockstep a
    command waits for what `LockstepGate` names. A pose that is published again, as the simulator
    publishes a frame again that nobody answered, is answered at once.
    """

    def __init__(self, config: Config, graph: Graph) -> None:
        self._config = config
        self._is_lockstep = config.mode == "lockstep"
        self._gate = LockstepGate()
        self._selection = ActionSelection(config)
        self._stuck = StuckDetector(config.stuck_m_s, config.stuck_after_s)
        self._escape = Escape(config)
        self._near = NearObstacles(config.half_width_m)
        self._motor = SensoryMotorMemory(config, self._near)

        self._graph = graph
        self._planned_ns = NEVER_NS
        self._route: Route | None = None
        self._without_route = SpeedLimit.NO_ROUTE

        self._chosen: Action | None = None
        self._is_resumed = False
        self._clear_m = math.inf
        self._newest_ns = 0
        self._waiting: Estimate | None = None
        self._answered: MotorCommand | None = None
        self._answered_cycle = 0
        self._broadcasts: list[Broadcast] = []

    def restore(self, past: Iterable[Message]) -> None:
        """Resume the action that was chosen last."""
        for message in past:
            if isinstance(message, Action):
                self._chosen = message
                self._is_resumed = True

    def chosen(self) -> Action:
        """The action that was chosen last. Raises MessageError where none was."""
        if self._chosen is None:
            raise MessageError("no action was selected yet")
        return self._chosen

    def on_clock(self, clock: Clock) -> MotorCommand | None:
        """Stop the robot, once, when its newest pose has become too old."""
        self._newest_ns = max(self._newest_ns, clock.stamp_ns)
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
        self._newest_ns = max(self._newest_ns, motion.stamp_ns)

        return self._replies()

    def on_scan(self, scan: RangeScan) -> list[Message]:
        """Measure how far it is free ahead.

        In lockstep a repeated scan is answered at once: by the command for the pose that waits, or
        by a halt where no pose has come since a restart.
        """
        self._clear_m = obstacle_ahead_m(scan, self._config.half_width_m)
        is_repeated = scan.stamp_ns == self._gate.scan_ns
        if not is_repeated:
            self._near.on_scan(scan)

        self._gate.scan_ns = scan.stamp_ns
        self._newest_ns = max(self._newest_ns, scan.stamp_ns)

        if is_repeated and self._is_lockstep and self._has_no_pose:
            return [self._remember(halted(scan.stamp_ns, SpeedLimit.NO_POSE))]
        return self._replies(at_once=is_repeated)

    def on_delta(self, delta: Delta) -> list[Message]:
        """Command the wheels for a new pose of the self node; repeat the command for a repeated
        pose.
        """
        pose = _self_pose(delta)
        if pose is None:
            return []

        if self._answered is not None and self._is_lockstep and self._is_answered(delta):
            return [self._answered]

        is_repeated = self._waiting is not None and self._waiting.stamp_ns == delta.stamp_ns
        plan = self._graph.get(Plan, PLAN_ID)
        self._waiting = Estimate(delta.stamp_ns, delta.cycle, pose, plan)
        if self._is_resumed:
            self._gate.resume(delta.cycle)
            self._is_resumed = False

        return self._replies(at_once=is_repeated and delta.phase is Phase.LOCALIZATION)

    def on_load(self) -> None:
        """Take up the plan of a graph that was loaded as a whole."""
        self._take(self._graph.get(Plan, PLAN_ID), self._graph.agent)

    def _take(self, plan: Plan | None, agent: Pose | Self | None) -> None:
        """Drive the route of a plan from where the agent is, where it is new. A route of one place
        is at its end.
        """
        if plan is None or plan.planned_ns == self._planned_ns:
            return

        is_at_goal = plan.state is PlanState.AT_GOAL
        self._without_route = SpeedLimit.AT_GOAL if is_at_goal else SpeedLimit.NO_ROUTE
        self._planned_ns = plan.planned_ns
        self._route = None
        if plan.state is not PlanState.READY or plan.route is None:
            return

        places_m = np.asarray(plan.route.numpy(), np.float64)
        if len(places_m) > 1:
            self._route = Route(places_m)
        if self._route is not None and agent is not None:
            self._route.join(agent.x_m, agent.y_m)

    def on_competition(self, competition: Competition) -> list[Message]:
        """A cycle's competition has ended."""
        self._gate.on_competition(competition)
        return self._replies()

    def on_broadcast(self, broadcast: Broadcast) -> list[Message]:
        """Choose an action by the content of consciousness."""
        self._gate.on_broadcast(broadcast.cycle)
        self._broadcasts.append(broadcast)
        return self._replies()

    def _replies(self, at_once: bool = False) -> list[Message]:
        """The actions that are due, and the command for the newest pose."""
        replies: list[Message] = [*self._actions()]
        command = self._command(at_once)
        if command is not None:
            replies += [command, *self._actions()]
        return replies

    def _actions(self) -> list[Action]:
        """What the broadcasts choose that are due."""
        due = [each for each in self._broadcasts if self._is_due(each)]
        self._broadcasts = [each for each in self._broadcasts if each not in due]

        chosen = [self._select(each) for each in due]
        return [action for action in chosen if action is not None]

    def _is_due(self, broadcast: Broadcast) -> bool:
        """Whether a broadcast chooses now: in lockstep after the command of its own cycle,
        whichever comes first, and before that of the next.
        """
        if not self._is_lockstep or broadcast.cycle <= self._answered_cycle:
            return True
        return self._waiting is not None and broadcast.cycle < self._waiting.cycle

    def _select(self, broadcast: Broadcast) -> Action | None:
        has_ended = self._route is None or self._route.left_m <= 0.0
        route = {"route_end": float(has_ended), "route_ahead": float(not has_ended)}

        selection = self._selection.select(broadcast.coalition.nodes, route)
        if selection is None:
            return None

        self._chosen = Action(
            stamp_ns=broadcast.stamp_ns,
            cycle=broadcast.cycle,
            scheme=selection.chosen.scheme,
            activation=selection.chosen.activation,
            parameters=self._parameters(),
            behaviours=selection.considered,
        )

        return self._chosen

    def _parameters(self) -> dict[str, Scalar]:
        if self._route is None:
            return {}
        return {"travelled_m": self._route.travelled_m}

    def _command(self, at_once: bool = False) -> MotorCommand | None:
        """The command for the newest pose, if there is one that waits for nothing any longer."""
        estimate = self._waiting
        if estimate is None:
            return None

        is_open = at_once or self._gate.is_open(estimate.stamp_ns, estimate.cycle)
        if self._is_lockstep and not is_open:
            return None

        self._waiting = None
        self._answered_cycle = estimate.cycle

        return self._remember(self._answer(estimate))

    def _answer(self, estimate: Estimate) -> MotorCommand:
        stamp_ns = estimate.stamp_ns
        age_ns = self._age_ns(stamp_ns)

        self._take(estimate.plan, estimate.pose)
        if self._route is None:
            return halted(stamp_ns, self._without_route, age_ns)

        self._route.advance(estimate.pose.x_m, estimate.pose.y_m)
        if self._chosen is None or self._chosen.scheme == HALT:
            return halted(stamp_ns, SpeedLimit.NO_ACTION, age_ns)

        command = self._motor.command(stamp_ns, estimate.pose, self._route, self._clear_m, age_ns)
        return self._escape.command(command, self._stuck.is_stuck)

    def _remember(self, command: MotorCommand) -> MotorCommand:
        wheels_rad_s = (command.left_wheel_rad_s + command.right_wheel_rad_s) / 2
        self._stuck.on_command(wheels_rad_s * self._config.wheel_radius_m)
        self._answered = command

        return command

    def _age_ns(self, stamp_ns: int) -> int:
        """How much older than the newest message a stamp is; 0 in lockstep, where time waits."""
        return 0 if self._is_lockstep else max(0, self._newest_ns - stamp_ns)

    @property
    def _has_no_pose(self) -> bool:
        """Whether no pose has come since the start: after a restart, the last one is not published
        again.
        """
        return self._answered is None and self._waiting is None

    def _is_answered(self, delta: Delta) -> bool:
        last = self._answered
        is_pose_of_view = delta.phase is Phase.LOCALIZATION
        return is_pose_of_view and last is not None and last.stamp_ns == delta.stamp_ns


def _self_pose(delta: Delta) -> Pose | None:
    """The pose of the self node in a delta that moves it, otherwise None."""
    agents = [item for item in delta.operations if isinstance(item, Self)]
    if delta.phase not in POSE_PHASES or not agents:
        return None

    agent = agents[-1]
    return Pose(x_m=agent.x_m, y_m=agent.y_m, heading_rad=agent.heading_rad)


def build(config: Config, instance: str) -> Module:
    """The module `action`."""
    graph = Graph()
    action = ActionModule(config, graph)
    replies = (topics.ACTION, topics.MOTOR_COMMAND)
    module = (
        Module("action", instance)
        .on(topics.SELF_MOTION, action.on_motion, emits=replies)
        .on(topics.SCAN, action.on_scan, emits=replies)
        .following(graph, action.on_delta, emits=replies, on_load=action.on_load)
        .on(topics.COMPETITION, action.on_competition, emits=replies)
        .on(topics.BROADCAST, action.on_broadcast, emits=replies)
        .journaling(topics.ACTION, action.restore, action.chosen)
    )
    if config.mode == "real_time":
        module.on(topics.CLOCK, action.on_clock, emits=replies)

    return module
