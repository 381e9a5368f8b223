"""Motor programs: where each action aims, pose by pose. Pure."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from cogmap.errors import MessageError
from cogmap.schemas.cognition import ActionName, MotorProgram
from cogmap.schemas.nodes import NEVER_NS, Goal, Plan, PlanState, Self, goal_id
from cogmap.schemas.sensing import Pose, SpeedLimit
from cogmap.services.motor.aim import Aim, Speed, bearing_of
from cogmap.services.motor.config import Config
from cogmap.services.motor.guide import Guide, Track
from cogmap.services.motor.parameters import Parameters, number, word
from cogmap.services.motor.route import Route, pursuit

# A turn is complete when so little is left: 3 degrees.
TURNED_RAD = 0.05
# Chosen, not tuned: slow, and some two errors of a pose in the town (0.2 m) from the target.
DOCK_M_S = 0.5
DOCKED_M = 0.5


class Program(Protocol):
    """A motor program in execution."""

    def aim(self, pose: Pose) -> Aim | SpeedLimit:
        """Return where to steer to from a pose, or why to halt."""


class FollowPlan:
    """Drives the route of the graph's plan (paper §5.5), slower in bends, and stops at its end."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._planned_ns = NEVER_NS
        self._route: Route | None = None
        self._without_route = SpeedLimit.NO_ROUTE

    def take(self, plan: Plan | None, agent: Pose | Self | None) -> None:
        """Drive the route of a new plan from where the agent is. A route of one place is at its
        end.
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

    def aim(self, pose: Pose) -> Aim | SpeedLimit:
        """Aim at the point of the route that pure pursuit steers to."""
        route = self._route
        if route is None:
            return self._without_route

        return pursuit(route, pose, self._config)


class Halt:
    """Stands. The plan's own reason to halt goes first: the drive ends when it is at its goal."""

    def __init__(self, follow: FollowPlan) -> None:
        self._follow = follow

    def aim(self, pose: Pose) -> Aim | SpeedLimit:
        """Return why to halt."""
        aim = self._follow.aim(pose)
        return SpeedLimit.NO_ACTION if isinstance(aim, Aim) else aim


class Turn:
    """Turns on the spot by `turn_rad`, left positive, from the first pose that it is given."""

    def __init__(self, parameters: Parameters) -> None:
        self._left_rad = number(parameters, "turn_rad")
        self._heading_rad: float | None = None
        self._is_complete = False

    def aim(self, pose: Pose) -> Aim | SpeedLimit:
        """Aim in the direction that is left to turn to, a half turn at a time."""
        if self._heading_rad is not None:
            self._left_rad -= math.remainder(pose.heading_rad - self._heading_rad, math.tau)
        self._heading_rad = pose.heading_rad

        self._is_complete |= abs(self._left_rad) <= TURNED_RAD
        if self._is_complete:
            return SpeedLimit.NO_ACTION
        bearing_rad = min(max(self._left_rad, -math.pi), math.pi)
        return Aim(bearing_rad, math.inf, Speed(math.inf), on_the_spot=True)


class Dock:
    """Drives straight and slowly to `x_m` and `y_m`, and stands there."""

    def __init__(self, parameters: Parameters) -> None:
        self._x_m = number(parameters, "x_m")
        self._y_m = number(parameters, "y_m")
        self._is_docked = False

    def aim(self, pose: Pose) -> Aim | SpeedLimit:
        """Aim at the target, until it is reached."""
        away_m = math.hypot(self._x_m - pose.x_m, self._y_m - pose.y_m)
        self._is_docked |= away_m <= DOCKED_M
        if self._is_docked:
            return SpeedLimit.NO_ACTION

        bearing_rad = bearing_of(self._x_m, self._y_m, pose)
        return Aim(bearing_rad, away_m, Speed(DOCK_M_S))


def program_of(
    action: str, parameters: Parameters, follow: FollowPlan, config: Config, track: Track
) -> Program:
    """Make an action's motor program. Raises MessageError if it has none, or lacks a parameter."""
    match action:
        case ActionName.FOLLOW_PLAN:
            return follow
        case ActionName.HALT:
            return Halt(follow)
        case ActionName.SEEK:
            return follow
        case ActionName.TURN:
            return Turn(parameters)
        case ActionName.DOCK:
            return Dock(parameters)
        case ActionName.GUIDE:
            return Guide(parameters, config, track)
    raise MessageError(f"no motor program for {action!r}: there are {', '.join(ActionName)}")


def sought_by(program: MotorProgram) -> Goal | None:
    """Return the goal that a motor program gives the agent; None if it is not one that seeks.

    Raises MessageError if it lacks a parameter.
    """
    if program.action != ActionName.SEEK:
        return None

    need = word(program.parameters, "need")
    sought = word(program.parameters, "object")
    return Goal(id=goal_id(need), base_level=1.0, object=sought, need=need)
