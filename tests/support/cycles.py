"""Cognitive cycles written for a test: what is published from percepts to the motor command."""

from __future__ import annotations

import numpy as np

from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import (
    Action,
    Behaviour,
    Broadcast,
    Coalition,
    Coalitions,
    Rejection,
)
from cogmap.schemas.graph import Delta, DropNode, Phase
from cogmap.schemas.nodes import SELF_ID, Self
from cogmap.schemas.sensing import MotorCommand, Percept, Percepts
from cogmap.services.global_workspace.config import Config
from cogmap.services.global_workspace.module import GlobalWorkspace
from cogmap.testing import landmark
from tests.support.logs import Row

MS_NS = 10**6
CYCLE_NS = 100 * MS_NS
MAY_HALT = (
    Behaviour(scheme="follow_route", activation=0.9),
    Behaviour(scheme="halt", activation=0.4, rejection=Rejection.LESS_ACTIVE),
)
AGENT = Self(id=SELF_ID, x_m=3.0, y_m=-1.0, heading_rad=0.0, samples=Matrix.of([[3.0, -1.0, 0.0]]))


class Cycles:
    """The rows of a log, cycle by cycle; a real global workspace decides what is broadcast.

    The view of cycle n is of n x CYCLE_NS, and its percepts are published then.
    """

    def __init__(self, config: Config | None = None) -> None:
        self.rows: list[Row] = []
        self._workspace = GlobalWorkspace(config or Config())

    def add(self, cycle: int, *, acts: bool = True, ids: bool = True, **activations: float) -> None:
        """A cycle in which codelets bring coalitions, which may be broadcast and acted upon."""
        self._add(cycle, 0, percepts(cycle))
        self._add(cycle, 10, delta(cycle, Phase.PERCEPTS))
        self._add(cycle, 20, delta(cycle, Phase.LOCALIZATION, f"{cycle}/localization"))

        brought = [
            coalition(name, value, f"{cycle}/{name}/0" if ids else "")
            for name, value in activations.items()
        ]
        found = Coalitions(stamp_ns=cycle * CYCLE_NS, cycle=cycle, coalitions=brought)
        self._add(cycle, 30, found)
        for message in self._workspace.on_coalitions(found):
            self._add(cycle, 40, message)
            if acts and isinstance(message, Broadcast):
                self._add(cycle, 50, action(cycle))
        self._add(cycle, 60, command(cycle))

    def add_without_attention(self, cycle: int) -> None:
        """A cycle that ended at its deadline, before its attention codelets had answered."""
        self._add(cycle, 0, percepts(cycle))
        self._add(cycle, 10, delta(cycle, Phase.PERCEPTS))
        self._add(cycle, 60, delta(cycle, Phase.END))

    def _add(self, cycle: int, after_ms: int, message: Message) -> None:
        self.rows.append((cycle * CYCLE_NS + after_ms * MS_NS, message))


def percepts(cycle: int, *labels: str) -> Percepts:
    """A library, or what is named, recognised in the view of a cycle."""
    nowhere = Array.of(np.empty((0, 2), np.float32))
    return Percepts(
        stamp_ns=cycle * CYCLE_NS,
        frame=cycle,
        objects=[percept(label) for label in labels or ("library",)],
        road_m=nowhere,
    )


def percept(label: str) -> Percept:
    """An object 12 m ahead."""
    return Percept(
        name=label,
        activation=0.9,
        evidence=0.9,
        bearing_rad=0.5,
        range_m=12.0,
        bearing_sd_rad=0.02,
        range_sd_m=0.4,
        width_m=6.0,
        height_m=6.0,
        whole=True,
        box_px=(4, 6, 8, 10),
    )


def delta(cycle: int, phase: Phase, *tasks: str) -> Delta:
    """A commit of one operation."""
    return Delta(
        stamp_ns=cycle * CYCLE_NS,
        version=100 * cycle,
        cycle=cycle,
        phase=phase,
        tasks=list(tasks),
        operations=[DropNode(id="percept:gone")],
    )


def coalition(codelet: str, activation: float, name: str) -> Coalition:
    """The agent and a library, by that id."""
    library = landmark("library", [(15.0, 0.0)])
    return Coalition(id=name, codelet=codelet, activation=activation, nodes=[AGENT, library])


def action(cycle: int) -> Action:
    """The route is followed; a halt was less active."""
    return Action(
        stamp_ns=cycle * CYCLE_NS,
        cycle=cycle,
        scheme=MAY_HALT[0].scheme,
        activation=MAY_HALT[0].activation,
        parameters={},
        behaviours=list(MAY_HALT),
    )


def command(cycle: int) -> MotorCommand:
    """Straight ahead."""
    return MotorCommand(stamp_ns=cycle * CYCLE_NS, left_wheel_rad_s=10.0, right_wheel_rad_s=10.0)
