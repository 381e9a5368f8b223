"""Action: procedural memory, action selection and sensory-motor memory, in one process."""

from __future__ import annotations

import math
from collections.abc import Iterable

from cogmap.errors import MessageError
from cogmap.runtime.module import Module
from schemas import topics
from schemas.base import Message
from schemas.cognition import Action, Broadcast, Competition
from schemas.graph import Delta, Node
from schemas.sensing import MotorCommand, Pose, RangeScan
from services.action.config import Config
from services.action.motor import SensoryMotorMemory, obstacle_ahead_m
from services.action.route import Route
from services.action.selection import HALT, ActionSelection

__all__ = ["ActionModule", "Config", "build"]

SELF = "self"


class ActionModule:
    """Broadcasts choose the action; each new estimate of the self node's pose brings a motor
    command.

    In lockstep the command waits for the view's scan and for the competition of the cycle before,
    so that it depends on nothing but what was sensed.
    """

    def __init__(self, config: Config) -> None:
        self._config = config
        self._route = (
            Route(config.route, config.corner_radius_m, config.overrun_m) if config.route else None
        )
        self._selection = ActionSelection(config)
        self._motor = None if self._route is None else SensoryMotorMemory(config, self._route)
        self._scheme = ""
        self._competed = 0
        self._heard = 0
        self._won = False
        self._clear_m = math.inf
        self._scanned_ns = -1
        self._waiting: tuple[Delta, Pose] | None = None
        self._chosen: Action | None = None

    def restore(self, past: Iterable[Message]) -> None:
        """Take up the action that was selected last, and the route from where it was then."""
        for message in past:
            if isinstance(message, Action):
                self._chosen = message
                self._scheme = message.scheme
        if self._chosen is not None and self._route is not None:
            self._route.resume(float(self._chosen.parameters.get("travelled_m", 0.0)))

    def chosen(self) -> Action:
        """The action that was selected last. Raises MessageError where none was."""
        if self._chosen is None:
            raise MessageError("no action was selected yet")
        return self._chosen

    def on_scan(self, scan: RangeScan) -> MotorCommand | None:
        """See how far the way is clear."""
        self._clear_m = obstacle_ahead_m(scan, self._config.half_width_m)
        self._scanned_ns = scan.stamp_ns
        return self._command()

    def on_delta(self, delta: Delta) -> MotorCommand | None:
        """The self node has moved: act on it."""
        nodes = [item for item in delta.operations if isinstance(item, Node) and item.id == SELF]
        if delta.phase not in {"localization", "late"} or not nodes:
            return None
        place = nodes[-1].attributes
        pose = Pose(
            x_m=float(place["x_m"]),
            y_m=float(place["y_m"]),
            heading_rad=float(place["heading_rad"]),
        )
        self._waiting = (delta, pose)
        return self._command()

    def on_competition(self, competition: Competition) -> MotorCommand | None:
        """How far the global workspace has come."""
        self._competed, self._won = competition.cycle, bool(competition.trigger)
        return self._command()

    def on_broadcast(self, broadcast: Broadcast) -> list[Message]:
        """Select an action by what has become conscious."""
        self._heard = broadcast.cycle
        return [
            message for message in (self._select(broadcast), self._command()) if message is not None
        ]

    def _select(self, broadcast: Broadcast) -> Action | None:
        ended = self._route is None or self._route.left_m <= 0.0
        chosen = self._selection.select(
            broadcast.coalition.content,
            {"route_end": float(ended), "route_ahead": float(not ended)},
        )
        if chosen is None:
            return None
        scheme, activation = chosen
        self._scheme = scheme.name
        self._chosen = Action(
            stamp_ns=broadcast.stamp_ns,
            cycle=broadcast.cycle,
            scheme=scheme.name,
            activation=activation,
            parameters=self._parameters(),
        )
        return self._chosen

    def _parameters(self) -> dict[str, float | int | str | bool]:
        if self._route is None:
            return {}
        leg = self._route.leg
        length_m, turn_rad = self._config.route[leg]
        return {
            "leg": leg,
            "length_m": length_m,
            "turn_rad": turn_rad,
            "travelled_m": self._route.travelled_m,
        }

    def _command(self) -> MotorCommand | None:
        """The command for the newest pose, once everything that it depends on has come."""
        if self._waiting is None:
            return None
        delta, pose = self._waiting
        heard = not self._won or self._heard >= self._competed
        ready = self._scanned_ns >= delta.stamp_ns and self._competed >= delta.cycle - 1 and heard
        if self._config.mode == "lockstep" and not ready:
            return None
        self._waiting = None
        if self._motor is None:
            return MotorCommand(
                stamp_ns=delta.stamp_ns,
                left_wheel_rad_s=0.0,
                right_wheel_rad_s=0.0,
                halted_by="no route",
            )
        moving = self._scheme not in {"", HALT}
        return self._motor.command(delta.stamp_ns, pose, self._clear_m, moving)


def build(config: Config, instance: str) -> Module:
    """The module `action`."""
    action = ActionModule(config)
    commands = (topics.MOTOR_COMMAND,)
    return (
        Module("action", instance)
        .on(topics.SCAN, action.on_scan, emits=commands)
        .on(topics.DELTA, action.on_delta, emits=commands)
        .on(topics.COMPETITION, action.on_competition, emits=commands)
        .on(topics.BROADCAST, action.on_broadcast, emits=[topics.ACTION, *commands])
        .journaling(topics.ACTION, action.restore, action.chosen)
    )
