"""Motor programs: where each action aims, pose by pose. Pure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Protocol

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats
from cogmap.geometry.polylines import distances_along
from cogmap.geometry.se2 import transform_from
from schemas.base import Scalar
from schemas.cognition import ActionName
from schemas.nodes import NEVER_NS, Plan, PlanState, Self
from schemas.sensing import Pose, SpeedLimit
from services.motor.aim import Aim, Speed, bearing_of, slowest
from services.motor.config import Config
from services.motor.route import Route

TURNED_RAD = 0.05
TRACKED_POSES = 64
SHORT_M = 1.0
Parameters = Mapping[str, Scalar]


class Program(Protocol):
    """A motor program in execution."""

    def aim(self, pose: Pose) -> Aim | SpeedLimit:
        """Where to steer to from a pose, or why to halt."""


class FollowPlan:
    """Drives the route of the graph's plan (paper §5.5), slower in bends, and stops at its end."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._planned_ns = NEVER_NS
        self._route: Route | None = None
        self._without_route = SpeedLimit.NO_ROUTE

    def take(self, plan: Plan | None, agent: Pose | Self | None) -> None:
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

    def aim(self, pose: Pose) -> Aim | SpeedLimit:
        """The point of the route that pure pursuit steers to."""
        route = self._route
        if route is None:
            return self._without_route

        return _pursuit(route, pose, self._config)


class Halt:
    """Stands. What the plan has to say about it goes first: the drive ends where it is at its
    goal.
    """

    def __init__(self, follow: FollowPlan) -> None:
        self._follow = follow

    def aim(self, pose: Pose) -> Aim | SpeedLimit:
        """Why to halt."""
        aim = self._follow.aim(pose)
        return SpeedLimit.NO_ACTION if isinstance(aim, Aim) else aim


class Turn:
    """Turns on the spot by `turn_rad`, left positive, from the first pose that it is given."""

    def __init__(self, parameters: Parameters) -> None:
        self._left_rad = number(parameters, "turn_rad")
        self._heading_rad: float | None = None
        self._is_complete = False

    def aim(self, pose: Pose) -> Aim | SpeedLimit:
        """The direction that is left to turn to, a half turn at a time."""
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

    def __init__(self, parameters: Parameters, config: Config) -> None:
        self._x_m = number(parameters, "x_m")
        self._y_m = number(parameters, "y_m")
        self._config = config
        self._is_docked = False

    def aim(self, pose: Pose) -> Aim | SpeedLimit:
        """The target, until it is reached."""
        away_m = math.hypot(self._x_m - pose.x_m, self._y_m - pose.y_m)
        self._is_docked |= away_m <= self._config.docked_m
        if self._is_docked:
            return SpeedLimit.NO_ACTION

        bearing_rad = bearing_of(self._x_m, self._y_m, pose)
        return Aim(bearing_rad, away_m, Speed(self._config.dock_m_s))


class Track:
    """The poses of late, by their stamps."""

    def __init__(self) -> None:
        self._poses: dict[int, Pose] = {}

    def put(self, stamp_ns: int, pose: Pose) -> None:
        """The agent is there now."""
        self._poses[stamp_ns] = pose
        while len(self._poses) > TRACKED_POSES:
            del self._poses[min(self._poses)]

    def at(self, stamp_ns: int) -> Pose | None:
        """The pose at a time; None where that is not known."""
        return self._poses.get(stamp_ns)


class Guide:
    """Drives through the places `ahead_1_m` and `left_1_m`, `ahead_2_m` and so on, of the pose at
    `seen_ns`, and stands at the last; where the path is shorter than SHORT_M it is there already.

    They are kept by path integration: by how the pose has changed since. Where the pose then is not
    known, as after a restart, it is the first that is given.
    """

    def __init__(self, parameters: Parameters, config: Config, track: Track) -> None:
        self._seen_ns = _stamp(parameters, "seen_ns")
        self._places_m = _places(parameters)
        self._config = config
        self._track = track
        self._route: Route | None = None

        self._is_short = distances_along(self._places_m)[-1] <= max(SHORT_M, config.guided_m)

    def aim(self, pose: Pose) -> Aim | SpeedLimit:
        """The point of the path that pure pursuit steers to, until the path ends."""
        if self._is_short:
            return SpeedLimit.NO_ACTION
        if self._route is None:
            self._route = self._route_from(self._track.at(self._seen_ns) or pose)
            self._route.join(pose.x_m, pose.y_m)

        aim = _pursuit(self._route, pose, self._config)
        return SpeedLimit.NO_ACTION if self._route.left_m <= self._config.guided_m else aim

    def _route_from(self, seen: Pose) -> Route:
        frame = np.array([seen.x_m, seen.y_m, seen.heading_rad])
        return Route(transform_from(frame, self._places_m))


def _pursuit(route: Route, pose: Pose, config: Config) -> Aim:
    """The point of a route that pure pursuit steers to from a pose, slower in bends."""
    route.advance(pose.x_m, pose.y_m)
    lookahead_m = config.lookahead_m
    x_m, y_m = route.ahead(lookahead_m)
    away_m = math.hypot(x_m - pose.x_m, y_m - pose.y_m)
    distance_m = max(lookahead_m / 2, away_m)
    return Aim(bearing_of(x_m, y_m, pose), distance_m, _speed(route, config))


def _speed(route: Route, config: Config) -> Speed:
    """The highest speed that the bend ahead and the end of the route allow."""
    braking_distance_m = config.cruise_m_s**2 / (2 * config.braking_m_s2)
    bend_per_m = route.sharpest(braking_distance_m)
    in_bend_m_s = math.sqrt(config.lateral_m_s2 / max(bend_per_m, 1e-6))
    to_end_m_s = math.sqrt(2 * config.braking_m_s2 * route.left_m)
    return slowest(
        Speed(config.cruise_m_s),
        Speed(in_bend_m_s, SpeedLimit.BEND),
        Speed(to_end_m_s, SpeedLimit.ROUTE_END),
    )


def program_of(
    action: str, parameters: Parameters, follow: FollowPlan, config: Config, track: Track
) -> Program:
    """The motor program of an action. Raises MessageError where there is none, or where it lacks a
    parameter.
    """
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
            return Dock(parameters, config)
        case ActionName.GUIDE:
            return Guide(parameters, config, track)
    raise MessageError(f"no motor program for {action!r}: there are {', '.join(ActionName)}")


def number(parameters: Parameters, name: str) -> float:
    """A parameter that is a number. Raises MessageError where it is none."""
    value = parameters.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise MessageError(f"motor program: parameter {name!r} is {value!r}, not a number")
    return float(value)


def _stamp(parameters: Parameters, name: str) -> int:
    """A parameter that is a time in ns. Raises MessageError where it is none."""
    value = parameters.get(name)
    if isinstance(value, bool) or not isinstance(value, int):
        raise MessageError(f"motor program: parameter {name!r} is {value!r}, not a time in ns")
    return value


def _places(parameters: Parameters) -> Floats:
    """(n, 2): the places that parameters number from 1. Raises MessageError where one lacks a
    coordinate, or there are fewer than two.
    """
    places_m: list[list[float]] = []
    while f"ahead_{len(places_m) + 1}_m" in parameters or len(places_m) < 2:
        each = len(places_m) + 1
        places_m.append([number(parameters, f"{name}_{each}_m") for name in ("ahead", "left")])
    return np.array(places_m)
